"""How a person executes a primitive this time: a `Movement` drawn around the primitive's data."""

from __future__ import annotations

import numpy as np

from mplearn.recording import FloatArray, IntArray

from .channels import CHANNELS, INDEX, UPPER_JOINTS, as_vector
from .movement import Movement
from .person import Person
from .postures import POSTURES, STAND
from .primitives import Primitive
from .stance import Stance
from .variability import Variability

_N_UPPER = len(UPPER_JOINTS)
# balance decides these, not how large a person moves
_UNSCALED = np.array([name in ("pelvis_y", "pelvis_roll") for name in CHANNELS])
_PLACED = np.array([name.startswith(("foot_x", "foot_y_")) for name in CHANNELS])
_TURNED = np.array([name.startswith("foot_yaw") for name in CHANNELS])
_ARM_SIDE = np.array(
    [
        {"_l": 0.5, "_r": -0.5}.get(name[-2:], 0.0) * (i < _N_UPPER)
        for i, name in enumerate(CHANNELS)
    ]
)
_MARGIN_RAD = 0.1  # kept to the joint limits, for sway and drift
_LEAD_S = 1.0  # the person stands still before the first motion
# an arm that is raised forward ends before the vertical; the legs stay within their joints' limits
_RANGES = {
    "shoulder_pitch_l": (-3.0, np.inf),
    "shoulder_pitch_r": (-3.0, np.inf),
    "crouch": (0.001, 0.34),
    "pelvis_pitch": (-0.4, 0.85),
    "foot_x_l": (-0.2, 0.9),
    "foot_x_r": (-0.2, 0.9),
    "foot_z_l": (0.0, 0.55),
    "foot_z_r": (0.0, 0.55),
    "foot_pitch_l": (-0.95, 0.4),
    "foot_pitch_r": (-0.95, 0.4),
}
_LARGEST_OVERLAP = (
    0.22  # of the shorter of two motions: a foot has landed before the next is lifted
)


class Planner:
    """Draws movements one after another.

    Args:
        person: Who moves.
        variability: Sizes of the variation.
        stance: Knows the person's body.
        rng: Source of randomness.

    Attributes:
        planned: Where the channels are once all movements drawn so far have ended, shape (C,).
    """

    def __init__(
        self,
        person: Person,
        variability: Variability,
        stance: Stance,
        rng: np.random.Generator,
    ) -> None:
        self._person, self._variability, self._rng = person, variability, rng
        self._stand = as_vector(STAND)
        self._rest = self._stand + as_vector(person.rest)
        self._joint_reach = np.array([person.joint_reach.get(name, 1.0) for name in CHANNELS])
        self._scatter = np.where(_PLACED, variability.placement_m / stance.leg_m, 0.0)
        self._scatter[:_N_UPPER] = variability.scatter_rad
        self._scatter[_TURNED] = variability.scatter_rad
        low, high = np.full(len(CHANNELS), -np.inf), np.full(len(CHANNELS), np.inf)
        low[:_N_UPPER] = stance.upper_limits[:, 0] + _MARGIN_RAD
        high[:_N_UPPER] = stance.upper_limits[:, 1] - _MARGIN_RAD
        for name, (least, most) in _RANGES.items():
            low[INDEX[name]] = max(low[INDEX[name]], least)
            high[INDEX[name]] = min(high[INDEX[name]], most)
        self._low, self._high = low, high
        self.planned = np.clip(self._rest, low, high)

    def _start_s(self, previous: Movement, duration_s: float) -> float:
        """Draw when a movement of that duration starts after the previous one [s]."""
        v = self._variability
        kind, where = self._rng.random(2)

        def within(bounds: tuple[float, float]) -> float:
            return float(bounds[0] + where * (bounds[1] - bounds[0]))

        if kind < v.fluid:
            shorter = min(duration_s, previous.end_s - previous.start_s)
            return previous.end_s - min(within(v.overlap_s), _LARGEST_OVERLAP * shorter)
        return previous.end_s + within(v.pause_s if kind >= 1.0 - v.pause else v.dwell_s)

    def plan(self, primitive: Primitive, previous: Movement | None) -> Movement:
        """Draw the next movement, which follows the previous one, if there is one."""
        v, rng, person = self._variability, self._rng, self._person
        duration_s = primitive.duration_s * person.tempo.get(primitive.name, 1.0)
        duration_s *= 1.0 + v.duration * rng.uniform(-1.0, 1.0)
        start_s = _LEAD_S if previous is None else self._start_s(previous, duration_s)
        amplitude = 1.0 + v.amplitude * rng.uniform(-1.0, 1.0)
        target = self._target(primitive, amplitude)
        channels = np.array([INDEX[name] for name in primitive.active])
        begin_s, end_s = self._times(primitive, channels, start_s, start_s + duration_s)
        step = target[channels] - self.planned[channels]
        self.planned[channels] = target[channels]
        return Movement(
            name=primitive.name,
            start_s=start_s,
            end_s=start_s + duration_s,
            channels=channels,
            begin_s=begin_s,
            duration_s=end_s - begin_s,
            step=step,
            bump=amplitude * as_vector(primitive.bumps)[channels],
        )

    def _target(self, primitive: Primitive, amplitude: float) -> FloatArray:
        """Draw the posture in which the primitive ends this time, shape (C,)."""
        v, rng, person = self._variability, self._rng, self._person
        change = as_vector(POSTURES[primitive.end]) - self._stand
        factor = self._joint_reach * (amplitude * person.reach.get(primitive.end, 1.0))
        factor[:_N_UPPER] *= 1.0 + v.joint_amplitude * rng.uniform(-1.0, 1.0, _N_UPPER)
        factor[_UNSCALED] = 1.0
        scatter = self._scatter * rng.standard_normal(len(CHANNELS))
        return np.clip(self._rest + change * factor + scatter, self._low, self._high)

    def _times(
        self, primitive: Primitive, channels: IntArray, start_s: float, end_s: float
    ) -> tuple[FloatArray, FloatArray]:
        """Draw when each channel begins and ends, both shape (K,) [s], within the movement.

        The joints of the upper body vary, those of an arm together and each on its own; pelvis and
        feet keep to the primitive's windows, on which balance rests.
        """
        v, rng = self._variability, self._rng
        shift = np.zeros((2, len(CHANNELS)))
        shift[:, :_N_UPPER] = rng.normal(0.0, v.timing_s, (2, _N_UPPER))
        shift += _ARM_SIDE * rng.normal(0.0, v.side_lag_s)
        windows = np.array([primitive.windows.get(CHANNELS[i], (0.0, 1.0)) for i in channels])
        times = start_s + windows.T * (end_s - start_s) + shift[:, channels]
        begin, end = np.clip(times, start_s, end_s)
        return begin, end
