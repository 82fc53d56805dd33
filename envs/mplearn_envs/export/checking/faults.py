"""What may be wrong with a file: each fault is a way to read it otherwise.

A fault is what, taken back, makes the file fit. So each one here takes a reading and returns it as
it would be if the fault were there, or nothing where that makes no sense.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from mplearn.errors import RobotError
from mplearn.maths.rotations import matrix_to_quaternion, quaternion_to_matrix
from mplearn.recording import FloatArray, IntArray

from ..format import Reading
from ..robot_model import RobotModel
from ..sidecar import Meant
from .misfit import angles_between, missing_of, postures, some

_LENGTHS = {
    0.01: "in centimetres, not metres",
    0.001: "in millimetres, not metres",
    0.0254: "in inches, not metres",
    0.3048: "in feet, not metres",
    100.0: "100 times too small, as metres taken for centimetres are",
}
_RATES = (5.0, 1000.0)  # that motions are played at
_FARTHEST_M = 3.0  # that places are off
_OTHERWISE = 0.5  # of how far a hinge's angles are off, if they are to be read otherwise
_ZERO_RAD = 1e-3  # that the zero of a hinge is off, at least
_TURNED_RAD = 0.02  # that all is turned by, at least
_FEW = 12


class Fault(NamedTuple):
    """One way to read a file otherwise.

    Attributes:
        kind: What kind of fault it is: "quaternion order", "degrees", "unit", "bodies permuted",
            "joints permuted", "mirrored", "zero", "rate", "frames", "place", "axes", "velocities".
        problem: What is wrong with the file then, in a few words.
        reading: What the file says, with that taken back.
        meant: What was meant by that, where it is less than all.
    """

    kind: str
    problem: str
    reading: Reading
    meant: Meant | None = None


class Evidence(NamedTuple):
    """What a file is held against.

    Attributes:
        model: The robot.
        meant: What was meant by the motion; None where nothing says so.
    """

    model: RobotModel
    meant: Meant | None


def faults(reading: Reading, evidence: Evidence) -> Iterator[Fault]:
    """Yield all the ways in which a reading may be wrong by one fault."""
    for find in _FINDERS:
        yield from find(reading, evidence)


def _quaternion_order(reading: Reading, evidence: Evidence) -> Iterator[Fault]:
    for roll, problem in (
        (-1, "quaternions stand as w, x, y, z where readers take x, y, z, w"),
        (1, "quaternions stand as x, y, z, w where readers take w, x, y, z"),
    ):
        rolled = _quats(reading, partial(np.roll, shift=roll, axis=-1))
        yield Fault("quaternion order", problem, rolled)
    inverse = np.array([1.0, -1.0, -1.0, -1.0])
    yield Fault(
        "quaternion order", "quaternions are inverse", _quats(reading, lambda q: q * inverse)
    )


def _degrees(reading: Reading, evidence: Evidence) -> Iterator[Fault]:
    if reading.joint_pos is None:
        return
    alone = evidence.meant is None and reading.body_pos is None
    if alone and np.abs(reading.joint_pos).max(initial=0.0) < 2 * np.pi:
        return  # smaller angles are always within a robot's limits
    angles = replace(reading, joint_pos=np.radians(reading.joint_pos))
    if reading.joint_vel is not None:
        both = replace(angles, joint_vel=np.radians(reading.joint_vel))
        yield Fault("degrees", "joint angles and velocities are in degrees, not radians", both)
    yield Fault("degrees", "joint angles are in degrees, not radians", angles)
    yield Fault(
        "degrees",
        "joint angles are too small: radians were taken for degrees",
        replace(reading, joint_pos=np.degrees(reading.joint_pos)),
    )


def _unit(reading: Reading, evidence: Evidence) -> Iterator[Fault]:
    for factor, unit in _LENGTHS.items():
        for what, base, bodies in (
            ("places", True, True),
            ("the base's places", True, False),
            ("the bodies' places", False, True),
        ):
            if reading.body_pos is None and bodies != base:
                continue
            problem = f"{what} are {unit}"
            scaled = _scaled(reading, factor, base=base, bodies=bodies)
            yield Fault("unit", problem, scaled)
            if reading.body_lin_vel is not None and bodies:
                kept = replace(scaled, body_lin_vel=reading.body_lin_vel)
                yield Fault("unit", f"{problem}; velocities are in metres per second", kept)


def _bodies(reading: Reading, evidence: Evidence) -> Iterator[Fault]:
    if reading.body_pos is None:
        return
    model = evidence.model
    order = np.argsort(breadth_first(model))
    yield Fault(
        "bodies permuted",
        "bodies stand breadth first, as in Isaac Lab, not in MuJoCo's order",
        _body_order(reading, order),
    )
    if reading.joint_pos is not None:
        both = _joint_order(_body_order(reading, order), np.argsort(joints_breadth_first(model)))
        yield Fault(
            "bodies permuted",
            "bodies and joints stand breadth first, as in Isaac Lab, not in MuJoCo's order",
            both,
        )
        found = _assigned_bodies(reading, model)
        if said := _permuted("bodies", found, model.body_names):
            yield Fault("bodies permuted", said, _body_order(reading, found))


def _permuted(what: str, found: IntArray, names: Sequence[str]) -> str:
    """Say which parts stand in others' places, given where each was found, shape (n,)."""
    wrong = [names[k] for k in np.flatnonzero(found != np.arange(len(found))).tolist()]
    return f"{len(wrong)} {what} are permuted: {_listed(wrong)}" if wrong else ""


