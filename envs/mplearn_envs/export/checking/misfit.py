"""How far what a file says is off: against itself, against what was meant, against the possible."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from mplearn.maths.rotations import quaternion_to_matrix
from mplearn.recording import FloatArray, IntArray

from ..format import Reading
from ..robot_model import Bodies, RobotModel, angular_velocities
from ..sidecar import Meant

_FRAMES = 32
# what counts as one: from there on a misfit costs more with its logarithm
_POSITION_M, _ANGLE_RAD, _VELOCITY, _TIME = 1e-4, 1e-4, 0.05, 0.01
_FLOOR_M, _LIMIT_RAD = 0.04, 0.05
_MOVES = 0.02  # slower than this nothing is said about velocities [rad/s, m/s]
CONSISTENT = 0.1  # share by which velocities may differ from the differences of positions
_WINDOW = 200  # frames in which velocities are looked at: those where most moves
_UPRIGHT = 0.5  # least cosine between the base's axis and the vertical, in the median frame


@dataclass(frozen=True, eq=False)
class Misfit:
    """How far a reading is off.

    Attributes:
        position_m: Largest distance of a body from where forward kinematics puts it, or from where
            it was meant to be [m].
        body: Which body that is.
        frame: In which frame.
        angle_rad: Largest angle between how a body is turned and how it should be [rad].
        velocities: By which share velocities differ from the differences of positions, by name.
        time: By which share of a frame the file's times are off its rate, at most.
        beyond_rad: How far a joint goes beyond its limits, at most [rad].
        joint: Which joint that is.
        floor_m: Height of the lowest point of the feet in the median frame [m].
        tilt: Cosine between the base's axis and the vertical in the median frame.
        length: Largest difference of a quaternion's length from 1.
        speed: Largest velocity of a joint as a share of what the robot can do; NaN if not known.
        missing: How many frames fewer there are than were meant, at that rate.
        compared: What the positions were compared with.
    """

    position_m: float
    body: str
    frame: int
    angle_rad: float
    velocities: dict[str, float]
    time: float
    beyond_rad: float
    joint: str
    floor_m: float
    tilt: float
    length: float
    speed: float
    missing: int = 0
    compared: tuple[str, ...] = ()
    parts: dict[str, float] = field(default_factory=dict)

    @property
    def cost(self) -> float:
        """How wrong all of it is, on a logarithmic scale; 0 where nothing is."""
        return float(sum(self.parts.values()))


def missing_of(reading: Reading, meant: Meant) -> int:
    """Return how many frames fewer there are than were meant; 0 where the rate is another."""
    alike = abs(meant.rate_hz / reading.rate_hz - 1.0) < 1e-3
    return meant.n_frames - len(reading) if alike else 0


def postures(reading: Reading, model: RobotModel, frames: IntArray | slice) -> FloatArray:
    """Return angles of the hinges in some frames: the file's, or those of its bodies [rad]."""
    if reading.joint_pos is not None:
        return reading.joint_pos[frames]
    assert reading.body_quat is not None
    return model.angles_of(reading.body_quat[frames])[0]


def by_itself(reading: Reading, misfit: Misfit, model: RobotModel) -> Reading:
    """Return a reading without what follows from the rest of it, by forward kinematics.

    Where bodies and velocities are what base and hinges say, they were computed from these: what is
    wrong is wrong with both.
    """
    if any(misfit.parts.get(part, 0.0) > 1.0 for part in ("own places", "own turns")):
        return reading
    off = [name for name, share in misfit.velocities.items() if share > CONSISTENT]
    if "joint velocities" in off or (off and not _follow(reading, model)):
        return reading
    return replace(
        reading,
        joint_pos=postures(reading, model, slice(None)),
        body_pos=None,
        body_quat=None,
        joint_vel=None,
        body_lin_vel=None,
        body_ang_vel=None,
        local=False,
    )


def some(n_frames: int, most: int = _FRAMES) -> IntArray:
    """Return some frames, spread evenly."""
    return np.unique(np.linspace(0, n_frames - 1, most).round().astype(np.int64))


