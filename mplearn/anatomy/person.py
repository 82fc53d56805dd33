"""The person that a skeleton is: which limb is which, how large it is, what upright is for it."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise

import numpy as np

from ..errors import BodyError
from ..option_names import option
from ..recording import FloatArray
from .joint_tree import JointTree
from .likeness import confidence
from .name_hints import says_neck
from .plan import LimbPair, Plan
from .sides import limbs_left_first

# lengths on the human of 1.75 m [m]: what the person's are compared with
_TRUNK_M, _SHOULDERS_M = 0.5775, 0.35
_LEG_M, _ARM_M = (0.42875, 0.4305), (0.3255, 0.2555)  # upper and lower bone
_STATURE_M = 1.75
_PEOPLE_M = (0.7, 2.3)  # statures
_UNITS_M = (1.0, 0.01, 0.001, 0.0254 / 0.45, 0.0254, 0.3048, 0.1)  # the most usual first
ABOVE_SHOULDERS = 0.03  # [m] on the human of 1.75 m: the base of the neck is higher
NECK_RISE = 0.084
SO_CALLED = 0.05  # [m] on that human: how much worse a neck may fit where it alone is called so
_FLOOR_M, _FLAT_M = (-0.06, 0.13), 0.6  # of who lies: height of the lowest joint, and thickness
CLEARLY_UP = 0.85  # cosine between an axis and the way from the ankles to the neck
STRAIGHT = 0.9  # cosine of a leg's bend at which the zero pose still stands


class Person:
    """A person in a skeleton.

    Args:
        name: What the recording is called.
        tree: Its skeleton.
        plan: The body in it; legs or arms may be missing.
        told: Place of the body by joint, as a user says.
        unit_m: Length that was taken for the file's unit [m].
        up_in_doubt: Whether another axis than z may be up.

    Attributes:
        tree: See above, as ``spine`` and ``head`` (nodes, from below).
        legs: The legs, the left one first; None where there are none.
        arms: The arms, the left one first; None where there are none.
        neck: Node at the base of the neck, or what there is instead of one; -1 without arms.
        raised: How far the base of the neck is from that node, on the upright person, shape (3,).
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
        BodyError: The person has no possible size, or left and right cannot be told, with the
            reason.
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
        self.confidence = confidence(plan)
        self.legs, self.arms = limbs_left_first(name, tree, plan, told)
        self.neck, self.raised, self._no_neck = -1, np.zeros(3), False
        if self.legs is None or self.arms is None:
            there = "arms" if self.legs is None else "legs"
            self.warnings.append(f"only {there} are there: what has no place is held at rest")
        self._measure()
        self._stand()

    @property
    def one_hip(self) -> bool:
        """Whether both legs begin at one point."""
        return self.legs is not None and self.legs.one_root

    def at(self, node: int) -> FloatArray:
        """Return where a node is in each frame, shape (T, 3)."""
        at: FloatArray = self.tree.points[:, node]
        return at

    def middle(self, pair: LimbPair, place: int, points: FloatArray | None = None) -> FloatArray:
        """Return the middle between joints of both limbs: 0 for the first, (T, N, 3) to (T, 3)."""
        points = self.tree.points if points is None else points
        first, second = (side[place] for side in pair.nodes)
        return np.asarray(0.5 * (points[:, first] + points[:, second]))

    def _measure(self) -> None:
        """Find the neck, and how large the person is."""
        legs, arms = self.legs, self.arms
        bones = self._bones(legs, _LEG_M) + (self._bones(arms, _ARM_M) if legs is None else [])
        rough = float(np.mean([length / usual for length, usual in bones]))
        if legs is not None and arms is not None:
            up = self.middle(arms, 0) - self.middle(legs, 0)
            rough = float(np.median(np.linalg.norm(up, axis=1))) / (_TRUNK_M - NECK_RISE)
        trunk = _TRUNK_M * rough
        if arms is not None:
            self._find_neck(arms, rough)
        if legs is not None and arms is not None:
            top = self._top(self.tree.points) + (
                NECK_RISE * rough * unit(up) if self._no_neck else 0
            )
            trunk = float(np.median(np.linalg.norm(top - self.middle(legs, 0), axis=1)))
            bones.append((trunk, _TRUNK_M))
        measured, expected = (sum(each) for each in zip(*bones, strict=True))
        self._find_unit(float(measured), float(expected))
        # relative to the reference, in the recording's unit
        self.size = float(measured / expected)
        wide = _SHOULDERS_M * self.size
        if arms is not None:
            left, right = (self.at(side[0]) for side in arms.nodes)
            wide = float(np.median(np.linalg.norm(left - right, axis=1)))
        self.trunk_sizes = np.array([self.size, wide / _SHOULDERS_M, trunk / _TRUNK_M])

    def _bones(
        self, pair: LimbPair | None, usual_m: tuple[float, float]
    ) -> list[tuple[float, float]]:
        """Return how long each bone of limbs is, and on the reference."""
        if pair is None:
            return []
        upper = np.mean([self.tree.length(a, b) for a, b, _ in pair.nodes])
        lower = np.mean([self.tree.length(b, c) for _, b, c in pair.nodes])
        return [(float(upper), usual_m[0]), (float(lower), usual_m[1])]

    def _find_neck(self, arms: LimbPair, rough: float) -> None:
        # arms hang below the base of the neck, or on it; above it there may be two joints of a neck
        head, mid_shoulders = self.head, self.middle(arms, 0)
        up = self._up(self.tree.points, mid_shoulders)
        rises = {
            node: float(np.quantile(((self.at(node) - mid_shoulders) * up).sum(axis=1), 0.9))
            for node in (arms.root, *head[:2])
        }
        self.neck = arms.root
        if rises[arms.root] > ABOVE_SHOULDERS * rough:
            return
        if head:
            necks = head[:2] if len(head) > 2 else head[:1]
            off = {node: abs(rises[node] - NECK_RISE * rough) for node in necks}
            called = [node for node in necks if says_neck(self.tree.names[node])]
            self.neck = min(off, key=lambda node: off[node])
            if len(called) == 1 and off[called[0]] < off[self.neck] + SO_CALLED * rough:
                self.neck = called[0]
        elif rises[self.neck] < -ABOVE_SHOULDERS * rough:
            self._no_neck = True
            self.warnings.append(
                f"there is no neck: its base is taken to be above the shoulders, on "
                f"{self.tree.names[self.neck][0]!r} ({option('names')} says which joint is which)"
            )

    def _find_unit(self, measured: float, expected: float) -> None:
        """Estimate the stature, and what lengths are multiplied with for it to be possible."""
        self.stature_m = _STATURE_M * measured / expected
        self.factor = 1.0
        low, high = _PEOPLE_M
        if low < self.stature_m < high:
            return
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

    def _top(self, points: FloatArray) -> FloatArray:
        """Return the trunk's upper end, (T, N, 3) to (T, 3)."""
        if self._no_neck and self.arms is not None:
            return self.middle(self.arms, 0, points)
        return np.asarray(points[:, self.neck])

    def _up(self, points: FloatArray, top: FloatArray) -> FloatArray:
        """Return where the trunk points up, to its upper end: (T, N, 3) and (T, 3) to (T, 3)."""
        if self.legs is not None:
            return unit(top - self.middle(self.legs, 0, points))
        if len(self.spine) > 1:
            return unit(points[:, self.spine[-1]] - points[:, self.spine[0]])
        if self.head:
            return unit(points[:, self.head[-1]] - points[:, self.spine[-1]])
        return np.broadcast_to(np.array([0.0, 0.0, 1.0]), top.shape)

    def _trunk_axes(self, points: FloatArray) -> FloatArray:
        """Return x ahead, y left, z up of the trunk as columns, (T, N, 3) to (T, 3, 3)."""
        legs, arms = self.legs, self.arms
        if legs is not None and arms is None:
            below, hips = self.middle(legs, 2, points), self.middle(legs, 0, points)
            up = points[:, self.spine[-1]] - hips if len(self.spine) > 1 else hips - below
        else:
            up = self._up(points, self._top(points))
        return axes_along(up, self._across(points))

    def _across(self, points: FloatArray) -> FloatArray:
        """Return the way from right to left, between the hips or the shoulders, (T, 3)."""
        pair = self.legs
        if pair is None or (pair.one_root and self.arms is not None):
            pair = self.arms
        assert pair is not None
        left, right = (points[:, side[0]] for side in pair.nodes)
        return np.asarray(left - right)

    def _stand(self) -> None:
        """Choose the zero pose, or the most upright frames, as what standing is like."""
        self.trunk = self._trunk_axes(self.tree.points)
        up = self.trunk[:, :, 2]
        straight = np.zeros(len(up))
        if self.legs is not None:
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
        if self._no_neck and self.arms is not None:
            rise = self.middle(self.arms, 0) - self.at(self.neck)
            on_trunk = np.einsum("tji,tj->ti", self.trunk, rise)[self.upright]
            self.raised = np.median(on_trunk, axis=0) + np.array((0.0, 0.0, NECK_RISE * self.size))

    def _zero_stands(self) -> bool:
        """Whether the zero pose has the trunk and the legs of a standing person."""
        rest = self.tree.rest[None]
        up, across = self._trunk_axes(rest)[0, :, 2], self._across(rest)[0]
        if self.legs is None:
            return abs(float(cosines(across, up))) < 0.3
        if self.arms is not None:
            long = self._top(rest) - self.middle(self.legs, 0, rest)
            if np.linalg.norm(long) < 0.8 * _TRUNK_M * self.size:
                return False
        bones = [rest[0, a] - rest[0, b] for side in self.legs.nodes for a, b in pairwise(side)]
        bent = [float(cosines(bone, up)) for bone in bones]
        return min(bent) > STRAIGHT and abs(float(cosines(across, up))) < 0.3

    def _turn_upright(self) -> None:
        """Find the axis that is up, where it is clearly not z: from the ankles to the neck."""
        self.turn = np.eye(3)
        tall = self.trunk[:, :, 2].mean(axis=0)
        if self.legs is not None:
            ankles = self.middle(self.legs, 2)
            top = self.middle(self.legs, 0) if self.arms is None else self.at(self.neck)
            tall = unit(top - ankles).mean(axis=0)
        axis = int(np.argmax(np.abs(tall)))
        sign = float(np.sign(tall[axis]))
        if not self.up_in_doubt or (axis == 2 and sign > 0) or abs(tall[axis]) < CLEARLY_UP:
            return
        heights = self.tree.points[:, :, 2] / self.size  # as of the reference [m]
        low, high = (float(np.median(end)) for end in (heights.min(axis=1), heights.max(axis=1)))
        if _FLOOR_M[0] < low < _FLOOR_M[1] and high - low < _FLAT_M:
            return  # who lies on the floor
        self.turn = np.roll(np.eye(3), (2 - axis), axis=0)
        if sign < 0:
            self.turn = np.diag((1.0, -1.0, -1.0)) @ self.turn
        self.warnings.append(
            f"the person stands along {'-' if sign < 0 else ''}{'xyz'[axis]} of what was read, so "
            f"that was taken for up ({option('up_axis')} settles it)"
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
