"""What the experiments share: data, seeds, orders, and what one learned that another needs."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from mplearn.errors import InvalidValueError

if TYPE_CHECKING:
    from mplearn.evaluation.experiments import Outcome
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
    def takes(self) -> tuple[Recording, ...]:
        """The takes of the data."""
        from mplearn.mocap import open_recordings

        return open_recordings(self.data)

    @cached_property
    def wrong_takes(self) -> tuple[Recording, ...]:
        """The takes that were performed wrongly; none where there is no folder of them."""
        from mplearn.mocap import open_recordings

        return () if self.wrong is None else open_recordings(self.wrong)

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