def _follow(reading: Reading, model: RobotModel) -> bool:
    """Whether velocities are those of forward kinematics, if not differences of places.

    They differ where angles are so wrong that bodies whirl.
    """
    joints = reading.joint_pos
    if joints is None or reading.body_lin_vel is None or reading.body_ang_vel is None:
        return False
    window = _liveliest(joints)
    posture = (reading.root_pos[window], reading.root_quat[window], joints[window])
    found = model.velocities(*posture, reading.rate_hz)
    for said, expected in (
        (reading.body_lin_vel[window], found.linear),
        (reading.body_ang_vel[window], found.angular),
    ):
        gap = np.sqrt(((said - expected)[1:-1] ** 2).mean())
        if gap > CONSISTENT * max(float(np.sqrt((expected[1:-1] ** 2).mean())), _MOVES):
            return False
    return True


def measure(reading: Reading, model: RobotModel, meant: Meant | None) -> Misfit:
    """Return how far a reading is off."""
    frames = some(len(reading))
    joints = postures(reading, model, frames)
    there = model.forward(reading.root_pos[frames], reading.root_quat[frames], joints)
    parts: dict[str, float] = {}
    worst, compared = _Worst(), []
    if reading.body_pos is not None:
        compared.append("its own bodies")
        expected = _own(reading, model, there, joints, frames)
        worst.take(parts, "own", expected, reading, frames, model)
    if meant is not None:
        compared.append("what was meant")
        found, at = _then(reading, model, meant)
        worst.meant(parts, found, meant, at, model)
    missing = 0 if meant is None else missing_of(reading, meant)
    parts["frames"] = float(np.log1p(abs(missing)))
    velocities = _velocities(reading)
    for name, share in velocities.items():
        parts[name] = float(np.log1p(share / _VELOCITY))
    time = _time(reading)
    parts["time"] = float(np.log1p(time / _TIME))
    limits = model.limits
    beyond = np.maximum(limits[:, 0] - joints, joints - limits[:, 1]).max(axis=0)
    hinge = int(np.argmax(beyond)) if len(beyond) else 0
    over = max(float(beyond.max()), 0.0) if len(beyond) else 0.0
    parts["limits"] = float(np.log1p(max(over - _LIMIT_RAD, 0.0) / _LIMIT_RAD))
    floor = float(np.median(model.lowest(there)))
    parts["floor"] = float(np.log1p(max(abs(floor) - _FLOOR_M, 0.0) / _FLOOR_M))
    tilt = float(np.median(quaternion_to_matrix(reading.root_quat[frames])[:, 2, 2]))
    parts["tilt"] = 0.0 if tilt > _UPRIGHT else 1.0 + _UPRIGHT - tilt
    length = float(np.abs(np.linalg.norm(reading.root_quat, axis=-1) - 1.0).max())
    return Misfit(
        worst.position_m,
        worst.body,
        worst.frame,
        worst.angle_rad,
        velocities,
        time,
        over,
        model.joint_names[hinge] if model.joint_names else "",
        floor,
        tilt,
        length,
        _speed(reading, model),
        missing,
        tuple(compared),
        parts,
    )


class _Worst:
    """The largest errors so far."""

    def __init__(self) -> None:
        self.position_m, self.body, self.frame, self.angle_rad = 0.0, "", 0, 0.0

    def take(
        self,
        parts: dict[str, float],
        what: str,
        expected: Bodies,
        reading: Reading,
        frames: IntArray,
        model: RobotModel,
    ) -> None:
        assert reading.body_pos is not None
        self._position(parts, what, expected.pos - reading.body_pos[frames], frames, model)
        if reading.body_quat is not None:
            self._angle(parts, what, expected.quat, reading.body_quat[frames])

    def meant(
        self, parts: dict[str, float], found: Bodies, meant: Meant, at: IntArray, model: RobotModel
    ) -> None:
        self._position(parts, "meant", found.pos - meant.pos, at, model)
        self._angle(parts, "meant", found.quat, meant.quat)

    def _position(
        self,
        parts: dict[str, float],
        what: str,
        gap: FloatArray,
        frames: IntArray,
        model: RobotModel,
    ) -> None:
        off = np.linalg.norm(gap, axis=-1)
        parts[f"{what} places"] = float(np.log1p(np.sqrt((off**2).mean()) / _POSITION_M))
        t, b = np.unravel_index(int(np.argmax(off)), off.shape)
        if off[t, b] >= self.position_m:
            self.position_m, self.body = float(off[t, b]), model.body_names[int(b)]
            self.frame = int(frames[t])

    def _angle(
        self, parts: dict[str, float], what: str, one: FloatArray, other: FloatArray
    ) -> None:
        off = angles_between(one, other)
        parts[f"{what} turns"] = float(np.log1p(np.sqrt((off**2).mean()) / _ANGLE_RAD))
        self.angle_rad = max(self.angle_rad, float(off.max()))


