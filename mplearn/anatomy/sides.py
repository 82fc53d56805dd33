"""Which side is left: by where a person faces, held against what the names say."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ..errors import BodyError
from ..option_names import option
from ..recording import FloatArray
from .facing import MirroredError
from .joint_tree import JointTree
from .name_hints import left_of_pair
from .plan import LimbPair, Plan

FACES = 0.3  # how clearly a person must face somewhere


def limbs_left_first(
    name: str, tree: JointTree, plan: Plan, told: Mapping[str, str]
) -> tuple[LimbPair | None, LimbPair | None]:
    """Return legs and arms, of each that there are the left one first.

    Args:
        name: What the recording is called.
        tree: Its skeleton.
        plan: The body in it.
        told: Place of the body by joint, as a user says.

    Raises:
        BodyError: Facing and names contradict each other, or neither tells.
    """
    legs, arms = plan.legs, plan.arms
    first = legs or arms
    assert first is not None
    votes = facing_votes(tree, plan)
    facing = sum(value for _, value in votes) / max(1.0, np.sqrt(len(votes)))
    said = _told_left(tree, first, told) or (_told_left(tree, arms, told) if arms else 0)
    user = bool(said)
    if not user:
        said = left_of_pair(*_names(tree, first))
        if abs(facing) > FACES and said and np.sign(facing) != said:
            seen = ", ".join(f"{why} {value:+.1f}" for why, value in votes)
            raise MirroredError(
                f"{name!r} is mirrored: its names call the one side left, and by the way it faces "
                f"it is the right one ({seen}); are the axes left-handed ({option('mirrored')}), "
                f"or are the names exchanged? {option('names')} says which joint is which"
            )
        if abs(facing) <= FACES and not said:
            raise BodyError(
                f"cannot tell left from right in {name!r}: nothing points ahead clearly, and the "
                f"names do not say; {option('names')} does"
            )
    left_first = (said or np.sign(facing)) > 0
    if legs is None or arms is None:
        only = first if left_first else _exchanged(first)
        return (None, only) if legs is None else (only, None)
    hips = _between(tree, legs) * (1.0 if left_first else -1.0)
    arms_left_first = np.median((hips * _between(tree, arms)).sum(axis=1)) > 0
    arms_said = left_of_pair(*_names(tree, arms))
    if not user and arms_said and (arms_said > 0) != arms_left_first:
        raise BodyError(
            f"the arms of {name!r} are called left and right the other way round than its legs; "
            f"{option('names')} says which joint is which"
        )
    return (
        legs if left_first else _exchanged(legs),
        arms if arms_left_first else _exchanged(arms),
    )


def _told_left(tree: JointTree, pair: LimbPair, told: Mapping[str, str]) -> int:
    """Return 1 if a user calls a joint of the first limb left, -1 of the second, 0 neither."""
    for sign, *parts in zip((1, -1), pair.nodes, pair.inner, pair.outer, strict=True):
        for name in (name for part in parts for node in part for name in tree.names[node]):
            side = told.get(name, "")[-2:]
            if side in ("_l", "_r"):
                return sign if side == "_l" else -sign
    return 0


def _names(tree: JointTree, pair: LimbPair) -> tuple[list[str], list[str]]:
    sides = [(*inner, *nodes) for inner, nodes in zip(pair.inner, pair.nodes, strict=True)]
    first, second = ([tree.names[node][-1] for node in side] for side in sides)
    return first, second


def _between(tree: JointTree, pair: LimbPair) -> FloatArray:
    """Return the way from the second limb to the first, shape (T, 3)."""
    ways: list[FloatArray] = [
        tree.points[:, one] - tree.points[:, other] for one, other in zip(*pair.nodes, strict=True)
    ]
    # limbs that begin at one point part further down
    return ways[1] + ways[2] if pair.one_root else ways[0]


def _exchanged(pair: LimbPair) -> LimbPair:
    return replace(pair, nodes=pair.nodes[::-1], inner=pair.inner[::-1], outer=pair.outer[::-1])


def facing_votes(tree: JointTree, plan: Plan) -> list[tuple[str, float]]:
    """Say what speaks for the first leg being the left one: (why, -1 to 1) of each.

    Forward is where the toes, bent knees and the face point, and where bent elbows do not; with up
    from the legs to the arms, the left is on the left.
    """
    up, across = _trunk_axes(tree, plan)
    ahead = _unit(np.cross(across, up))
    votes = []
    if plan.legs is not None:
        for (hip, knee, ankle), outer in zip(plan.legs.nodes, plan.legs.outer, strict=True):
            if outer:
                foot = tree.points[:, outer[-1]] - tree.points[:, ankle]
                votes.append(("toes", float(np.median((_unit(foot) * ahead).sum(axis=1)))))
            votes.append(("knees", _bend(tree, (hip, knee, ankle), ahead)))
    if plan.arms is not None:
        votes += [("elbows", -0.5 * _bend(tree, joints, ahead)) for joints in plan.arms.nodes]
    return votes


def _trunk_axes(tree: JointTree, plan: Plan) -> tuple[FloatArray, FloatArray]:
    """Return up and from the second limb to the first, along the trunk, (T, 3) each."""
    pair = plan.legs or plan.arms
    assert pair is not None
    across = _between(tree, pair)
    if plan.legs is not None and plan.arms is not None:
        low = 0.5 * (tree.points[:, plan.legs.nodes[0][0]] + tree.points[:, plan.legs.nodes[1][0]])
        high = 0.5 * (tree.points[:, plan.arms.nodes[0][0]] + tree.points[:, plan.arms.nodes[1][0]])
        up = high - low
    elif plan.legs is not None:
        knees = 0.5 * (
            tree.points[:, plan.legs.nodes[0][1]] + tree.points[:, plan.legs.nodes[1][1]]
        )
        hips = 0.5 * (tree.points[:, plan.legs.nodes[0][0]] + tree.points[:, plan.legs.nodes[1][0]])
        up = hips - knees
    else:
        up = np.broadcast_to(np.array([0.0, 0.0, 1.0]), across.shape)
        if plan.head:
            up = tree.points[:, plan.head[-1]] - tree.points[:, pair.root]
    up = _unit(up)
    across = across - (across * up).sum(axis=1, keepdims=True) * up
    return up, _unit(across)


def _bend(tree: JointTree, joints: tuple[int, int, int], ahead: FloatArray) -> float:
    """Return how far the middle joint lies ahead of the line of the others, of -1 to 1."""
    a, b, c = (tree.points[:, joint] for joint in joints)
    way = c - a
    share = ((b - a) * way).sum(axis=1) / np.maximum((way * way).sum(axis=1), 1e-12)
    off = b - a - share[:, None] * way
    size = np.linalg.norm(b - a, axis=1) + np.linalg.norm(c - b, axis=1)
    return float(np.clip(np.mean((off * ahead).sum(axis=1) / size) * 8.0, -1, 1))


def _unit(vectors: FloatArray) -> FloatArray:
    unit: FloatArray = vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-9)
    return unit
