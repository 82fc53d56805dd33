"""Persons: what is the same in every motion of one, and differs from one to the next."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from mplearn.body import PROPORTIONS
from mplearn.errors import InvalidValueError

from .channels import CHANNELS, UPPER_JOINTS, both_sides, mirrored
from .gymnastics import CHANGES
from .postures import POSTURES
from .primitives import GYMNASTICS, PRIMITIVES

# rest habits: standard deviation of the part that both sides share, and of the part that differs
_HABIT_RAD, _ONE_SIDED_RAD = 0.035, 0.02
# gymnastics are drawn apart: a person of some seed stays who they were before there were any
_COMMON = [name for name in PRIMITIVES if name not in GYMNASTICS]
_COMMON_POSTURES = [name for name in POSTURES if name not in CHANGES]


@dataclass(frozen=True)
class Person:
    """Who moves. ``Person()`` is the average one, ``Person.random(rng)`` draws one.

    Attributes:
        name: What the recording names as its person.
        height_m: Stature [m].
        proportions: Lengths relative to the average at that stature, as `mplearn.body.human_body`
            takes them.
        tempo: Primitive -> factor on its duration, in [0.5, 1.5]; 1 where none is given.
        reach: Key posture -> factor on how far the person goes into it, in [0.5, 1.5].
        joint_reach: Channel -> factor on how far it moves, in [0.5, 1.5]; where left and right
            differ, so does the person.
        rest: Channel -> habitual deviation from upright standing, at most 0.3 [rad or leg lengths].

    Raises:
        InvalidValueError: A name is unknown or a value out of range.

    Example:
        >>> Person(height_m=1.6, tempo={"SQD": 1.2}).name  # squats down more slowly
        'average'
    """

    name: str = "average"
    height_m: float = 1.75
    proportions: Mapping[str, float] = field(default_factory=dict)
    tempo: Mapping[str, float] = field(default_factory=dict)
    reach: Mapping[str, float] = field(default_factory=dict)
    joint_reach: Mapping[str, float] = field(default_factory=dict)
    rest: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        known = {
            "tempo": set(PRIMITIVES),
            "reach": set(POSTURES),
            "joint_reach": set(CHANNELS),
            "rest": set(CHANNELS),
        }
        for attribute, names in known.items():
            values: Mapping[str, float] = getattr(self, attribute)
            if unknown := sorted(set(values) - names):
                raise InvalidValueError(f"{attribute} names {unknown}; known are {sorted(names)}")
            low, high = (-0.3, 0.3) if attribute == "rest" else (0.5, 1.5)
            if bad := {n: v for n, v in values.items() if not low <= v <= high}:
                raise InvalidValueError(f"{attribute} must lie in [{low}, {high}], not {bad}")

    @classmethod
    def random(cls, rng: np.random.Generator, name: str = "") -> Person:
        """Draw a person: stature 1.55 to 1.90 m, proportions, tempo, habits, asymmetry.

        Args:
            rng: Source of randomness.
            name: Name; a number drawn from ``rng`` where empty.
        """
        height_m = float(rng.uniform(1.55, 1.90))
        lengths = rng.uniform(0.96, 1.04, len(PROPORTIONS))
        pace = np.exp(rng.normal(0.0, 0.07))
        tempo = pace * np.exp(rng.normal(0.0, 0.04, len(_COMMON)))
        reach = rng.uniform(0.9, 1.1, len(_COMMON_POSTURES))
        joint_reach = rng.uniform(0.93, 1.07, len(UPPER_JOINTS))
        stronger_left = rng.uniform(0.96, 1.04)
        rest = _rest_habit(rng)
        apart = np.random.default_rng(np.frombuffer(lengths.tobytes(), np.uint32))
        gymnastic_tempo = pace * np.exp(apart.normal(0.0, 0.04, len(GYMNASTICS)))
        gymnastic_reach = apart.uniform(0.9, 1.1, len(CHANGES))
        return cls(
            name=name or f"person-{int(rng.integers(1_000_000)):06d}",
            height_m=height_m,
            proportions=dict(zip(PROPORTIONS, lengths.tolist(), strict=True)),
            tempo=dict(zip(_COMMON, tempo.tolist(), strict=True))
            | dict(zip(GYMNASTICS, gymnastic_tempo.tolist(), strict=True)),
            reach=dict(zip(_COMMON_POSTURES, reach.tolist(), strict=True))
            | dict(zip(CHANGES, gymnastic_reach.tolist(), strict=True)),
            joint_reach={
                joint: float(factor * _side_factor(joint, stronger_left))
                for joint, factor in zip(UPPER_JOINTS, joint_reach, strict=True)
            },
            rest=rest,
        )


def _side_factor(joint: str, left: float) -> float:
    return {"_l": left, "_r": 2.0 - left}.get(joint[-2:], 1.0)


def _rest_habit(rng: np.random.Generator) -> dict[str, float]:
    shared = dict(zip(UPPER_JOINTS, rng.normal(0.0, _HABIT_RAD, len(UPPER_JOINTS)), strict=True))
    mirror = mirrored(shared)
    own = rng.normal(0.0, _ONE_SIDED_RAD, len(UPPER_JOINTS))
    rest = {
        joint: float(0.5 * (shared[joint] + mirror[joint]) + own[i])
        for i, joint in enumerate(UPPER_JOINTS)
    }
    stance = {
        "foot_y_l": float(rng.uniform(-0.012, 0.02)),
        "foot_yaw_l": float(rng.uniform(-0.05, 0.08)),
        "crouch": float(rng.uniform(0.0, 0.003)),
        "pelvis_x": float(rng.uniform(-0.01, 0.01)),
    }
    return {**rest, **both_sides(stance)}
