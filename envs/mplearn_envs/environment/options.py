"""An environment's options, in groups: each may be given as an object, or as a mapping of names."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from numbers import Real
from typing import Any, Literal, Self, TypeAlias, get_args

import numpy as np

from mplearn.errors import InvalidValueError
from mplearn.generation import STYLES, StyleName
from mplearn_envs.skills.feasibility import FeasibilityConfig

Illegal: TypeAlias = Literal["hold", "raise"]


@dataclass(frozen=True)
class Options:
    """A group of options.

    Example:
        >>> PictureOptions.of({"width": 320}, "pictures").width
        320
        >>> PictureOptions.of({"wide": 320}, "pictures")
        Traceback (most recent call last):
        mplearn.errors.InvalidValueError: ...
    """

    @classmethod
    def of(cls, given: Self | Mapping[str, Any] | None, name: str) -> Self:
        """Return a group from how it was given: itself, its options by name, or None.

        Args:
            given: The group.
            name: What the environment calls it.

        Raises:
            InvalidValueError: It is none of these, names an option that is not known, or a value
                is not allowed.
        """
        if isinstance(given, cls):
            return given
        if given is None:
            return cls()
        known = [each.name for each in fields(cls)]
        if not isinstance(given, Mapping):
            raise InvalidValueError(
                f"{name} must be {cls.__name__} or a mapping of {known}, not {given!r:.80}"
            )
        unknown = [key for key in given if key not in known]
        if unknown:
            raise InvalidValueError(f"{name} has the options {known}, not {unknown}")
        return cls(**given)


@dataclass(frozen=True)
class MotionOptions(Options):
    """How primitives are performed.

    Attributes:
        speed: Speed of performance as a share of the human's. The paper's robot moved at 0.5.
        style: How motions are generated from primitives, see `mplearn.generation`.
        feasibility: What the robot is allowed.
        upper_body: Whether only arms, head and the trunk's turn are performed, by a robot that
            stands: for motions whose legs it cannot follow.

    Example:
        >>> MotionOptions(speed=0.8, feasibility={"slowest": 0.2}).feasibility.slowest
        0.2
    """

    speed: float = 0.5
    style: StyleName = "deterministic"
    feasibility: FeasibilityConfig = field(default_factory=FeasibilityConfig)
    upper_body: bool = False

    def __post_init__(self) -> None:
        require_one_of("upper_body", self.upper_body, (False, True))
        require_number("speed", self.speed, 1e-6, 1e6, "positive and finite")
        require_one_of("style", self.style, tuple(STYLES))
        given: object = self.feasibility
        if isinstance(given, Mapping):
            known = [each.name for each in fields(FeasibilityConfig)]
            if not set(given) <= set(known):
                raise InvalidValueError(f"feasibility has the options {known}, not {list(given)}")
            object.__setattr__(self, "feasibility", FeasibilityConfig(**given))
        elif not isinstance(given, FeasibilityConfig):
            raise InvalidValueError(f"feasibility must be a FeasibilityConfig, not {given!r:.80}")


@dataclass(frozen=True)
class ActionOptions(Options):
    """What actions there are, and what they cost.

    Attributes:
        capacity: Number of actions; None is the next power of two that fits, at least 32.
        hold_s: Duration of holding [s].
        illegal: What an illegal action does: "hold" or "raise".
        illegal_penalty: Price of an illegal action.
        novel_penalty: Price of a transition that was never observed; None makes it illegal.
        speeds: Among which speeds the agent chooses, as shares of `MotionOptions.speed`: for S
            speeds there are S blocks of ``capacity`` actions each. The first is the one of which
            the transition prior speaks. A plan is slower where balance or the joints ask for it.

    Example:
        >>> ActionOptions(illegal="raise", speeds=(1.0, 0.7)).hold_s
        0.5
    """

    capacity: int | None = None
    hold_s: float = 0.5
    illegal: Illegal = "hold"
    illegal_penalty: float = 1.0
    novel_penalty: float | None = None
    speeds: tuple[float, ...] = (1.0,)

    def __post_init__(self) -> None:
        object.__setattr__(self, "speeds", tuple(self.speeds))
        if not self.speeds or len(set(self.speeds)) != len(self.speeds):
            raise InvalidValueError(f"speeds must be one or more, all different, not {self.speeds}")
        for speed in self.speeds:
            require_number("each of speeds", speed, 0.1, 10.0, "in [0.1, 10]")
        require_number("hold_s", self.hold_s, 0.05, 60.0, "in [0.05, 60] s")
        require_one_of("illegal", self.illegal, get_args(Illegal))
        require_number("illegal_penalty", self.illegal_penalty, -1e9, 1e9, "finite")
        if self.novel_penalty is not None:
            require_number("novel_penalty", self.novel_penalty, -1e9, 1e9, "finite, or None")


@dataclass(frozen=True)
class PictureOptions(Options):
    """How pictures are drawn.

    Attributes:
        width: Width [pixels].
        height: Height [pixels].
        draw_balance: Whether support polygon, COG and ZMP are drawn on the floor.
        frame_rate_hz: How often ``frame_callback`` is called [1/s of simulated time].

    Example:
        >>> import gymnasium as gym
        >>> import mplearn_envs
        >>> pictures = PictureOptions(width=320, height=240, draw_balance=True)
        >>> env = gym.make("mplearn/PrimitiveHumanoid-v0", pictures=pictures, dynamics="kinematic")
        >>> env.unwrapped.pictures.width
        320
    """

    width: int = 640
    height: int = 480
    draw_balance: bool = False
    frame_rate_hz: float = 25.0

    def __post_init__(self) -> None:
        for name in ("width", "height"):
            require_number(name, getattr(self, name), 1, 16384, "an integer from 1", whole=True)
        require_one_of("draw_balance", self.draw_balance, (False, True))
        require_number("frame_rate_hz", self.frame_rate_hz, 1e-3, 250.0, "in (0, 250] 1/s")


def require_one_of(name: str, value: object, allowed: tuple[object, ...]) -> None:
    """Check a word.

    Raises:
        InvalidValueError: It is not among those that are allowed.

    Example:
        >>> require_one_of("style", "wild", ("smooth", "nearest"))
        Traceback (most recent call last):
        mplearn.errors.InvalidValueError: ...
    """
    if not isinstance(value, (str, bool, type(None))) or value not in allowed:
        raise InvalidValueError(f"{name} must be one of {allowed}, not {value!r}")


def require_number(
    name: str, value: object, low: float, high: float, meaning: str, *, whole: bool = False
) -> None:
    """Check a number.

    Raises:
        InvalidValueError: It is none in [low, high]; ``meaning`` is what the message says of that.

    Example:
        >>> require_number("capacity", 0, 2, 4096, "2 to 4096 slots", whole=True)
        Traceback (most recent call last):
        mplearn.errors.InvalidValueError: ...
    """
    number = isinstance(value, (Real, np.number)) and not isinstance(value, (bool, np.bool_))
    fits = not whole or isinstance(value, (int, np.integer))
    if not (number and fits and low <= float(value) <= high):  # type: ignore[arg-type]
        raise InvalidValueError(f"{name} must be {meaning}, not {value!r}")