def angles_between(one: FloatArray, other: FloatArray) -> FloatArray:
    """Return angles between rotations, quaternions (..., 4) of any length, shape (...) [rad]."""
    a = one / np.linalg.norm(one, axis=-1, keepdims=True)
    b = other / np.linalg.norm(other, axis=-1, keepdims=True)
    apart = np.minimum(np.linalg.norm(a - b, axis=-1), np.linalg.norm(a + b, axis=-1))
    return np.asarray(4.0 * np.arcsin(np.clip(apart / 2.0, 0.0, 1.0)))


def _own(
    reading: Reading, model: RobotModel, there: Bodies, joints: FloatArray, frames: IntArray
) -> Bodies:
    """Return where the file's bodies should be, as the file sees them."""
    if not reading.local:
        return there
    still = np.tile([1.0, 0.0, 0.0, 0.0], (len(frames), 1))
    return model.forward(np.zeros((len(frames), 3)), still, joints)


def _then(reading: Reading, model: RobotModel, meant: Meant) -> tuple[Bodies, IntArray]:
    """Return where the robot is at the moments of what was meant, as a reader plays the file."""
    at = np.clip(meant.times_s * reading.rate_hz, 0.0, len(reading) - 1.0)
    low = np.floor(at + 1e-6).astype(np.int64)
    high = np.minimum(low + 1, len(reading) - 1)
    share = np.clip(at - low, 0.0, 1.0)[:, None]
    quat = reading.root_quat[high] * np.where(
        (reading.root_quat[low] * reading.root_quat[high]).sum(axis=1, keepdims=True) < 0, -1.0, 1.0
    )
    root_quat = (1 - share) * reading.root_quat[low] + share * quat
    root_pos = (1 - share) * reading.root_pos[low] + share * reading.root_pos[high]
    angles = postures(reading, model, low)
    if reading.joint_pos is not None:
        angles = (1 - share) * angles + share * reading.joint_pos[high]
    return model.forward(root_pos, root_quat, angles), low


def _velocities(reading: Reading) -> dict[str, float]:
    """Return by which shares velocities differ from differences of what the file says."""
    rate_hz = reading.rate_hz
    joints, pos, quat = reading.joint_pos, reading.body_pos, reading.body_quat
    window = _liveliest(reading.root_pos if joints is None else joints)
    pairs: dict[str, tuple[FloatArray, FloatArray]] = {}
    if reading.joint_vel is not None and joints is not None:
        moved = np.gradient(joints[window], 1.0 / rate_hz, axis=0)
        pairs["joint velocities"] = (reading.joint_vel[window], moved)
    if reading.body_lin_vel is not None and pos is not None:
        moved = np.gradient(pos[window], 1.0 / rate_hz, axis=0)
        pairs["bodies' linear velocities"] = (reading.body_lin_vel[window], moved)
    if reading.body_ang_vel is not None and quat is not None:
        turned = angular_velocities(quat[window], rate_hz)
        pairs["bodies' angular velocities"] = (reading.body_ang_vel[window], turned)
    out = {}
    for name, (said, found) in pairs.items():
        inner = slice(1, -1) if len(said) > 2 else slice(None)
        size = max(float(np.sqrt((found[inner] ** 2).mean())), _MOVES)
        out[name] = float(np.sqrt(((said[inner] - found[inner]) ** 2).mean())) / size
    return out


def _liveliest(values: FloatArray) -> slice:
    """Return the frames, at most so many, in which most moves."""
    if len(values) <= _WINDOW:
        return slice(None)
    moved = np.concatenate(([0.0], np.cumsum(np.abs(np.diff(values, axis=0)).sum(axis=1))))
    start = int(np.argmax(moved[_WINDOW:] - moved[:-_WINDOW]))
    return slice(start, start + _WINDOW)


def _time(reading: Reading) -> float:
    """Return by which share of a frame the file's times are off its rate, at most."""
    if reading.times_s is None:
        return 0.0
    even = reading.times_s[0] + np.arange(len(reading)) / reading.rate_hz
    return float(np.abs(reading.times_s - even).max() * reading.rate_hz)


def _speed(reading: Reading, model: RobotModel) -> float:
    limits, joints = model.velocity_limits, reading.joint_pos
    if limits is None or joints is None or not len(limits):
        return float("nan")
    return float((np.abs(np.diff(joints, axis=0)).max(axis=0) * reading.rate_hz / limits).max())
