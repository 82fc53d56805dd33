"""How a body differs from what the robot believes of itself, and what happens to it: levels.

Domain randomisation [Tobin2017]: each episode draws a body from a level. The robot plans for the
body that it believes in.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal, NamedTuple, TypeAlias

import mujoco
import numpy as np

from mplearn.errors import InvalidValueError
from mplearn.recording import FloatArray
from mplearn_envs.levels import from_levels
from mplearn_envs.robot import Robot
from mplearn_envs.robot.legs import let_legs_touch

from .reflexes import NO_PUSHES, Pushes

BodyName: TypeAlias = Literal["nominal", "randomised", "harsh"]
PUSH_S = 0.1
_CELLS, _CELL_M = 201, 0.1  # of uneven ground
_BALL_M = 0.05  # radius of a payload
_LARGEST = {
    "masses": 0.9,
    "gains": 0.9,
    "friction": 0.9,
    "payload_kg": 20.0,
    "delay_s": 0.1,
    "slope_rad": 0.5,
    "bumps_m": 0.1,
    "start_rad": 0.5,
    "push_ns": 500.0,
    "pushes_per_minute": 600.0,
}


@dataclass(frozen=True)
class Body:
    """What may be drawn in each episode; with all at zero the body is as the robot believes.

    Attributes:
        masses: Largest error of each body's mass and inertia, as a share.
        gains: Largest error of each servo's strength, as a share.
        friction: Largest error of the floor's friction, as a share.
        payload_kg: Largest mass in one hand [kg].
        delay_s: Largest delay of the commands [s].
        slope_rad: Largest slope of the floor, in any direction [rad].
        bumps_m: Depth of the floor's unevenness, in cells of 0.1 m [m].
        start_rad: Standard deviation of the upper body's joints from upright at the start [rad].
        push_ns: Largest impulse of a push at the chest, over 0.1 s, in any direction [N s].
        pushes_per_minute: How often one comes, on average [1/min].
        steps: Whether the robot takes steps to survive where it would fall otherwise.

    Raises:
        InvalidValueError: A value is no number in its range.

    Example:
        >>> wrong = Body(masses=0.1, friction=0.3, delay_s=0.01)
        >>> wrong.certain, Body().certain
        (False, True)
    """

    masses: float = 0.0
    gains: float = 0.0
    friction: float = 0.0
    payload_kg: float = 0.0
    delay_s: float = 0.0
    slope_rad: float = 0.0
    bumps_m: float = 0.0
    start_rad: float = 0.0
    push_ns: float = 0.0
    pushes_per_minute: float = 0.0
    steps: bool = False

    def __post_init__(self) -> None:
        for name, most in _LARGEST.items():
            value = getattr(self, name)
            number = isinstance(value, (int, float, np.number)) and not isinstance(value, bool)
            if not (number and 0.0 <= value <= most):
                raise InvalidValueError(f"body: {name} must be in [0, {most:g}], not {value!r}")
        if not isinstance(self.steps, (bool, np.bool_)):
            raise InvalidValueError(f"body: steps must be True or False, not {self.steps!r}")
        if self.pushes_per_minute > 0 and not self.steps:
            raise InvalidValueError("body: a robot that is pushed needs steps=True")

    @cached_property
    def certain(self) -> bool:
        """Whether there is nothing to draw."""
        return all(getattr(self, name) == 0.0 for name in _LARGEST)


NOMINAL = Body()
BODIES: dict[str, Body] = {
    "nominal": NOMINAL,
    "randomised": Body(
        masses=0.1,
        gains=0.1,
        friction=0.2,
        payload_kg=1.0,
        slope_rad=0.02,
        start_rad=0.05,
        push_ns=12.0,
        pushes_per_minute=6.0,
        steps=True,
    ),
    "harsh": Body(
        masses=0.2,
        gains=0.2,
        friction=0.4,
        payload_kg=2.5,
        delay_s=0.004,
        slope_rad=0.05,
        bumps_m=0.005,
        start_rad=0.1,
        push_ns=40.0,
        pushes_per_minute=6.0,
        steps=True,
    ),
}


def make_body(given: Body | str | Mapping[str, Any]) -> Body:
    """Return a body from its level's name, itself, or its values by name.

    A mapping may name a ``level`` that it starts from.

    Raises:
        InvalidValueError: There is no such level or value, or one is out of its range.

    Example:
        >>> make_body("nominal").certain, make_body({"payload_kg": 0.5}).payload_kg
        (True, 0.5)
    """
    return from_levels("body", given, BODIES)


def body_model(robot: Robot, body: Body) -> mujoco.MjModel:
    """Return the model in which a robot's bodies of one level are drawn, not disturbed yet.

    Example:
        >>> from mplearn_envs.robot import humanoid
        >>> body_model(humanoid(), Body()).nu
        30
    """
    if body.bumps_m == 0.0 and not body.steps:
        return mujoco.MjModel.from_xml_string(robot.xml)
    spec = mujoco.MjSpec.from_string(robot.xml)
    if body.steps:
        let_legs_touch(spec, robot.thighs)
    if body.bumps_m > 0.0:
        _add_bumps(spec, body)
    return spec.compile()


def _add_bumps(spec: mujoco.MjSpec, body: Body) -> None:
    """Make a model's floor uneven, level yet."""
    half_m = 0.5 * (_CELLS - 1) * _CELL_M
    spec.add_hfield(
        name="ground",
        nrow=_CELLS,
        ncol=_CELLS,
        size=[half_m, half_m, body.bumps_m, 0.5],
        userdata=np.zeros(_CELLS * _CELLS),
    )
    floor = spec.geom("floor")
    floor.type, floor.hfieldname = mujoco.mjtGeom.mjGEOM_HFIELD, "ground"
    floor.pos = [0.0, 0.0, -body.bumps_m]  # what stands out is as high as the floor was


