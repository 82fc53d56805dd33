"""Legs that are in each other's way: what collides when feet cross."""

from __future__ import annotations

import mujoco

from .feet import SOLES

#: Each leg's own bit: shapes of one collide with those of the other, not with their own.
_BITS = (2, 4)


def let_legs_touch(spec: mujoco.MjSpec, thighs: tuple[str, str]) -> None:
    """Make each leg collide with the other one, and its sole too.

    Its shapes are those that the model has, but for a foot's, which is its sole.

    Args:
        spec: The model, changed in place.
        thighs: Bodies whose origin is the hip joint, left and right.
    """
    for side, (thigh, sole) in enumerate(zip(thighs, SOLES, strict=True)):
        foot, own, other = spec.geom(sole).parent, _BITS[side], _BITS[1 - side]
        for body in _down_to(spec.body(thigh), foot.name):
            for geom in body.geoms:
                geom.contype, geom.conaffinity = own, other
        spec.geom(sole).contype |= own
        spec.geom(sole).conaffinity |= other


def _down_to(body: mujoco.MjsBody, foot: str) -> list[mujoco.MjsBody]:
    """Return a body and all below it, but for the foot and its parts."""
    if body.name == foot:
        return []
    return [body, *(each for child in body.bodies for each in _down_to(child, foot))]
