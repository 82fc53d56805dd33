"""Which side is left: by where a person faces, held against what the names say."""

from __future__ import annotations

import numpy as np

from ..recording import FloatArray
from .joint_tree import JointTree
from .plan import Plan


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
    across = tree.points[:, pair.nodes[0][0]] - tree.points[:, pair.nodes[1][0]]
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