def _listed(names: Sequence[str]) -> str:
    return ", ".join(names[:4]) + (", ..." if len(names) > 4 else "")


def _joints(reading: Reading, evidence: Evidence) -> Iterator[Fault]:
    if reading.joint_pos is None:
        return
    model = evidence.model
    yield Fault(
        "joints permuted",
        "joints stand breadth first, as in Isaac Lab, not in MuJoCo's order",
        _joint_order(reading, np.argsort(joints_breadth_first(model))),
    )
    true = _true_joints(reading, evidence)
    if true is None:
        return
    frames, angles = true
    apart = np.abs(angles[:, :, None] - reading.joint_pos[frames][:, None, :]).mean(axis=0)
    found = _assigned(apart)
    if said := _permuted("joints", found, model.joint_names):
        yield Fault("joints permuted", said, _joint_order(reading, found))
    yield from _single_joints(reading, model, reading.joint_pos[frames], angles)


def _single_joints(
    reading: Reading, model: RobotModel, said: FloatArray, true: FloatArray
) -> Iterator[Fault]:
    """Yield what may be wrong with some hinges only, given some angles and what they should be."""
    off = np.abs(said - true).mean(axis=0)
    zero = np.median(said - true, axis=0)
    one = np.ones(len(off))
    for kind, problem, factor, shift in (
        ("mirrored", "{} turn{s} the other way", -one, 0.0 * zero),
        ("degrees", "{} {is} in degrees, not radians", np.radians(one), 0.0 * zero),
        ("zero", "the zero of {} is off by {by} degrees", one, zero),
    ):
        wrong = np.abs(factor * said - shift - true).mean(axis=0) < _OTHERWISE * off
        if kind == "zero":
            wrong &= np.abs(zero) > _ZERO_RAD
        if not wrong.any():
            continue
        factor, shift = np.where(wrong, factor, 1.0), np.where(wrong, shift, 0.0)
        joint_pos, speed = reading.joint_pos, reading.joint_vel
        assert joint_pos is not None
        other = replace(
            reading,
            joint_pos=factor * joint_pos - shift,
            joint_vel=None if speed is None else factor * speed,
        )
        names = [model.joint_names[k] for k in np.flatnonzero(wrong).tolist()]
        by = [f"{np.degrees(angle):.3g}" for angle in zero[wrong].tolist()]
        words = {"s": "s", "is": "is"} if len(names) == 1 else {"s": "", "is": "are"}
        yield Fault(kind, problem.format(_listed(names), by=_listed(by), **words), other)


