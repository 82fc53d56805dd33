"""What the experiments share: data, seeds, orders, and what one learned that another needs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from mplearn.errors import InvalidValueError

if TYPE_CHECKING:
    from mplearn.evaluation import LabelKind
    from mplearn.evaluation.experiments import Outcome, Seen
    from mplearn.recording import Recording


@dataclass(frozen=True)
class Setting:
    """What to evaluate on.

    Attributes:
        data: A recording or a folder of them; a name of a built-in source otherwise.
        seeds: Seeds of synthetic sessions and of walks.
        orders: Orders of presentation a person.
        wrong: Folder of the same movements performed wrongly on purpose; None where there is none.
    """

    data: str
    seeds: tuple[int, ...] = (101, 102, 103)
    orders: int = 5
    wrong: Path | None = None

    def __post_init__(self) -> None:
        if self.orders < 1:
            raise InvalidValueError(f"orders must be at least 1, not {self.orders}")

    @cached_property
    def recordings(self) -> tuple[Recording, ...]:
        """All recordings of the data."""
        from mplearn.mocap import open_recordings

        return open_recordings(self.data)

    @cached_property
    def kind(self) -> LabelKind:
        """What the labels of the recordings are."""
        from mplearn.evaluation import kind_of_labels

        return kind_of_labels(self.recordings)

    @property
    def only_markers(self) -> bool:
        """Whether there are markers, and no labels at all."""
        labelled = any(each.labels for each in self.recordings)
        return not labelled and any(each.is_markers for each in self.recordings)

    @cached_property
    def takes(self) -> tuple[Recording, ...]:
        """The recordings that are evaluated.

        Raises:
            InvalidValueError: None can be.
        """
        chosen = self._suitable(self.recordings)
        if not chosen:
            raise InvalidValueError(f"{self.data} holds no two labelled repetitions of a movement")
        return chosen

    @property
    def left_out(self) -> tuple[str, ...]:
        """Names of the recordings that are not."""
        chosen = {take.name for take in self.takes}
        return tuple(each.name for each in self.recordings if each.name not in chosen)

    @cached_property
    def wrong_takes(self) -> tuple[Recording, ...]:
        """The takes that were performed wrongly; none where there is no folder of them."""
        from mplearn.mocap import open_recordings

        if self.wrong is None or not self.takes:
            return ()
        first = self.takes[0]
        found = open_recordings(self.wrong, rate_hz=first.rate_hz)
        return self._suitable([take for take in found if take.channels == first.channels])

    def _suitable(self, recordings: Sequence[Recording]) -> tuple[Recording, ...]:
        from mplearn.evaluation import alike, repeating

        if self.only_markers:
            return alike([each for each in recordings if each.is_markers])
        if self.kind == "repetitions":
            return alike(repeating(recordings))
        labelled = tuple(each for each in recordings if each.labels)
        return labelled if self.kind == "activities" else alike(labelled)

    @cached_property
    def paper_outcomes(self) -> list[tuple[str, Outcome]]:
        """What came of learning sessions like the paper's, one a seed."""
        from mplearn.evaluation.experiments import learn_paper_sessions

        return list(learn_paper_sessions(self.seeds))

    @cached_property
    def people_outcomes(self) -> list[tuple[str, Outcome]]:
        """What came of learning each person's sessions, in all orders."""
        from mplearn.evaluation.experiments import learn_people

        return list(learn_people(self.takes, self.orders))

    @cached_property
    def sessions(self) -> list[tuple[str, Recording]]:
        """Each person's takes as sessions, in all orders, as the learner sees them."""
        from mplearn.evaluation.experiments import observed_sessions

        return list(observed_sessions(self.takes, self.orders))

    @cached_property
    def seen(self) -> list[tuple[str, Seen]]:
        """The same sessions, segmented."""
        from mplearn.evaluation.experiments import Seen

        return [(session.person or "unnamed", Seen.of(session)) for _, session in self.sessions]

    @cached_property
    def paper_seen(self) -> list[tuple[str, Seen]]:
        """Sessions like the paper's, segmented."""
        from mplearn.demonstrator import paper_session
        from mplearn.evaluation.experiments import Seen

        shown = (paper_session(seed) for seed in self.seeds)
        return [("paper_session", Seen.of(each.recording, each.truth)) for each in shown]
