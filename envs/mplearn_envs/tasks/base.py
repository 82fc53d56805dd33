"""What a task is: what it shows, what it rewards, and when it is done."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any, ClassVar, NamedTuple, Protocol

import numpy as np
from gymnasium import spaces

from mplearn.recording import FloatArray, IntArray
from mplearn_envs.execution.sensors import Measured
from mplearn_envs.execution.tracking_report import TrackingReport
from mplearn_envs.mechanics.reference import Reference
from mplearn_envs.skills.action_choices import Choices
from mplearn_envs.skills.repertoire import Repertoire


class Choice(NamedTuple):
    """An action, as it was chosen.

    Attributes:
        primitive: Id of the primitive; None for hold.
        legal: Whether the mask allowed it.
        probability: How likely the transition prior makes it.
        history: Ids of the primitives performed before, the latest last, at most 100.

    Example:
        >>> choice = Choice(primitive=7, legal=True, probability=0.4, history=(3, 5))
        >>> choice.primitive in choice.history  # not performed in this episode yet
        False
    """

    primitive: int | None
    legal: bool
    probability: float
    history: tuple[int, ...]


class Ways(Protocol):
    """How a demonstrator goes on who is there while the robot acts.

    Example:
        >>> class Always:
        ...     def prior(self, before: int, time_s: float):
        ...         return np.eye(32)[3]  # slot 3, whatever was before
        >>> ways: Ways = Always()
        >>> int(ways.prior(7, 0.0).argmax())
        3
    """

    def prior(self, before: int, time_s: float) -> FloatArray:
        """Return how likely each slot comes next, shape (capacity,).

        Args:
            before: Slot of what was performed before.
            time_s: Time in the episode [s].
        """


class Scene(NamedTuple):
    """Where an episode is between two actions.

    Attributes:
        repertoire: What the robot can perform, in which slots, and what may follow what.
        measured: How the robot stands.
        reference: Where the reference robot is.
        current: Id of the primitive performed last; None at the start and after a dead end.
        history: Ids of the primitives performed in this episode, the latest last, at most 100.
        time_s: Time since the start of the episode [s].
        rng: The environment's source of randomness.
        options: What was given to the environment's ``reset``.
        choices: What may be done next.
        discount: Per second.
        hold_s: Duration of holding [s].
        ways: How the demonstrator goes on, where that is not what the repertoire says.

    Example:
        >>> import gymnasium as gym
        >>> import mplearn_envs
        >>> from mplearn_envs.tasks import FreeTask
        >>> class Noting(FreeTask):
        ...     def arrive(self, scene: Scene):
        ...         self.last = scene
        ...         return super().arrive(scene)
        >>> task = Noting()
        >>> env = gym.make("mplearn/PrimitiveHumanoid-v0", task=task, dynamics="kinematic")
        >>> observation, info = env.reset(seed=1)
        >>> result = env.step(int(info["action_mask"].nonzero()[0][1]))
        >>> task.last.history == (result[4]["primitive"],), task.last.time_s > 0
        (True, True)
    """

    repertoire: Repertoire
    measured: Measured
    reference: Reference
    current: int | None
    history: tuple[int, ...]
    time_s: float
    rng: np.random.Generator
    options: Mapping[str, Any]
    choices: Choices
    discount: float
    hold_s: float
    ways: Ways | None = None


class Task(ABC):
    """A reward; derive your own, and give an object of it to the environment.

    A macro step pays the bonuses at its start, the rates integrated over its duration T with the
    discount gamma per second, and what its end earns discounted by gamma^T:
    R = bonuses + integral over [0, T] of gamma^t rates(t) dt + gamma^T arrive.

    In an episode the environment calls `reset`; then for every action `bonuses`, `rates`, `fall`
    (after a fall only) and `arrive`; after each of these steps `observe`, `done` and `report`. An
    environment has its task to itself: objects are not shared.

    Attributes:
        fallen: Price of a fall.
        terms: Names of the terms that its rewards have: ``info["reward_terms"]`` has them from the
            reset on, with 0 where nothing was earned. Others are there only when they are earned.
        reset_options: Names of what it reads of `Scene.options`: others that are given to the
            environment's ``reset`` are refused. None takes whatever there is.

    Example:
        >>> import gymnasium as gym
        >>> import mplearn_envs
        >>> class Wander(Task):
        ...     terms = ("new",)
        ...
        ...     def bonuses(self, choice):
        ...         return {"new": float(choice.primitive not in choice.history)}
        ...
        ...     def rates(self, report):
        ...         return {}
        >>> env = gym.make("mplearn/PrimitiveHumanoid-v0", task=Wander(), dynamics="kinematic")
        >>> observation, info = env.reset(seed=1)
        >>> info["reward_terms"]
        {'new': 0.0, 'fall': 0.0, 'illegal': 0.0, 'novel': 0.0}
    """

    fallen: float = 10.0
    terms: ClassVar[tuple[str, ...]] = ()
    reset_options: ClassVar[tuple[str, ...] | None] = None

    def space(self, repertoire: Repertoire) -> spaces.Box | None:
        """Return the bounds of what `observe` returns; None if the task shows nothing.

        Args:
            repertoire: What the robot can perform; it may grow until the episode starts.
        """
        return None

    def reset(self, scene: Scene) -> None:
        """Start an episode."""
        return

    def observe(self) -> FloatArray:
        """Return what must be known to solve the task, an array within the bounds of `space`.

        It becomes the ``task`` of the observation.
        """
        return np.zeros(0)

    @abstractmethod
    def bonuses(self, choice: Choice) -> dict[str, float]:
        """Return what a choice earns at once, by term."""

    @abstractmethod
    def rates(self, report: TrackingReport) -> dict[str, FloatArray]:
        """Return what each moment earns per second, by term, shape (S,) each."""

    def fall(self) -> float:
        """Return what a fall earns: its price, ``fallen``, unless you derive another."""
        return -self.fallen

    def arrive(self, scene: Scene) -> dict[str, float]:
        """Return what the end of a macro step earns, by term."""
        return {}

    @property
    def done(self) -> bool:
        """Whether the episode ends here."""
        return False

    def report(self) -> dict[str, Any]:
        """Return what is known of the episode, for ``info["task"]``; not for the agent to see.

        It has the same keys and shapes in all of an episode, the start included: numbers, or arrays
        of a fixed length. What names slots as "slots" (int64, filled up with -1) is understood by
        the policies that search paths.

        ``"success"`` (bool), if there, is also ``info["is_success"]``.
        """
        return {}


def padded(slots: tuple[int, ...], length: int) -> IntArray:
    """Return slots as an array of a fixed length, filled up with -1."""
    out = np.full(length, -1, dtype=np.int64)
    out[: len(slots)] = slots
    return out