def _mirrored(reading: Reading, evidence: Evidence) -> Iterator[Fault]:
    model = evidence.model
    mirror = Mirror(model)
    yield Fault("mirrored", "the motion is mirrored, left for right", mirror.all(reading))
    if reading.joint_pos is not None:
        yield Fault("mirrored", "the joints are mirrored, left for right", mirror.joints(reading))
    if reading.body_pos is not None:
        yield Fault("mirrored", "the bodies are mirrored, left for right", mirror.bodies(reading))
    flip = np.array([1.0, -1.0, 1.0])
    yield Fault(
        "mirrored",
        "y points to the right: places are mirrored",
        _placed(reading, lambda p: p * flip),
    )


def _rate(reading: Reading, evidence: Evidence) -> Iterator[Fault]:
    rates: set[float] = set()
    meant = evidence.meant
    if meant is not None:
        rates |= {meant.rate_hz, meant.rate_hz * (len(reading) - 1) / max(meant.n_frames - 1, 1)}
    if reading.times_s is not None:
        step = float(np.median(np.diff(reading.times_s)))
        if step > 0:
            rates.add(1.0 / step)
    if reading.joint_vel is not None and reading.joint_pos is not None:
        moved = np.gradient(reading.joint_pos, axis=0)[1:-1]
        size = float((moved**2).sum())
        if size > 0:
            rates.add(float((reading.joint_vel[1:-1] * moved).sum()) / size)
    for rate_hz in sorted(rates):
        if not _RATES[0] < rate_hz < _RATES[1] or abs(rate_hz / reading.rate_hz - 1.0) < 1e-3:
            continue
        problem = (
            f"readers play it at {reading.rate_hz:.4g} Hz; its frames are those of {rate_hz:.4g} Hz"
        )
        other = replace(reading, rate_hz=rate_hz)
        yield Fault("rate", problem, other)
        if reading.times_s is not None:
            times = reading.times_s * (reading.rate_hz / rate_hz)
            yield Fault("rate", problem, replace(other, times_s=times))


def _frames(reading: Reading, evidence: Evidence) -> Iterator[Fault]:
    """Yield where frames may be missing: what came after them is too early."""
    gaps = set()
    if reading.times_s is not None:
        steps = np.diff(reading.times_s) * reading.rate_hz
        gaps.add((int(steps.argmax()) + 1, round(float(steps.max())) - 1))
    meant = evidence.meant
    if meant is not None:
        missing = missing_of(reading, meant)
        yield from _ends(reading, meant, missing)
        if 0 < missing < len(reading):
            gaps.add((_gap(reading, evidence.model, meant, missing), missing))
    for after, missing in sorted(gaps):
        if missing > 0:
            problem = (
                f"{_are(missing)} missing after frame {after - 1}, "
                f"{(after - 1) / reading.rate_hz:.4g} s"
            )
            yield Fault("frames", problem, _filled(reading, after, missing))


def _ends(reading: Reading, meant: Meant, missing: int) -> Iterator[Fault]:
    """Yield that frames are missing at the beginning or the end: what is there has to fit alone."""
    if missing <= 0:
        return
    for where, first in (("the beginning", missing), ("the end", 0)):
        at = meant.times_s * reading.rate_hz - first
        there = (at > -1e-6) & (at < len(reading) - 1 + 1e-6)
        if there.sum() > 1:
            part = replace(
                meant,
                n_frames=len(reading),
                times_s=at[there] / reading.rate_hz,
                pos=meant.pos[there],
                quat=meant.quat[there],
            )
            problem = f"{_are(missing)} missing at {where}, {missing / reading.rate_hz:.4g} s"
            yield Fault("frames", problem, reading, part)


def _are(missing: int) -> str:
    return f"{missing} frames are" if missing > 1 else "1 frame is"


