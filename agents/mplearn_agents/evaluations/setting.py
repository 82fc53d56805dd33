"""What the experiments share: data, seeds, orders, and what one learned that another needs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from mplearn.errors import InvalidValueError, MPLearnError, RecordingError

if TYPE_CHECKING:
    from mplearn.evaluation import Annotations, LabelKind
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

    Example:
        >>> setting = Setting("synthetic", seeds=(101,))
        >>> setting.seeds, setting.wrong is None
        ((101,), True)
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
        """All recordings of the data that can be read, in the files' own channels."""
        from mplearn.mocap import open_takes

        opened = open_takes(self.data)
        self._refused.update(opened.unreadable)
        return opened.recordings

    @cached_property
    def bodies(self) -> tuple[Recording, ...]:
        """The recordings as a learner takes them: people as points of one body, at own rates.

        Those of most channels are taken: of one marker set, or, where there are no points, as they
        are.
        """
        from mplearn.anatomy import as_bodies
        from mplearn.evaluation import alike
        from mplearn.mocap import Hints, open_takes

        found = self.recordings
        if not all(each.is_markers for each in found):
            found = open_takes(self.data, positions=True, hints=Hints(joint_axes=True)).recordings
        people = tuple(each for each in found if each.is_markers)
        if not people:
            return alike(found)
        bodies = as_bodies(people)
        self._refused.update(bodies.refused)
        return alike(bodies.recordings)

    @cached_property
    def annotations(self) -> tuple[Annotations, ...]:
        """Tables of labels that lie beside the recordings."""
        from mplearn.evaluation import read_annotations

        folder = Path(self.data) if Path(self.data).is_dir() else Path(self.data).parent
        found: list[Annotations] = []
        for path in sorted(folder.glob("*.json")):
            try:
                table = read_annotations(path)
            except RecordingError as error:
                self._refused[path.name] = error
                continue
            if table is not None:
                found.append(table)
        return tuple(found)

    @cached_property
    def annotated(self) -> list[tuple[str, tuple[Recording, ...]]]:
        """The bodies with labels, those beside each first ("") and then each table's, by name."""
        groups = [("", tuple(each for each in self.bodies if each.labels))]
        groups += [(table.name, self._labelled(table, self.bodies)) for table in self.annotations]
        return [(name, takes) for name, takes in groups if takes]

    @property
    def described(self) -> tuple[Recording, ...]:
        """All bodies, each once, with the first labels that there are of it.

        Where names tell contents, these are the labels.
        """
        if not self.unlabelled and self.kind == "contents":
            return tuple(_by_name(take) for take in self.bodies)
        labelled = {take.name: take for _, takes in reversed(self.annotated) for take in takes}
        return tuple(labelled.get(take.name, take) for take in self.bodies)

    @cached_property
    def kind(self) -> LabelKind:
        """What the labels of the recordings are."""
        from mplearn.evaluation import content_of, kind_of_labels

        labelled = any(each.labels for each in self.recordings)
        if not labelled and any(
            each.name in table.stretches for table in self.annotations for each in self.recordings
        ):
            return "activities"
        told = sum(content_of(each.name) is not None for each in self.recordings)
        if not labelled and 2 * told > len(self.recordings):
            return "contents"
        return kind_of_labels(self.recordings)

    @property
    def unlabelled(self) -> bool:
        """Whether there are people, and no labels at all."""
        from mplearn.evaluation import content_of

        known = {name for table in self.annotations for name in table.stretches}
        told = sum(content_of(each.name) is not None for each in self.recordings)
        return (
            not any(each.labels or each.name in known for each in self.recordings)
            and 2 * told <= len(self.recordings)
            and any(each.is_markers or each.skeleton is not None for each in self.recordings)
        )

    @property
    def refused(self) -> Mapping[str, MPLearnError]:
        """Why, by name, for what could not be read, recognised or observed so far."""
        return self._refused

    @cached_property
    def _refused(self) -> dict[str, MPLearnError]:
        return {}

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
        chosen = {take.name for take in self.takes} | set(self.refused)
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
        from mplearn.evaluation import alike, lost_throughout, repeating

        if self.unlabelled or self.kind == "contents":
            return self.bodies
        if self.kind == "repetitions":
            whole = []
            for each in recordings:
                lost = lost_throughout(each)
                if lost:
                    self._refused[each.name] = RecordingError(f"{lost} is never seen")
                else:
                    whole.append(each)
            return alike(repeating(whole))
        labelled = tuple(each for each in recordings if each.labels)
        if self.kind == "primitives":
            return alike(labelled)
        for table in self.annotations:
            known = {each.name for each in labelled}
            labelled += self._labelled(table, [r for r in recordings if r.name not in known])
        return labelled

    def _labelled(
        self, table: Annotations, recordings: Sequence[Recording]
    ) -> tuple[Recording, ...]:
        """Return the recordings that a table names, with its labels."""
        found: list[Recording] = []
        for recording in recordings:
            if table.stretches.get(recording.name):
                try:
                    found.append(table.label(recording))
                except RecordingError as error:
                    self._refused[f"{recording.name} ({table.name})"] = error
        return tuple(found)

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


def _by_name(take: Recording) -> Recording:
    """Return a take labelled with the content that its name tells, where it tells one."""
    from mplearn.evaluation import content_of
    from mplearn.recording import LabelledSegment

    told = content_of(take.name)
    if told is None:
        return take
    return replace(take, labels=(LabelledSegment(0, len(take), told.content, take.person),))
