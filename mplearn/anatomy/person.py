"""The person that a skeleton is: which limb is which, how large it is, what upright is for it."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise

import numpy as np

from ..errors import BodyError
from ..mocap.options import option
from ..recording import FloatArray
from .joint_tree import JointTree
from .plan import LimbPair, Plan
from .sides import limbs_left_first

# lengths on the human of 1.75 m [m]: what the person's are compared with
_REFERENCE_M = {"trunk": 0.5775, "thigh": 0.42875, "shank": 0.4305, "shoulders": 0.35}
_STATURE_M = 1.75
_PEOPLE_M = (0.7, 2.3)  # statures
_UNITS_M = (1.0, 0.01, 0.001, 0.0254 / 0.45, 0.0254, 0.3048, 0.1)  # the most usual first
LEAST_CONFIDENCE = 0.15
ABOVE_SHOULDERS = 0.03  # [m] on the human of 1.75 m: the base of the neck is higher
NECK_RISE = 0.084
CLEARLY_UP = 0.85  # cosine between an axis and the way from the ankles to the neck
STRAIGHT = 0.9  # cosine of a leg's bend at which the zero pose still stands


class Person:
    """A person in a skeleton.

    Args:
        name: What the recording is called.
        tree: Its skeleton.
        plan: The body in it, with legs and arms.
        told: Place of the body by joint, as a user says.
        unit_m: Length that was taken for the file's unit [m].
        up_in_doubt: Whether another axis than z may be up.

    Attributes:
        tree: See above, as ``spine`` and ``head`` (nodes, from below).
        legs: The legs, the left one first.
        arms: The arms, the left one first.
        neck: Node at the base of the neck.
        size: Size relative to the human of 1.75 m, in the recording's unit.
        trunk_sizes: The trunk's, along x, y, z, shape (3,).
        stature_m: Estimated stature in the recording's unit.
        factor: What lengths are multiplied with to be metres.
        turn: Rotation from the recording's axes to z up, shape (3, 3).
        trunk: Axes of the trunk in each frame, x ahead, y left, z up as columns, (T, 3, 3).
        upright: Frames in which the person stands most upright.
        zero: The trunk's axes in the zero pose, (3, 3), if that is a standing person's; or None.
        confidence: How sure it is that this is a person, in [0, 1].
        warnings: What a user should know.

    Raises:
        BodyError: It is hardly a person, or left and right cannot be told, with the reason.
    """

    def __init__(
        self,
        name: str,
        tree: JointTree,
        plan: Plan,
        told: Mapping[str, str],
        *,
        unit_m: float = 1.0,
        up_in_doubt: bool = True,
    ) -> None:
        self.unit_m = unit_m
        self.up_in_doubt = up_in_doubt
        self.name, self.tree = name, tree
        self.spine, self.head = plan.spine, plan.head
        self.warnings: list[str] = []
        self.confidence = _likeness(name, tree, plan, sure=bool(told))
        self.legs, self.arms = limbs_left_first(name, tree, plan, told)
        self._measure()
        self._stand()

    @property
    def one_hip(self) -> bool:
        """Whether both legs begin at one point."""
        return self.legs.nodes[0][0] == self.legs.nodes[1][0]

    def at(self, node: int) -> FloatArray:
        """Return where a node is in each frame, shape (T, 3)."""
        at: FloatArray = self.tree.points[:, node]
        return at

    def _measure(self) -> None:
        """Find the neck, and how large the person is."""
        mid_hips = np.mean([self.at(side[0]) for side in self.legs.nodes], axis=0)
        mid_shoulders = np.mean([self.at(side[0]) for side in self.arms.nodes], axis=0)
        up = mid_shoulders - mid_hips
        long = np.linalg.norm(up, axis=1)
        rough = float(np.median(long)) / (_REFERENCE_M["trunk"] - 0.084)
        # arms hang below the base of the neck, or on it; above it there may be two joints of a neck
        head = self.head
        rises = {
            node: float(np.quantile(((self.at(node) - mid_shoulders) * up).sum(axis=1) / long, 0.9))
            for node in (self.arms.root, *head[:2])
        }
        if rises[self.arms.root] > ABOVE_SHOULDERS * rough or not head:
            self.neck = self.arms.root
            if rises[self.neck] < -ABOVE_SHOULDERS * rough:
                self.warnings.append(
                    f"there is no neck: {self.tree.names[self.neck][0]!r}, below the shoulders, is "
                    f"taken for its base, so the trunk may be too short ({option('names')} says "
                    "which joint is which)"
                )
        else:
            necks = head[:2] if len(head) > 2 else head[:1]
            self.neck = min(necks, key=lambda node: abs(rises[node] - NECK_RISE * rough))
        trunk = float(np.median(np.linalg.norm(self.at(self.neck) - mid_hips, axis=1)))
        thigh = np.mean([self.tree.length(a, b) for a, b, _ in self.legs.nodes])
        shank = np.mean([self.tree.length(b, c) for _, b, c in self.legs.nodes])
        measured = trunk + thigh + shank
        expected = sum(_REFERENCE_M[part] for part in ("trunk", "thigh", "shank"))
        self.stature_m = float(_STATURE_M * measured / expected)
        self.factor = 1.0
        low, high = _PEOPLE_M
        if not low < self.stature_m < high:
            factors = [unit_m / self.unit_m for unit_m in _UNITS_M]
            fitting = [f for f in factors if 1.4 < f * self.stature_m < 2.05]
            if not fitting:
                raise BodyError(
                    f"the person in {self.name!r} would be {self.stature_m:.3g} m tall; is the "
                    f"unit of length right? ({option('unit_m')} sets it)"
                )
            self.factor = fitting[0]
            self.warnings.append(
                f"the person would be {self.stature_m:.3g} m tall: all lengths are multiplied by "
                f"{self.factor:.4g} ({option('unit_m')} settles it)"
            )
        # relative to the reference, in the recording's unit
        self.size = float(measured / expected)
        left, right = (self.at(side[0]) for side in self.arms.nodes)
        wide = float(np.median(np.linalg.norm(left - right, axis=1)))
        self.trunk_sizes = np.array(
            [self.size, wide / _REFERENCE_M["shoulders"], trunk / _REFERENCE_M["trunk"]]
        )

    def _trunk_axes(self, points: FloatArray) -> FloatArray:
        """Return x ahead, y left, z up of the trunk as columns, (T, N, 3) to (T, 3, 3)."""
        left, right = (points[:, side[0]] for side in self.legs.nodes)
        up = points[:, self.neck] - 0.5 * (left + right)
        if self.one_hip:
            left, right = (points[:, side[0]] for side in self.arms.nodes)
        return axes_along(up, left - right)

    def _stand(self) -> None:
        """Choose the zero pose, or the most upright frames, as what standing is like."""
        self.trunk = self._trunk_axes(self.tree.points)
        up = self.trunk[:, :, 2]
        straight = np.mean(
            [
                0.5 * cosines(self.at(a) - self.at(b), self.at(b) - self.at(c))
                + 0.5 * cosines(self.at(a) - self.at(c), up)
                for a, b, c in self.legs.nodes
            ],
            axis=0,
        )
        self._turn_upright()
        order = np.argsort(-(2.0 * straight + up @ self.turn[2]))
        self.upright = order[: max(3, len(order) // 10)]
        self.zero = self._trunk_axes(self.tree.rest[None])[0] if self._zero_stands() else None

    def _zero_stands(self) -> bool:
        """Whether the zero pose has the trunk and the legs of a standing person."""
        rest = self.tree.rest
        up = rest[self.neck] - 0.5 * (rest[self.legs.nodes[0][0]] + rest[self.legs.nodes[1][0]])
        if np.linalg.norm(up) < 0.8 * _REFERENCE_M["trunk"] * self.size:
            return False
        pair = self.arms if self.one_hip else self.legs
        across = rest[pair.nodes[0][0]] - rest[pair.nodes[1][0]]
        bones = [rest[a] - rest[b] for side in self.legs.nodes for a, b in pairwise(side)]
        bent = [float(cosines(bone, up)) for bone in bones]
        return min(bent) > STRAIGHT and abs(float(cosines(across, up))) < 0.3

    def _turn_upright(self) -> None:
        """Find the axis that is up, where it is clearly not z: from the ankles to the neck."""
        self.turn = np.eye(3)
        ankles = np.mean([self.at(side[2]) for side in self.legs.nodes], axis=0)
        tall = unit(self.at(self.neck) - ankles).mean(axis=0)
        axis = int(np.argmax(np.abs(tall)))
        sign = float(np.sign(tall[axis]))
        if not self.up_in_doubt or (axis == 2 and sign > 0) or abs(tall[axis]) < CLEARLY_UP:
            return
        self.turn = np.roll(np.eye(3), (2 - axis), axis=0)
        if sign < 0:
            self.turn = np.diag((1.0, -1.0, -1.0)) @ self.turn
        self.warnings.append(
            f"the person stands along {'-' if sign < 0 else ''}{'xyz'[axis]} of what was read, so "
            f"that was taken for up ({option('up_axis')} settles it)"
        )


def _likeness(name: str, tree: JointTree, plan: Plan, *, sure: bool) -> float:
    """Return how sure it is that a plan is a person; refuse what is hardly one."""
    assert plan.legs is not None and plan.arms is not None
    arms, legs = plan.arms.nodes, plan.legs.nodes
    if arms[0][0] == arms[1][0] and legs[0][0] != legs[1][0] and not sure:
        # of a matchstick man both begin at one point; elsewhere the wrists are missing
        raise BodyError(
            f"both arms of {name!r} would begin at {tree.names[arms[0][0]][0]!r}; are joints "
            f"missing in its arms? {option('names')} says which joint is which"
        )
    confidence = float(1.0 / (1.0 + np.exp(0.5 * (plan.legs.cost + plan.arms.cost - 10.0))))
    if confidence >= LEAST_CONFIDENCE or sure:
        return confidence
    limbs: tuple[tuple[str, LimbPair], ...] = (("leg", plan.legs), ("arm", plan.arms))
    would = " and the ".join(
        f"{what} {' '.join(tree.names[node][0] for node in pair.nodes[0])}" for what, pair in limbs
    )
    raise BodyError(
        f"the skeleton of {name!r} is hardly a person's: it would have the {would}; "
        f"{option('names')} says which joint is which"
    )


def axes_along(up: FloatArray, across: FloatArray) -> FloatArray:
    """Return x ahead, y left, z up as columns for up and roughly left, (T, 3) to (T, 3, 3)."""
    up = unit(up)
    across = unit(across - (across * up).sum(axis=-1, keepdims=True) * up)
    return np.stack((np.cross(across, up), across, up), axis=-1)


def cosines(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the cosines between vectors, (..., 3) and (..., 3) to (...)."""
    between: FloatArray = (unit(a) * unit(b)).sum(axis=-1)
    return between


def unit(vectors: FloatArray) -> FloatArray:
    """Return vectors of length 1, shape (..., 3)."""
    scaled: FloatArray = vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-9)
    return scaled