def _gap(reading: Reading, model: RobotModel, meant: Meant, missing: int) -> int:
    """Return how many frames come before those that are missing.

    Of all places at which what was meant fits best before and after, the one where most moves.
    """
    at = np.round(meant.times_s * reading.rate_hz).astype(np.int64)
    n = len(reading)

    def off(frames: IntArray) -> FloatArray:
        inside = np.clip(frames, 0, n - 1)
        posture = postures(reading, model, inside)
        there = model.forward(reading.root_pos[inside], reading.root_quat[inside], posture)
        return np.asarray(np.linalg.norm(there.pos - meant.pos, axis=-1).mean(axis=-1))

    places = np.arange(1, n)
    before = at[None] < places[:, None]
    after = at[None] >= places[:, None] + missing
    costs = np.where(before, off(at), 0.0) + np.where(after, off(at - missing), 0.0)
    means = costs.sum(axis=1) / np.maximum((before | after).sum(axis=1), 1)
    steps = np.abs(np.diff(postures(reading, model, slice(None)), axis=0)).sum(axis=1)
    steps += np.linalg.norm(np.diff(reading.root_pos, axis=0), axis=1)
    best = means <= means.min() + 1e-9
    return int(places[best][steps[best].argmax()])


def _filled(reading: Reading, after: int, missing: int) -> Reading:
    """Return a reading with frames put in that lie between those beside them."""
    n = len(reading)
    between = np.linspace(after - 1, after, missing + 2)[1:-1]
    rows = np.concatenate([np.arange(after), between, np.arange(after, n)])
    low = np.floor(rows).astype(np.int64)
    share, high = rows - low, np.minimum(low + 1, n - 1)

    def filled(values: FloatArray | None, *, turns: bool = False) -> FloatArray | None:
        if values is None:
            return None
        one, other = values[low], values[high]
        if turns:  # the nearer of the two quaternions of a rotation
            other = np.where((one * other).sum(axis=-1, keepdims=True) < 0, -other, other)
        weight = share.reshape(-1, *(1,) * (values.ndim - 1))
        return np.asarray((1 - weight) * one + weight * other)

    parts: dict[str, Any] = {
        name: filled(getattr(reading, name), turns=name.endswith("quat"))
        for name in (
            "root_pos",
            "root_quat",
            "joint_pos",
            "body_pos",
            "body_quat",
            "joint_vel",
            "body_lin_vel",
            "body_ang_vel",
        )
    }
    times = reading.times_s
    if times is not None:
        times = times[0] + np.arange(len(rows)) / reading.rate_hz
    return replace(reading, **parts, times_s=times)


def _place(reading: Reading, evidence: Evidence) -> Iterator[Fault]:
    meant, model = evidence.meant, evidence.model
    frames = some(len(reading), _FEW)
    joints = postures(reading, model, frames)
    there = model.forward(reading.root_pos[frames], reading.root_quat[frames], joints)
    offs = [np.array([0.0, 0.0, float(np.median(model.lowest(there)))])]
    if meant is not None:
        at = np.clip(np.round(meant.times_s * reading.rate_hz).astype(int), 0, len(reading) - 1)
        offs.append(np.median(reading.root_pos[at] - meant.pos[:, 0], axis=0))
    for off in offs:
        off = np.where(np.abs(off) < 1e-4, 0.0, off)
        if not off.any() or np.linalg.norm(off) > _FARTHEST_M:
            continue
        only_z = not off[:2].any()
        problem = (
            f"places are {abs(off[2]):.4g} m too {'high' if off[2] > 0 else 'low'}"
            if only_z
            else f"places are off by ({off[0]:.4g}, {off[1]:.4g}, {off[2]:.4g}) m"
        )
        yield Fault("place", problem, _placed(reading, partial(np.add, -off)))
        if reading.body_pos is not None:
            base = replace(reading, root_pos=reading.root_pos - off)
            yield Fault("place", f"the base's {problem}", base)


