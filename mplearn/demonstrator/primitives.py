"""The primitives that the demonstrator knows, as data.

The first 22 are the types of the paper's session [Kulic2012, section 4.2.2 and figure 10]: the 17
that its figure names, and the counterparts without which a person could not go on (the retracts of
the kicks, the left punch itself, the right punch and its retract). A march is ``MRL`` (the right
leg is raised), ``MLR`` (it comes down while the left is raised) and ``MMID`` (back to the middle).
A combination of punches ends with the right one, whose retract drops both arms.
The others are extras, and the gymnastics of `gymnastics`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from mplearn.errors import InvalidValueError

from .channels import CHANNELS, mirrored, mirrored_name
from .gymnastics import ways
from .postures import POSTURES

Window = tuple[float, float]


@dataclass(frozen=True)
class Primitive:
    """A motion from one key posture to another.

    Attributes:
        name: Short name, as in the paper.
        meaning: What a person would call it.
        start: Key posture it starts from, a name of `POSTURES`.
        end: Key posture it ends in.
        duration_s: Typical duration [s].
        windows: Channel -> (begin, end) as shares of the duration; (0, 1) where none is given.
        bumps: Channel -> height of a passing deflection, zero at both ends [rad or leg lengths].

    Example:
        >>> PRIMITIVES["BAR"].meaning, PRIMITIVES["BAR"].start, PRIMITIVES["BAR"].end
        ('both arms raise', 'stand', 'both arms up')
    """

    name: str
    meaning: str
    start: str
    end: str
    duration_s: float
    windows: Mapping[str, Window] = field(default_factory=dict)
    bumps: Mapping[str, float] = field(default_factory=dict)

    @property
    def active(self) -> tuple[str, ...]:
        """Channels that it moves: joints, pelvis, and feet it lifts (which may land elsewhere)."""
        start, end = POSTURES[self.start], POSTURES[self.end]
        return tuple(
            channel
            for channel in CHANNELS
            if start.get(channel, 0.0) != end.get(channel, 0.0)
            or channel in self.bumps
            or (channel.startswith(("foot_y", "foot_yaw")) and channel in self.windows)
        )


def _mirrored_windows(windows: Mapping[str, Window]) -> dict[str, Window]:
    return {mirrored_name(channel): window for channel, window in windows.items()}


def _reversed_windows(windows: Mapping[str, Window]) -> dict[str, Window]:
    return {channel: (1.0 - end, 1.0 - begin) for channel, (begin, end) in windows.items()}


# the shoulder leads, what hangs on it follows
_ARM_LAGS: dict[str, Window] = {
    f"{joint}_{side}": window
    for side in "lr"
    for joint, window in {
        "clavicle_elevation": (0.12, 0.95),
        "elbow": (0.05, 0.92),
        "wrist_pitch": (0.2, 1.0),
    }.items()
}
_RAISE_BUMPS = {"elbow_l": -0.42, "shoulder_roll_l": 0.06}
_GUARD_WINDOWS: dict[str, Window] = {f"elbow_{side}": (0.0, 0.85) for side in "lr"}
_PUNCH_WINDOWS: dict[str, Window] = {
    "pelvis_yaw": (0.0, 0.8),
    "lumbar_yaw": (0.02, 0.9),
    "neck_yaw": (0.02, 0.9),
    "elbow_l": (0.15, 1.0),
    "forearm_yaw_l": (0.3, 1.0),
}
_BOW_WINDOWS: dict[str, Window] = {
    "pelvis_pitch": (0.0, 0.92),
    "lumbar_pitch": (0.06, 1.0),
    "thorax_pitch": (0.1, 1.0),
    "neck_pitch": (0.05, 0.8),
}
_SQUAT_WINDOWS: dict[str, Window] = {f"shoulder_pitch_{side}": (0.0, 0.9) for side in "lr"}
# the weight goes first, then the foot leaves the floor, then it travels
_LIFT_WINDOWS: dict[str, Window] = {
    "pelvis_y": (0.0, 0.55),
    "pelvis_roll": (0.0, 0.6),
    "foot_z_l": (0.12, 0.86),
    "foot_x_l": (0.26, 1.0),
    "foot_y_l": (0.3, 1.0),
    "foot_yaw_l": (0.3, 1.0),
    "foot_pitch_l": (0.36, 1.0),
}
_MARCH_WINDOWS: dict[str, Window] = {
    "pelvis_y": (0.0, 0.6),
    "pelvis_roll": (0.0, 0.6),
    "foot_z_l": (0.12, 0.98),
    "foot_x_l": (0.28, 1.0),
    "foot_y_l": (0.3, 1.0),
    "foot_yaw_l": (0.3, 1.0),
    "foot_pitch_l": (0.4, 1.0),
}
_EXCHANGE_WINDOWS: dict[str, Window] = {
    "pelvis_y": (0.15, 0.8),
    "pelvis_roll": (0.2, 0.8),
    "foot_z_r": (0.0, 0.48),
    "foot_x_r": (0.0, 0.38),
    "foot_y_r": (0.0, 0.36),
    "foot_yaw_r": (0.0, 0.36),
    "foot_pitch_r": (0.0, 0.3),
    "foot_z_l": (0.5, 1.0),
    "foot_x_l": (0.58, 1.0),
    "foot_y_l": (0.6, 1.0),
    "foot_yaw_l": (0.6, 1.0),
    "foot_pitch_l": (0.66, 1.0),
}


def _pair(
    there: tuple[str, str],
    back: tuple[str, str],
    postures: tuple[str, str],
    durations_s: tuple[float, float],
    windows: Mapping[str, Window],
    bumps: Mapping[str, float] | None = None,
) -> tuple[Primitive, Primitive]:
    """Return a motion and its way back, which runs through the same windows in reverse."""
    low, high = postures
    bumps = bumps or {}
    return (
        Primitive(*there, low, high, durations_s[0], dict(windows), dict(bumps)),
        Primitive(*back, high, low, durations_s[1], _reversed_windows(windows), dict(bumps)),
    )


_PAPER = (
    *_pair(
        ("BAR", "both arms raise"), ("BAL", "both arms lower"), ("stand", "both arms up"),
        (1.45, 1.45), _ARM_LAGS, {**_RAISE_BUMPS, **mirrored(_RAISE_BUMPS)},
    ),
    *_pair(
        ("RAR", "right arm raise"), ("RAL", "right arm lower"), ("stand", "right arm up"),
        (1.37, 1.37), _ARM_LAGS, mirrored(_RAISE_BUMPS),
    ),
    *_pair(
        ("LAR", "left arm raise"), ("LAL", "left arm lower"), ("stand", "left arm up"),
        (1.37, 1.37), _ARM_LAGS, _RAISE_BUMPS,
    ),
    Primitive("AR", "arms ready", "stand", "guard", 1.20, _GUARD_WINDOWS),
    *_pair(
        ("BAD", "bow down"), ("BAU", "bow up"), ("stand", "bow"), (1.60, 1.60), _BOW_WINDOWS,
        {"pelvis_x": -0.02},
    ),
    *_pair(
        ("SQD", "squat down"), ("SQR", "squat raise"), ("stand", "squat"), (1.50, 1.45),
        _SQUAT_WINDOWS,
    ),
    *_pair(
        ("LKR", "left kick raise"), ("LKT", "left kick retract"), ("stand", "left kick"),
        (1.35, 1.35), _LIFT_WINDOWS,
    ),
    *_pair(
        ("RKR", "right kick raise"), ("RKT", "right kick retract"), ("stand", "right kick"),
        (1.35, 1.35), _mirrored_windows(_LIFT_WINDOWS),
    ),
    Primitive(
        "MRL", "march, right leg raise", "stand", "right march", 1.25,
        _mirrored_windows(_MARCH_WINDOWS),
    ),
    Primitive("MLR", "march, left leg raise", "right march", "left march", 1.50, _EXCHANGE_WINDOWS),
    Primitive(
        "MMID", "march, mid step", "left march", "stand", 1.25, _reversed_windows(_MARCH_WINDOWS)
    ),
    *_pair(
        ("LPE", "left punch"), ("LPR", "left punch retract"), ("guard", "left punch"),
        (1.04, 1.14), _PUNCH_WINDOWS,
    ),
    Primitive(
        "RPE", "right punch", "guard", "right punch", 1.04, _mirrored_windows(_PUNCH_WINDOWS)
    ),
    Primitive(
        "RPR", "right punch retract", "right punch", "stand", 1.35,
        _reversed_windows(_mirrored_windows(_PUNCH_WINDOWS)),
    ),
)  # fmt: skip

_EXTRAS = (
    Primitive("ARL", "arms ready lower", "guard", "stand", 1.15, _reversed_windows(_GUARD_WINDOWS)),
    *_pair(
        ("SAR", "side arms raise"), ("SAL", "side arms lower"), ("stand", "arms at the sides"),
        (1.20, 1.20), _ARM_LAGS,
    ),
    *_pair(
        ("TLO", "twist left"), ("TLR", "twist left return"), ("stand", "left twist"),
        (1.20, 1.20), {},
    ),
    *_pair(
        ("TRO", "twist right"), ("TRR", "twist right return"), ("stand", "right twist"),
        (1.20, 1.20), {},
    ),
    *_pair(
        ("RHR", "right hand raise"), ("RHL", "right hand lower"), ("stand", "right hand up"),
        (1.15, 1.15), _ARM_LAGS,
    ),
    *_pair(
        ("RWO", "right wave out"), ("RWI", "right wave in"), ("right hand up", "right hand out"),
        (0.70, 0.70), {},
    ),
)  # fmt: skip


def _gymnastic(start: str, end: str, lifted: bool) -> Primitive:
    """Return the way from one posture to another; a knee is raised or put down as in a march."""
    name = f"{start} to {end}"
    if not lifted:
        return Primitive(name, name, start, end, 1.20, _ARM_LAGS)
    knee = _MARCH_WINDOWS if "left" in start + end else _mirrored_windows(_MARCH_WINDOWS)
    return Primitive(
        name, name, start, end, 1.35, knee if "knee" in end else _reversed_windows(knee)
    )


_GYMNASTICS = tuple(_gymnastic(*way) for way in ways())

PAPER_PRIMITIVES: tuple[str, ...] = tuple(primitive.name for primitive in _PAPER)
GYMNASTICS: tuple[str, ...] = tuple(primitive.name for primitive in _GYMNASTICS)
PRIMITIVES: Mapping[str, Primitive] = {
    primitive.name: primitive for primitive in _PAPER + _EXTRAS + _GYMNASTICS
}


def primitive(name: str) -> Primitive:
    """Return the primitive of that name.

    Raises:
        InvalidValueError: There is none.
    """
    if name not in PRIMITIVES:
        raise InvalidValueError(f"no primitive {name!r}; known are {', '.join(PRIMITIVES)}")
    return PRIMITIVES[name]


def followers(name: str) -> tuple[str, ...]:
    """Return the primitives that can follow: those that start in the posture where it ends.

    Raises:
        InvalidValueError: There is no such primitive.

    Example:
        >>> followers("SQD")  # squat down
        ('SQR',)
    """
    posture = primitive(name).end
    return tuple(other.name for other in PRIMITIVES.values() if other.start == posture)
