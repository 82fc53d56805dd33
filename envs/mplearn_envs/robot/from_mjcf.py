"""Any humanoid's MJCF model as a `Robot`, told by which body plays which role.

Gains follow one rule: those of the `humanoid`'s hinges of the same segment, scaled by m g h, the
stiffness against gravity that an ankle must exceed by far. Torque limits are the model's own where
it has some.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from math import radians
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from mplearn.errors import RobotError

from .compiling import compile_once, read_model
from .drives import HUMANOID_BASE_VELOCITY, HUMANOID_DRIVES, JointGroup
from .feet import below, foot_hinges, way_up
from .foreign import (
    add_servos,
    add_soles,
    compiled,
    on_our_floor,
    read_spec,
    take_out_drives,
)
from .reroot import rerooted
from .roles import NEEDED_ROLES, ROLES

_LOOSE = "hand_l"  # hinges that carry no segment (fingers) are driven like a hand's


def described(
    source: str | Path, name: str, segments: Mapping[str, str], attention: Mapping[str, float]
) -> dict[str, Any]:
    """Return the fields of a `Robot`; see `Robot.from_mjcf`."""
    missing = [role for role in NEEDED_ROLES if role not in segments]
    unknown = sorted(set(segments) - set(ROLES))
    if missing or unknown:
        raise RobotError(
            f"robot {name!r} needs bodies for {NEEDED_ROLES}; missing: {missing}"
            + (f"; unknown roles: {unknown}, there are {ROLES}" if unknown else "")
        )
    spec = read_spec(source, name)
    bodies = {body.name for body in spec.bodies[1:]}
    hinges = {joint.name for joint in spec.joints if joint.type == mujoco.mjtJoint.mjJNT_HINGE}
    for body in segments.values():
        if body not in bodies:
            raise RobotError(f"robot {name!r} has no body {body!r}; it has {sorted(bodies)}")
    for hinge, angle in attention.items():
        if hinge not in hinges:
            raise RobotError(f"robot {name!r} has no hinge {hinge!r}; it has {sorted(hinges)}")
        if not isinstance(angle, (int, float, np.number)):
            raise RobotError(f"robot {name!r}: {hinge!r} must be at an angle [rad], not {angle!r}")
    _require_humanoid(compiled(spec, name), segments, name)
    take_out_drives(spec)
    try:
        rooted = rerooted(spec, segments, attention, name)
    except ValueError as error:
        raise RobotError(
            f"the MJCF of robot {name!r} does not compile alone, without its drives: {error}"
        ) from error
    spec = rooted.spec
    feet = (segments["foot_l"], segments["foot_r"])
    add_soles(spec, feet, name)
    model = compiled(spec, name)
    groups = _groups(model, segments, feet)
    add_servos(spec, groups)
    legs = [_hinges_above(model, foot, segments["pelvis"]) for foot in feet]
    knees = [_knee(model, segments, side, name) for side in "lr"]
    thighs = [model.body(int(model.joint(leg[0]).bodyid[0])).name for leg in legs]
    height, roll, pitch = HUMANOID_BASE_VELOCITY
    size = np.sqrt(_cog_height(model) / _cog_height(_humanoid()))
    return {
        "name": name,
        "xml": on_our_floor(spec, name),
        "groups": groups,
        "legs": (legs[0], legs[1]),
        "knees": (knees[0], knees[1]),
        "thighs": (thighs[0], thighs[1]),
        "feet": feet,
        "stance_knee_rad": radians(30.0),
        "guard_knee_rad": radians(12.0),
        "base_velocity": (float(size) * height, roll, pitch),
        "segments": tuple((role, segments[role]) for role in ROLES if role in segments),
        "toes": foot_hinges(model, feet),
        "attention": tuple(rooted.shifted.items()),
        "flipped": rooted.flipped,
        "origin": rooted.origin,
    }


def _require_humanoid(model: mujoco.MjModel, segments: Mapping[str, str], name: str) -> None:
    """Check that a model's joints are those of a humanoid on two feet.

    Raises:
        RobotError: They are not; it says all that is missing.
    """
    pelvis, found = model.body(segments["pelvis"]).id, []
    kinds = {int(mujoco.mjtJoint.mjJNT_BALL): "ball", int(mujoco.mjtJoint.mjJNT_SLIDE): "slide"}
    root = int(model.body_rootid[pelvis])
    own = below(model, root)
    for role, body in segments.items():
        if model.body(body).id not in own:
            found.append(f"{body!r} ({role}) is no part of {model.body(root).name!r}")
    for body in dict.fromkeys(segments[role] for role in NEEDED_ROLES):
        roles = [role for role in NEEDED_ROLES if segments[role] == body]
        if len(roles) > 1 and roles not in (["shank_l", "foot_l"], ["shank_r", "foot_r"]):
            found.append(f"{body!r} cannot be all of {roles}")
    found += [
        f"{thigh!r} does not hang on {segments['pelvis']!r}"
        for thigh in (segments["thigh_l"], segments["thigh_r"])
        if pelvis not in way_up(model, model.body(thigh).id)
    ]
    if not model.body(root).name:
        found.append("the body that hangs on nothing has no name")
    for j in np.flatnonzero(np.isin(model.jnt_bodyid, list(own))):
        joint, kind, owner = model.joint(j).name, int(model.jnt_type[j]), int(model.jnt_bodyid[j])
        if kind in kinds:
            found.append(f"{joint!r} is a {kinds[kind]} joint, no hinge")
        elif kind == mujoco.mjtJoint.mjJNT_HINGE and not joint:
            found.append(f"a hinge of {model.body(owner).name!r} has no name")
        elif kind == mujoco.mjtJoint.mjJNT_HINGE and owner == root:
            found.append(f"{joint!r} ties {model.body(root).name!r} to the world")
    for side in "lr":
        shank, foot = segments[f"shank_{side}"], segments[f"foot_{side}"]
        if foot != shank and not _hinges_above(model, foot, shank):
            found.append(
                f"there is no ankle, a hinge from {shank!r} to {foot!r}: that foot is a part of "
                "the shank, and cannot stay flat on the floor when the leg leans"
            )
    if found:
        raise RobotError(f"robot {name!r} cannot be driven here: " + "; ".join(found))


def hinge_roles(model: mujoco.MjModel, segments: Mapping[str, str]) -> dict[str, str]:
    """Return the role of the segment that each hinge moves: the first at or below its body.

    Hinges that move no segment are left out.
    """
    role_of = {model.body(body).id: role for role, body in segments.items()}
    moved: dict[int, str] = {}
    for segment, role in role_of.items():
        body = segment
        while body > 1 and (body == segment or body not in role_of):
            moved.setdefault(body, role)
            body = int(model.body_parentid[body])
    bodies = {model.joint(j).name: int(model.jnt_bodyid[j]) for j in range(1, model.njnt)}
    return {hinge: moved[body] for hinge, body in bodies.items() if body in moved}


def _groups(
    model: mujoco.MjModel, segments: Mapping[str, str], feet: tuple[str, str]
) -> tuple[JointGroup, ...]:
    """Return a group for each hinge; toes carry the weight, so they are driven like ankles."""
    ours = _humanoid()
    ratio = _weight_moment(model) / _weight_moment(ours)
    roles = hinge_roles(ours, {role: role for role in ROLES})
    softest_first = sorted(HUMANOID_DRIVES, key=lambda group: group.stiffness)
    patterns = {roles[hinge]: group for group in softest_first for hinge in group.names}
    own = hinge_roles(model, segments) | dict.fromkeys(foot_hinges(model, feet), "foot_l")
    found = []
    for j in range(1, model.njnt):
        hinge = model.joint(j).name
        like = patterns[own.get(hinge, _LOOSE)]
        limited = bool(model.jnt_actfrclimited[j])
        torque = np.abs(model.jnt_actfrcrange[j]).min() if limited else ratio * like.torque
        found.append(
            replace(
                like,
                names=(hinge,),
                stiffness=ratio * like.stiffness,
                damping=ratio * like.damping,
                torque=float(torque),
            )
        )
    return tuple(found)


def _humanoid() -> mujoco.MjModel:
    """Return the model of the `humanoid`, after which others are driven."""
    return compile_once(read_model("humanoid"))


def _weight_moment(model: mujoco.MjModel) -> float:
    """Return m g h [N m/rad]."""
    return float(9.81 * model.body_mass.sum() * _cog_height(model))


def _cog_height(model: mujoco.MjModel) -> float:
    """Return the height of the COG above the lowest body, all hinges at zero [m]."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    return float(data.subtree_com[0, 2] - data.xpos[1:, 2].min())


def _hinges_above(model: mujoco.MjModel, below: str, above: str) -> tuple[str, ...]:
    """Return the hinges from one body down to another, in this order."""
    found: list[str] = []
    body = model.body(below).id
    while body not in (0, model.body(above).id):
        first, n = int(model.body_jntadr[body]), int(model.body_jntnum[body])
        found = [model.joint(j).name for j in range(first, first + n)] + found
        body = int(model.body_parentid[body])
    return tuple(found)


def _knee(model: mujoco.MjModel, segments: Mapping[str, str], side: str, name: str) -> str:
    thigh, shank = segments[f"thigh_{side}"], segments[f"shank_{side}"]
    hinges = _hinges_above(model, shank, thigh)
    if len(hinges) != 1:
        raise RobotError(
            f"robot {name!r} needs one hinge from {thigh!r} to {shank!r}, its knee; there are "
            f"{list(hinges)}"
        )
    return hinges[0]