def _axes(reading: Reading, evidence: Evidence) -> Iterator[Fault]:
    half = np.sqrt(0.5)
    for quat, problem in (
        (np.array([half, half, 0.0, 0.0]), "y points up, not z"),
        (np.array([0.5, 0.5, 0.5, 0.5]), "y points up and z ahead, not z up and x ahead"),
    ):
        yield Fault("axes", problem, _all_turned(reading, quat))
    for order in ((1, 0, 2), (2, 1, 0), (0, 2, 1)):
        one, other = ("xyz"[k] for k in range(3) if order[k] != k)
        exchanged = _placed(reading, partial(np.take, indices=order, axis=-1))
        yield Fault("axes", f"{one} and {other} of places are exchanged", exchanged)
    meant = evidence.meant
    if meant is None:
        return
    at = np.clip(np.round(meant.times_s * reading.rate_hz).astype(int), 0, len(reading) - 1)
    own, wanted = (quaternion_to_matrix(quat) for quat in (reading.root_quat[at], meant.quat[:, 0]))
    between = own @ np.swapaxes(wanted, 1, 2)
    sines, cosines = between[:, 1, 0] - between[:, 0, 1], between[:, 0, 0] + between[:, 1, 1]
    angle = float(np.arctan2(sines.sum(), cosines.sum()))
    if abs(angle) > _TURNED_RAD:
        back = np.array([np.cos(angle / 2), 0.0, 0.0, -np.sin(angle / 2)])
        problem = f"all is turned by {np.degrees(angle):.4g} degrees about the vertical"
        yield Fault("axes", problem, _all_turned(reading, back))


def _velocities(reading: Reading, evidence: Evidence) -> Iterator[Fault]:
    linear, angular, joint = reading.body_lin_vel, reading.body_ang_vel, reading.joint_vel
    if joint is not None:
        yield Fault(
            "velocities",
            "joint velocities are in degrees per second",
            replace(reading, joint_vel=np.radians(joint)),
        )
    yield Fault(
        "velocities",
        "velocities are those per frame, not per second",
        replace(
            reading,
            joint_vel=None if joint is None else joint * reading.rate_hz,
            body_lin_vel=None if linear is None else linear * reading.rate_hz,
            body_ang_vel=None if angular is None else angular * reading.rate_hz,
        ),
    )
    if linear is None or angular is None or reading.body_quat is None:
        return
    turn = quaternion_to_matrix(reading.body_quat)
    yield Fault(
        "velocities",
        "the bodies' velocities are in their own frames, not the world's",
        replace(
            reading,
            body_lin_vel=np.einsum("tbij,tbj->tbi", turn, linear),
            body_ang_vel=np.einsum("tbij,tbj->tbi", turn, angular),
        ),
    )
    model = evidence.model
    arm = turn @ model.model.body_ipos[model.bodies][:, :, None]
    yield Fault(
        "velocities",
        "linear velocities are those of centres of mass, as in Isaac Lab, not of origins",
        replace(reading, body_lin_vel=linear - np.cross(angular, arm[..., 0])),
    )


_FINDERS: tuple[Callable[[Reading, Evidence], Iterator[Fault]], ...] = (
    _quaternion_order,
    _degrees,
    _unit,
    _bodies,
    _joints,
    _mirrored,
    _rate,
    _frames,
    _place,
    _axes,
    _velocities,
)


