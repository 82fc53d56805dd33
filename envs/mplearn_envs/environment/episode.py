"""Where an episode is: what was performed, how the robot stands, and what may be done next."""

from __future__ import annotations

from typing import NamedTuple

from mplearn.library import PrimitiveLibrary
from mplearn_envs.execution.performer import Performer, PerformerState
from mplearn_envs.execution.sensors import Measured
from mplearn_envs.skills.action_choices import Choices
from mplearn_envs.skills.repertoire import Repertoire
from mplearn_envs.tasks import Task

from .random_streams import RandomStreams

_HISTORY = 100  # primitives that tasks may look back


class Episode(NamedTuple):
    """An episode between two macro steps.

    Attributes:
        measured: How the robot stands.
        choices: What may be done next.
        current: Id of the primitive performed last; None at the start and after a dead end.
        history: Ids of the primitives performed, the latest last, at most 100.
        time_s: Time since the start [s].
        running: Whether it goes on.
    """

    measured: Measured
    choices: Choices
    current: int | None = None
    history: tuple[int, ...] = ()
    time_s: float = 0.0
    running: bool = True

    def after(
        self,
        chosen: int | None,
        measured: Measured,
        duration_s: float,
        repertoire: Repertoire,
        performer: Performer,
    ) -> Episode:
        """Return the episode after a macro step.

        Args:
            chosen: Id of the primitive performed; None is hold.
            measured: How the robot stands now.
            duration_s: How long the macro step took [s].
            repertoire: What the robot can perform by now.
            performer: Who is now where that led.
        """
        current, history = self.current, self.history
        if chosen is not None:
            current, history = chosen, (*history[1 - _HISTORY :], chosen)
        gone = current is not None and current not in repertoire.slots
        if gone or (chosen is None and self.choices.dead_end):
            current = None
        here = performer.reference
        choices = repertoire.entries(here) if current is None else repertoire.after(current)
        if not performer.leads_home:
            choices = repertoire.from_place(choices, here)
        return Episode(measured, choices, current, history, self.time_s + duration_s)


class Seen(NamedTuple):
    """What the robot has seen of its demonstrator.

    Attributes:
        library: The primitives, with the transitions that were seen.
        ids: Ids of the primitives that were seen.
        n_motions: How many motions, since the episode began.
    """

    library: PrimitiveLibrary
    ids: frozenset[int]
    n_motions: int = 0


class EpisodeState(NamedTuple):
    """All that the future of an episode depends on."""

    performer: PerformerState
    episode: Episode
    task: Task
    streams: RandomStreams
    person: int = -1  # whose graph counts, where there are several
    seen: Seen | None = None  # what the robot has seen, where that grows