class Drawn(NamedTuple):
    """What a draw has besides the model's numbers.

    Attributes:
        lag: By how many control periods commands come late.
        off: By how much the joints are off at the start, shape (n,) [rad].

    Example:
        >>> from mplearn_envs.robot import humanoid
        >>> body = Body(delay_s=0.02)
        >>> drawn = embody(body_model(humanoid(), body), humanoid(), body, draw=3)
        >>> 0 <= drawn.lag <= 5  # periods of 4 ms
        True
    """

    lag: int
    off: FloatArray


def embody(model: mujoco.MjModel, robot: Robot, body: Body, draw: int) -> Drawn:
    """Draw a body: change a model in place; the same draw gives the same body.

    Args:
        model: Of `body_model`, with whatever body was drawn before.
        robot: The robot.
        body: What may be drawn.
        draw: Which draw.

    Example:
        >>> from mplearn_envs.robot import humanoid
        >>> body = Body(masses=0.1, delay_s=0.02, start_rad=0.05)
        >>> model = body_model(humanoid(), body)
        >>> mass_kg = model.body_mass.sum()
        >>> drawn = embody(model, humanoid(), body, draw=3)
        >>> drawn.off.shape, bool(model.body_mass.sum() != mass_kg)
        ((30,), True)
    """
    n = len(robot.joint_names)
    if body.certain:
        return Drawn(0, np.zeros(n))
    rng = np.random.default_rng([draw, 0])
    believed = robot.model()
    heavier = rng.uniform(1.0 - body.masses, 1.0 + body.masses, model.nbody)
    model.body_mass[:] = believed.body_mass * heavier
    model.body_inertia[:] = believed.body_inertia * heavier[:, None]
    strength = rng.uniform(1.0 - body.gains, 1.0 + body.gains, model.nu)
    model.actuator_gainprm[:] = believed.actuator_gainprm
    model.actuator_biasprm[:] = believed.actuator_biasprm
    model.actuator_gainprm[:, 0] *= strength
    model.actuator_biasprm[:, 1:3] *= strength[:, None]
    model.geom_friction[:] = believed.geom_friction
    model.geom_friction *= rng.uniform(1.0 - body.friction, 1.0 + body.friction)
    hand = dict(robot.segments).get(f"hand_{'lr'[int(rng.integers(2))]}")
    payload_kg = rng.uniform(0.0, 1.0) * body.payload_kg
    if hand is not None:
        model.body_mass[model.body(hand).id] += payload_kg
        model.body_inertia[model.body(hand).id] += 0.4 * payload_kg * _BALL_M**2
    slope, towards = rng.uniform(0.0, 1.0) * body.slope_rad, rng.uniform(0.0, 2.0 * np.pi)
    # the floor stays level and gravity leans, which is the same, seen from the floor
    lean = (np.sin(slope) * np.cos(towards), np.sin(slope) * np.sin(towards), -np.cos(slope))
    model.opt.gravity[:] = np.linalg.norm(believed.opt.gravity) * np.array(lean)
    lag = round(rng.uniform(0.0, 1.0) * body.delay_s / float(model.opt.timestep))
    off = rng.normal(0.0, 1.0, n) * body.start_rad
    off[robot.leg_joints] = 0.0
    if body.bumps_m > 0.0:
        model.hfield_data[:] = rng.uniform(0.0, 1.0, model.hfield_data.shape)
    mujoco.mj_setConst(model, mujoco.MjData(model))
    return Drawn(lag, off)


def draw_pushes(
    model: mujoco.MjModel, robot: Robot, body: Body, draw: int, count: int, duration_s: float
) -> Pushes:
    """Return what pushes a robot in one macro step.

    Args:
        model: Its model.
        robot: The robot.
        body: What may be drawn.
        draw: Which draw: the episode's.
        count: Which macro step of it, from 0.
        duration_s: How long that is planned to take [s].

    Example:
        >>> from mplearn_envs.robot import humanoid
        >>> body = Body(push_ns=5.0, pushes_per_minute=60.0, steps=True)
        >>> model = body_model(humanoid(), body)
        >>> pushes = draw_pushes(model, humanoid(), body, draw=3, count=0, duration_s=30.0)
        >>> again = draw_pushes(model, humanoid(), body, draw=3, count=0, duration_s=30.0)
        >>> str(pushes) == str(again)
        True
    """
    if body.pushes_per_minute == 0.0 or body.push_ns == 0.0:
        return NO_PUSHES
    rng = np.random.default_rng([draw, 1, count])
    period_s = float(model.opt.timestep)
    n = int(rng.poisson(body.pushes_per_minute * duration_s / 60.0))
    starts = np.sort(rng.integers(0, max(round(duration_s / period_s), 1), n))
    size_n = rng.uniform(0.0, body.push_ns, n) / PUSH_S
    angle = rng.uniform(0.0, 2.0 * np.pi, n)
    named = dict(robot.segments)
    chest = model.body(named.get("chest", named["pelvis"])).id
    force = np.column_stack((size_n * np.cos(angle), size_n * np.sin(angle), np.zeros(n)))
    steps = np.column_stack((starts, starts + round(PUSH_S / period_s)))
    return Pushes(chest, steps.astype(np.int64), force)