class Mirror:
    """A robot seen in a mirror: which body and hinge becomes which.

    Args:
        model: The robot; what it is like is told by where its hinges are, not by names.
    """

    def __init__(self, model: RobotModel) -> None:
        flip = np.array([1.0, -1.0, 1.0])
        rest = model.at_zero
        turn = quaternion_to_matrix(rest.quat[0])
        self.rest = turn
        self.body = _assigned(_apart(rest.pos[0], rest.pos[0] * flip, model))
        axes = np.einsum("jik,jk->ji", turn[model.joint_bodies], model.axes)
        anchor = rest.pos[0, model.joint_bodies]
        seen = axes * -flip  # a turn is mirrored otherwise than a place
        along = axes @ seen.T
        far = np.linalg.norm(anchor[:, None] - (anchor * flip)[None], axis=-1)
        self.joint = _assigned(far + (1.0 - np.abs(along)))
        self.sign = np.sign(along[np.arange(len(axes)), self.joint])

    def joints(self, reading: Reading) -> Reading:
        """Return a reading with its hinges mirrored."""
        return _hinges(reading, lambda values: values[:, self.joint] * self.sign)

    def bodies(self, reading: Reading) -> Reading:
        """Return a reading with its bodies mirrored."""
        flip = np.array([1.0, -1.0, 1.0])

        def seen(values: FloatArray | None, by: FloatArray) -> FloatArray | None:
            return None if values is None else values[:, self.body] * by

        quat = reading.body_quat
        return replace(
            reading,
            body_pos=seen(reading.body_pos, flip),
            body_lin_vel=seen(reading.body_lin_vel, flip),
            body_ang_vel=seen(reading.body_ang_vel, -flip),
            body_quat=None if quat is None else self._turned(quat),
        )

    def all(self, reading: Reading) -> Reading:
        """Return a reading with all mirrored."""
        both = self.bodies(self.joints(reading))
        return replace(
            both,
            root_pos=reading.root_pos * [1.0, -1.0, 1.0],
            root_quat=reading.root_quat * [1.0, -1.0, 1.0, -1.0],
        )

    def _turned(self, quat: FloatArray) -> FloatArray:
        """Return quaternions of mirrored bodies, whose frames need not be mirrored at rest."""
        flip = np.diag([1.0, -1.0, 1.0])
        turn = quaternion_to_matrix(quat)[:, self.body]
        moved = turn @ np.swapaxes(self.rest[self.body], 1, 2)
        return matrix_to_quaternion(flip @ moved @ flip @ self.rest)


def breadth_first(model: RobotModel) -> IntArray:
    """Return the bodies in the order of Isaac Lab: those nearer to the base first."""
    depth = np.zeros(len(model.parents), dtype=np.int64)
    for b, p in enumerate(model.parents):
        depth[b] = 0 if p < 0 else depth[p] + 1
    return np.argsort(depth, kind="stable")


def joints_breadth_first(model: RobotModel) -> IntArray:
    """Return the hinges in the order of Isaac Lab."""
    place = np.argsort(breadth_first(model))
    return np.argsort(place[model.joint_bodies], kind="stable")


def _quats(reading: Reading, change: Callable[[FloatArray], FloatArray]) -> Reading:
    quat = reading.body_quat
    return replace(
        reading,
        root_quat=change(reading.root_quat),
        body_quat=None if quat is None else change(quat),
    )


def _placed(reading: Reading, change: Callable[[FloatArray], FloatArray]) -> Reading:
    pos = reading.body_pos
    return replace(
        reading,
        root_pos=change(reading.root_pos),
        body_pos=pos if pos is None or reading.local else change(pos),
    )


def _all_turned(reading: Reading, quat: FloatArray) -> Reading:
    turned = _placed(reading, partial(_turned, quaternion_to_matrix(quat)))
    return _quats(turned, partial(_product, quat))


def _hinges(reading: Reading, change: Callable[[FloatArray], FloatArray]) -> Reading:
    """Return a reading with other angles of hinges, and velocities."""
    pos, speed = reading.joint_pos, reading.joint_vel
    return replace(
        reading,
        joint_pos=None if pos is None else change(pos),
        joint_vel=None if speed is None else change(speed),
    )


def _scaled(reading: Reading, factor: float, *, base: bool, bodies: bool) -> Reading:
    pos, linear = reading.body_pos, reading.body_lin_vel
    return replace(
        reading,
        root_pos=reading.root_pos * (factor if base else 1.0),
        body_pos=None if pos is None else pos * (factor if bodies else 1.0),
        body_lin_vel=None if linear is None else linear * (factor if bodies else 1.0),
    )


