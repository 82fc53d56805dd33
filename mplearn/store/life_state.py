"""What is remembered of a life of learning."""

from __future__ import annotations

from dataclasses import dataclass

from ..learner import LearnerState
from ..state import Count, SharedState, State, require
from .journal import JournalState
from .labels import LabelsState


@dataclass(frozen=True, eq=False)
class SourcesState(SharedState):
    """Keys of the recordings that were learned to their end."""

    done: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class LifeState(State):
    """All that a lifelong learner knows.

    Attributes:
        learner: What was learned.
        labels: What people said of it.
        journal: What happened.
        sources: Recordings that were learned to their end.
        source: Key of the one that is being learned; empty for none.
        taken: Frames of it that were learned.
        chunk_frame: Frames seen before those that are written together next.
        chunk_when: Clock time of the first of them [s since 1970].
        revision: How often something changed.
    """

    learner: LearnerState
    labels: LabelsState
    journal: JournalState
    sources: SourcesState
    source: str
    taken: Count
    chunk_frame: Count
    chunk_when: float
    revision: Count

    def check(self) -> None:
        """Check that what people said is about what there was."""
        free_id, next_number = self.learner.tree.free_id, self.journal.next_number
        for k, (id, _) in enumerate(self.labels.names):
            require(id < free_id, f"labels.names[{k}]", f"must be about an id below {free_id}")
        for k, (number, note) in enumerate(self.labels.notes):
            place = f"labels.notes[{k}]"
            require(number < next_number, place, f"must be of a command before {next_number}")
            about = note.primitive is None or note.primitive < free_id
            require(about, place, f"must be about an id below {free_id}")