def _body_order(reading: Reading, order: IntArray) -> Reading:
    def sorted_(values: FloatArray | None) -> FloatArray | None:
        return None if values is None else values[:, order]

    pos, quat = sorted_(reading.body_pos), sorted_(reading.body_quat)
    assert pos is not None
    own_base = reading.local or quat is None
    return replace(
        reading,
        root_pos=reading.root_pos if own_base else pos[:, 0],
        root_quat=reading.root_quat if quat is None or own_base else quat[:, 0],
        body_pos=pos,
        body_quat=quat,
        body_lin_vel=sorted_(reading.body_lin_vel),
        body_ang_vel=sorted_(reading.body_ang_vel),
    )


def _joint_order(reading: Reading, order: IntArray) -> Reading:
    return _hinges(reading, lambda values: values[:, order])


def _assigned_bodies(reading: Reading, model: RobotModel) -> IntArray:
    """Return where each body stands in the file, by where forward kinematics puts it."""
    assert reading.body_pos is not None and reading.joint_pos is not None
    frames = some(len(reading), _FEW)
    still = np.tile([1.0, 0.0, 0.0, 0.0], (len(frames), 1))
    seen = model.forward(np.zeros((len(frames), 3)), still, reading.joint_pos[frames])
    pos = reading.body_pos[frames]
    n = len(model.body_names)
    if reading.local or reading.body_quat is None:
        return _assigned(_pairs(seen.pos, pos))
    quat = reading.body_quat[frames]
    best, least = np.arange(n), np.inf
    for root in range(n):  # the base may be anywhere, too
        turn = quaternion_to_matrix(quat[:, root])
        there = np.einsum("tij,tbj->tbi", turn, seen.pos) + pos[:, None, root]
        turned = _product(quat[:, None, root], seen.quat)
        apart = _pairs(there, pos)
        apart += 0.1 * angles_between(turned[:, :, None], quat[:, None]).mean(axis=0)
        found = _assigned(apart)
        cost = float(apart[np.arange(n), found].sum())
        if cost < least:
            best, least = found, cost
    return best


def _true_joints(reading: Reading, evidence: Evidence) -> tuple[IntArray, FloatArray] | None:
    """Return what the angles should be in some frames, from bodies; None where nothing says so."""
    meant, model = evidence.meant, evidence.model
    try:
        if meant is not None:
            at = np.round(meant.times_s * reading.rate_hz).astype(np.int64)
            inside = at < len(reading)
            return at[inside], model.angles_of(meant.quat[inside])[0]
        if reading.body_quat is not None:
            frames = some(len(reading), _FEW)
            return frames, model.angles_of(reading.body_quat[frames])[0]
    except RobotError:  # bodies do not tell the angles of hinges that are not square
        pass
    return None


def _pairs(one: FloatArray, other: FloatArray) -> FloatArray:
    """Return mean distances of all pairs of bodies, (T, B, 3) each, shape (B, B)."""
    return np.asarray(np.linalg.norm(one[:, :, None] - other[:, None], axis=-1).mean(axis=0))


def _apart(one: FloatArray, other: FloatArray, model: RobotModel) -> FloatArray:
    """Return distances of all pairs; of equal ones, those that hang on the same come first."""
    far = np.linalg.norm(one[:, None] - other[None], axis=-1)
    above = np.where(model.parents < 0, 0, model.parents)
    return np.asarray(far + 0.1 * far[above][:, above])


def _assigned(apart: FloatArray) -> IntArray:
    """Return for each row its column, such that all together are nearest."""
    from scipy.optimize import linear_sum_assignment

    return np.asarray(linear_sum_assignment(apart)[1], dtype=np.int64)


def _turned(turn: FloatArray, places: FloatArray) -> FloatArray:
    return np.asarray(places @ turn.T)


def _product(p: FloatArray, q: FloatArray) -> FloatArray:
    from mplearn.maths.quaternions import quaternion_product

    return np.stack(quaternion_product(np.moveaxis(p, -1, 0), np.moveaxis(q, -1, 0)), axis=-1)
