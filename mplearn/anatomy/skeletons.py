"""From a skeleton of any dialect to the joints of one body.

Limbs are joints as they are. Where a segment is turned (trunk, head, hands, feet), points are set
on it where the body has them: upright, they stand as on an upright person. What upright is for a
bone, the skeleton's zero pose says where it is that of a standing person (T, A, lying on its back;
only the trunk's and the legs' shape counts), and the most upright frames elsewhere. No joint angle
of the file enters, so the order and the axes of its rotations do not matter.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np

from ..body.marker_tables import TABLES
from ..errors import BodyError
from ..maths.rotation_kernels import nearest_rotation
from ..mocap.kinematics import AXIS_MARK
from ..mocap.options import option
from ..recording import FloatArray, IntArray, Recording, Skeleton
from .body_map import BodyMap
from .joint_tree import JointTree
from .markers import recognise_markers
from .name_hints import left_of_pair
from .plan import LimbPair, Plan, find_plan
from .sides import facing_votes

SOME_FRAMES = 120  # of a recording are looked at
STRAIGHT = 0.9  # cosine of a leg's bend at which the zero pose still stands
FLAT = 0.8  # cosine between a foot and the vertical up to which it stands on its sole
LEAST_CONFIDENCE = 0.15
ABOVE_SHOULDERS = 0.03  # [m] on the human of 1.75 m: the base of the neck is higher
NECK_RISE = 0.084
_TABLE = TABLES["landmarks"]
_ARM = ("shoulder", "elbow", "wrist")
# lengths on the human of 1.75 m [m]: what the person's are compared with
_REFERENCE_M = {"trunk": 0.5775, "thigh": 0.42875, "shank": 0.4305, "shoulders": 0.35}
_STATURE_M = 1.75
_PEOPLE_M = (0.7, 2.3)  # statures
_UNITS_M = (1.0, 0.1, 0.01, 0.001, 0.0254, 0.3048, 0.0254 / 0.45)


def recognise_skeleton(recording: Recording, names: Mapping[str, str] | None = None) -> BodyMap:
    """Find the body in a recording of joint positions.

    Args:
        recording: Joint positions with their skeleton, best with the joints' axes
            (`Hints.joint_axes`).
        names: Place of the body by joint, for what is known better; "" leaves a joint out.

    Raises:
        BodyError: There is no body in it, or left and right cannot be told apart, with the reason.
    """
    skeleton = recording.skeleton
    if skeleton is None:
        raise BodyError(f"recording {recording.name!r} has no skeleton")
    body, axes = _without_axes(skeleton)
    some = recording.markers[:: max(1, len(recording) // SOME_FRAMES)]
    some = some[np.isfinite(some).all(axis=(1, 2))]
    if not len(some):
        raise BodyError(f"recording {recording.name!r} has no frame in which all joints are known")
    tree = JointTree.of(body, some[:, : len(body)])
    plan = find_plan(tree)
    if plan is None or plan.legs is None or plan.arms is None:
        if names:
            return recognise_markers(recording, names)
        some_names = ", ".join(skeleton.names[:6])
        raise BodyError(
            f"no body in the skeleton of {recording.name!r} ({len(body)} joints: {some_names}, "
            "...): two legs and two arms were not found among its branches; "
            f"{option('names')} says which joint is which"
        )
    everything = skeleton.names, skeleton.offsets, dict(names or {})
    return _Builder(recording.name, body, axes, some, tree, plan, *everything).build()


def _without_axes(skeleton: Skeleton) -> tuple[Skeleton, dict[int, tuple[int, int, int]]]:
    """Return the skeleton without points that show axes, and those of each joint."""
    marked = [
        name.endswith(tuple(f"{AXIS_MARK}{axis}" for axis in "xyz")) for name in skeleton.names
    ]
    n = marked.index(True) if True in marked else len(marked)
    axes: dict[int, tuple[int, int, int]] = {}
    for first in range(n, len(marked), 3):
        axes[skeleton.parents[first]] = (first, first + 1, first + 2)
    plain = Skeleton(
        skeleton.names[:n], skeleton.parents[:n], skeleton.offsets[:n], skeleton.ends[:n]
    )
    return plain, axes


@dataclass
class _Builder:
    """Puts a map together, place by place."""

    name: str
    skeleton: Skeleton
    axes: dict[int, tuple[int, int, int]]
    points: FloatArray  # (T, J + 3 axes, 3)
    tree: JointTree
    plan: Plan
    all_names: tuple[str, ...]  # with the points that show axes
    all_offsets: FloatArray
    told: dict[str, str]  # what a user says: place by joint
    used: dict[str, tuple[int, ...]] = field(default_factory=dict)
    rows: dict[str, dict[int, float]] = field(default_factory=dict)
    warnings: list[str] = field(default_factory=list)

    def build(self) -> BodyMap:
        self._check_likeness()
        self._tell_sides()
        self._measure()
        self._find_neutral()
        self._limbs()
        self._trunk()
        self._head()
        for side in "lr":
            self._hand(side)
            self._foot(side)
        self._as_told()
        return self._map()

    # ---- who is where

    def _check_likeness(self) -> None:
        """Refuse what has pairs of branches, but not in a person's proportions."""
        assert self.plan.legs is not None and self.plan.arms is not None
        if self._confidence() >= LEAST_CONFIDENCE or self.told:
            return
        limbs = [
            f"{what} {' '.join(self.tree.names[node][0] for node in pair.nodes[0])}"
            for what, pair in (("leg", self.plan.legs), ("arm", self.plan.arms))
        ]
        raise BodyError(
            f"the skeleton of {self.name!r} is hardly a person's: it would have the "
            f"{' and the '.join(limbs)}; {option('names')} says which joint is which"
        )

    def _confidence(self) -> float:
        assert self.plan.legs is not None and self.plan.arms is not None
        cost = self.plan.legs.cost + self.plan.arms.cost
        return float(1.0 / (1.0 + np.exp(0.5 * (cost - 10.0))))

    def _tell_sides(self) -> None:
        """Order both pairs left first."""
        legs, arms = self.plan.legs, self.plan.arms
        assert legs is not None and arms is not None
        told = self._told_left(legs) or self._told_left(arms)
        votes = facing_votes(self.tree, self.plan)
        facing = sum(value for _, value in votes) / max(1.0, np.sqrt(len(votes)))
        said = left_of_pair(*self._names(legs))
        if told:
            said = told
        elif abs(facing) > 0.3 and said and np.sign(facing) != said:
            seen = ", ".join(f"{why} {value:+.1f}" for why, value in votes)
            raise BodyError(
                f"{self.name!r} is mirrored: its names call the one side left, and by the way it "
                f"faces it is the right one ({seen}); is an axis turned round, or are the names "
                f"exchanged? {option('names')} says which joint is which"
            )
        elif abs(facing) <= 0.3 and not said:
            raise BodyError(
                f"cannot tell left from right in {self.name!r}: nothing points ahead clearly, and "
                f"the names do not say; {option('names')} does"
            )
        left_first = (said or np.sign(facing)) > 0
        hips = self._between(legs) * (1.0 if left_first else -1.0)
        shoulders = self._between(arms)
        same = float(np.median((hips * shoulders).sum(axis=1)))
        arm_said = left_of_pair(*self._names(arms))
        arms_left_first = same > 0
        if not told and arm_said and (arm_said > 0) != arms_left_first:
            raise BodyError(
                f"the arms of {self.name!r} are called left and right the other way round than its "
                f"legs; {option('names')} says which joint is which"
            )
        self.legs = legs if left_first else _exchanged(legs)
        self.arms = arms if arms_left_first else _exchanged(arms)

    def _told_left(self, pair: LimbPair) -> int:
        """Return 1 if a user calls a joint of the first limb left, -1 of the second, 0 neither."""
        for sign, nodes, inner, outer in zip(
            (1, -1), pair.nodes, pair.inner, pair.outer, strict=True
        ):
            for name in (n for node in (*nodes, *inner, *outer) for n in self.tree.names[node]):
                side = self.told.get(name, "")[-2:]
                if side in ("_l", "_r"):
                    return sign if side == "_l" else -sign
        return 0

    def _as_told(self) -> None:
        """Put places where a user says they are, and leave out what is to be left out."""
        for name, place in self.told.items():
            if name not in self.skeleton.names:
                continue
            joint = self.skeleton.names.index(name)
            if place:
                self.rows[place] = {joint: 1.0}
                node = next(n for n, group in enumerate(self.tree.joints) if joint in group)
                self.used[place] = (node,)
            else:
                for other in [p for p, row in self.rows.items() if joint in row]:
                    del self.rows[other]

    def _names(self, pair: LimbPair) -> tuple[list[str], list[str]]:
        sides = [(*inner, *nodes) for inner, nodes in zip(pair.inner, pair.nodes, strict=True)]
        first, second = ([self.tree.names[n][-1] for n in side] for side in sides)
        return first, second

    def _between(self, pair: LimbPair) -> FloatArray:
        return self._at(pair.nodes[0][0]) - self._at(pair.nodes[1][0])

    def _at(self, node: int) -> FloatArray:
        at: FloatArray = self.tree.points[:, node]
        return at

    # ---- how large

    def _measure(self) -> None:
        """Find the neck, and the person's size."""
        mid_hips = np.mean([self._at(side[0]) for side in self.legs.nodes], axis=0)
        mid_shoulders = np.mean([self._at(side[0]) for side in self.arms.nodes], axis=0)
        up = mid_shoulders - mid_hips
        long = np.linalg.norm(up, axis=1)
        rough = float(np.median(long)) / (_REFERENCE_M["trunk"] - 0.084)
        # arms hang below the base of the neck, or on it; above it there may be two joints of a neck
        head = self.plan.head
        rises = {
            node: float(
                np.quantile(((self._at(node) - mid_shoulders) * up).sum(axis=1) / long, 0.9)
            )
            for node in (self.arms.root, *head[:2])
        }
        if rises[self.arms.root] > ABOVE_SHOULDERS * rough or not head:
            self.neck = self.arms.root
        else:
            necks = head[:2] if len(head) > 2 else head[:1]
            self.neck = min(necks, key=lambda node: abs(rises[node] - NECK_RISE * rough))
        trunk = float(np.median(np.linalg.norm(self._at(self.neck) - mid_hips, axis=1)))
        thigh = np.mean([self.tree.length(a, b) for a, b, _ in self.legs.nodes])
        shank = np.mean([self.tree.length(b, c) for _, b, c in self.legs.nodes])
        measured = trunk + thigh + shank
        expected = sum(_REFERENCE_M[part] for part in ("trunk", "thigh", "shank"))
        self.stature_m = float(_STATURE_M * measured / expected)
        self.factor = 1.0
        low, high = _PEOPLE_M
        if not low < self.stature_m < high:
            factors = sorted({a / b for a in _UNITS_M for b in _UNITS_M})
            fitting = [f for f in factors if 1.4 < f * self.stature_m < 2.05]
            if not fitting:
                raise BodyError(
                    f"the person in {self.name!r} would be {self.stature_m:.3g} m tall; is the "
                    f"unit of length right? ({option('unit_m')} sets it)"
                )
            self.factor = min(fitting, key=lambda f: abs(np.log(f * self.stature_m / 1.7)))
            self.warnings.append(
                f"the person would be {self.stature_m:.3g} m tall: all lengths are multiplied by "
                f"{self.factor:.4g} ({option('unit_m')} settles it)"
            )
        # relative to the reference, in the recording's unit
        self.size = float(measured / expected)
        wide = float(np.median(np.linalg.norm(self._between(self.arms), axis=1)))
        self.trunk_sizes = np.array(
            [self.size, wide / _REFERENCE_M["shoulders"], trunk / _REFERENCE_M["trunk"]]
        )

    # ---- what upright is

    def _trunk_axes(self, points: FloatArray) -> FloatArray:
        """Return x ahead, y left, z up of the trunk as columns, (T, N, 3) to (T, 3, 3)."""
        left, right = (points[:, side[0]] for side in self.legs.nodes)
        return axes_along(points[:, self.neck] - 0.5 * (left + right), left - right)

    def _find_neutral(self) -> None:
        """Choose the zero pose, or the most upright frames, as what standing is like."""
        self.trunk = self._trunk_axes(self.tree.points)
        up = self.trunk[:, :, 2]
        straight = np.mean(
            [
                0.5 * _cosines(self._at(a) - self._at(b), self._at(b) - self._at(c))
                + 0.5 * _cosines(self._at(a) - self._at(c), up)
                for a, b, c in self.legs.nodes
            ],
            axis=0,
        )
        self._turn_upright(up, straight)
        order = np.argsort(-(2.0 * straight + up @ self.turn[2]))
        self.upright = order[: max(3, len(order) // 10)]
        self.zero = self._trunk_axes(self.tree.rest[None])[0] if self._zero_stands() else None

    def _zero_stands(self) -> bool:
        """Whether the zero pose has the trunk and the legs of a standing person."""
        rest = self.tree.rest
        up = rest[self.neck] - 0.5 * (rest[self.legs.nodes[0][0]] + rest[self.legs.nodes[1][0]])
        if np.linalg.norm(up) < 0.8 * _REFERENCE_M["trunk"] * self.size:
            return False
        across = rest[self.legs.nodes[0][0]] - rest[self.legs.nodes[1][0]]
        bones = [rest[a] - rest[b] for side in self.legs.nodes for a, b in pairwise(side)]
        bent = [float(_cosines(bone, up)) for bone in bones]
        return min(bent) > STRAIGHT and abs(float(_cosines(across, up))) < 0.3

    def _turn_upright(self, up: FloatArray, straight: FloatArray) -> None:
        """Find the axis that is up, where it is clearly not z."""
        self.turn = np.eye(3)
        standing = straight >= np.quantile(straight, 0.5)
        mean = up[standing].mean(axis=0)
        axis = int(np.argmax(np.abs(mean)))
        sign = float(np.sign(mean[axis]))
        if (axis == 2 and sign > 0) or abs(mean[axis]) < 0.9 or np.median(straight) < 0.9:
            return
        self.turn = np.roll(np.eye(3), (2 - axis), axis=0)
        if sign < 0:
            self.turn = np.diag((1.0, -1.0, -1.0)) @ self.turn
        self.warnings.append(
            f"the person stands along {'-' if sign < 0 else ''}{'xyz'[axis]}, so that was taken "
            f"for up ({option('up_axis')} settles it)"
        )

    def _neutral(self, joint: int) -> FloatArray | None:
        """Return the upright body's axes on a bone, as its zero pose has them, as columns.

        None where the recording does not show how the joint is turned.
        """
        if joint not in self.axes:
            return None
        zero: FloatArray | None = self.zero
        if zero is not None:
            return zero
        return self._upright_axes(joint, self.trunk, self.upright)

    def _upright_axes(self, joint: int, wanted: FloatArray, frames: IntArray) -> FloatArray:
        """Return the axes on a bone that are the wanted ones, (T, 3, 3), in some of the frames."""
        arms = self.points[:, list(self.axes[joint])] - self.points[:, [joint]]  # rows: its axes
        turned = np.einsum("tki,kj->tij", arms, np.linalg.inv(self._shown(joint)).T)
        total = np.einsum("tji,tjk->ik", turned[frames], wanted[frames])
        return np.asarray(nearest_rotation(total))

    def _shown(self, joint: int) -> FloatArray:
        """Return the points that show a joint's axes, in the zero pose, rows, (3, 3)."""
        shown: FloatArray = self.all_offsets[list(self.axes[joint])]
        return shown

    # ---- places

    def _joint(self, place: str, node: int) -> None:
        self.rows[place] = {self.tree.joints[node][0]: 1.0}
        self.used[place] = (node,)

    def _on(
        self,
        place: str,
        node: int,
        joint: int,
        axes: FloatArray,
        at: FloatArray,
        sizes: float | FloatArray,
    ) -> None:
        """Put a place on a bone: from a node, so far along the upright body's axes there."""
        vector = axes @ (sizes * at)
        share = np.linalg.solve(self._shown(joint).T, vector)
        row = {self.tree.joints[node][0]: 1.0}
        row[joint] = row.get(joint, 0.0) - float(share.sum())
        row.update({point: float(c) for point, c in zip(self.axes[joint], share, strict=True)})
        self.rows[place] = row
        self.used[place] = (node,)

    def _towards(self, place: str, node: int, others: tuple[int, ...], far: float) -> None:
        """Put a place on the way from a node to the middle of others, so far from it [m]."""
        middle = self.tree.points[:, list(others)].mean(axis=1)
        length = float(np.median(np.linalg.norm(middle - self._at(node), axis=1)))
        share = float(far * self.size / length)
        row = {self.tree.joints[node][0]: 1.0 - share}
        row.update({self.tree.joints[other][0]: share / len(others) for other in others})
        self.rows[place] = row
        self.used[place] = others

    def _turner(self, node: int) -> int:
        """Return the joint that turns the bone which ends at a node."""
        return self.skeleton.parents[self.tree.joints[node][0]]

    def _own(self, node: int) -> int:
        """Return the last joint of a node that turns anything."""
        joints = [joint for joint in self.tree.joints[node] if joint in self.axes]
        return joints[-1] if joints else self.tree.joints[node][-1]

    def _limbs(self) -> None:
        for pair, names in ((self.legs, ("hip", "knee", "ankle")), (self.arms, _ARM)):
            for side, nodes in zip("lr", pair.nodes, strict=True):
                for name, node in zip(names, nodes, strict=True):
                    self._joint(f"{name}_{side}", node)

    def _trunk(self) -> None:
        self._joint("neck", self.neck)
        pelvis = self._turner((*self.legs.inner[0], *self.legs.nodes[0])[0])
        axes = self._neutral(pelvis)
        if axes is not None:
            for place in ("pelvis_front", "pelvis_back", "lumbar"):
                self._on_middle_of_hips(place, pelvis, axes)
        elif len(self.plan.spine) > 2:
            self._lumbar_on_spine()
        chest = self._turner((*self.arms.inner[0], *self.arms.nodes[0])[0])
        axes = self._neutral(chest)
        if axes is not None:
            for place in ("sternum", "back", "chest_l", "chest_r"):
                at = np.array(_TABLE[place][1]) - _TABLE["neck"][1]
                self._on(place, self.neck, chest, axes, at, self.trunk_sizes)

    def _on_middle_of_hips(self, place: str, joint: int, axes: FloatArray) -> None:
        left, right = (side[0] for side in self.legs.nodes)
        self._on(place, left, joint, axes, np.array(_TABLE[place][1]), self.trunk_sizes)
        row = self.rows[place]
        for node in (left, right):
            first = self.tree.joints[node][0]
            row[first] = row.get(first, 0.0) + (-0.5 if node == left else 0.5)

    def _lumbar_on_spine(self) -> None:
        """Without the pelvis' axes: the lumbar joint lies towards the first joint of the spine."""
        left, right = (side[0] for side in self.legs.nodes)
        middle = 0.5 * (self._at(left) + self._at(right))
        for node in self.plan.spine[:-1]:
            length = float(np.median(np.linalg.norm(self._at(node) - middle, axis=1)))
            if length > 0.04 * self.size:
                share = float(_TABLE["lumbar"][1][2] * self.size / length)
                first = self.tree.joints
                row = {first[left][0]: 0.5 * (1 - share), first[right][0]: 0.5 * (1 - share)}
                row[first[node][0]] = share
                self.rows["lumbar"], self.used["lumbar"] = row, (node,)
                return

    def _head(self) -> None:
        way = (self.arms.root, *self.plan.head)
        after = way[way.index(self.neck) + 1 :]
        if not after and self.neck == self.arms.root:
            return
        far = [self.tree.length(self.neck, node) for node in after]
        rise = _TABLE["skull"][1][2]
        off = [abs(length - rise * self.size) for length in (0.0, *far)]
        skull = (self.neck, *after)[int(np.argmin(off))]
        if skull != self.neck:
            self._joint("skull", skull)
        beyond = (self.neck, *after)[int(np.argmin(off)) + 1 :]
        joint = self._turner(beyond[0]) if beyond else self._own(skull)
        axes = self._neutral(joint)
        origin = _TABLE["skull"][1] if skull != self.neck else (0.0, 0.0, 0.0)
        if axes is not None:
            for place in ("face", "ear_l", "ear_r", "crown"):
                at = np.array(_TABLE[place][1]) - origin
                self._on(place, skull, joint, axes, at, self.size)
        elif beyond and self._is_crown(skull, beyond[-1]):
            self._towards("crown", skull, beyond[-1:], _TABLE["crown"][1][2] - origin[2])

    def _is_crown(self, skull: int, end: int) -> bool:
        way = self._at(end) - self._at(skull)
        return bool(np.median(_cosines(way, self.trunk[:, :, 2])[self.upright]) > 0.8)

    def _hand(self, side: str) -> None:
        elbow, wrist = self.arms.nodes["lr".index(side)][1:]
        toward = self.tree.way(elbow, wrist)[-2]
        fingers = [node for node in self.tree.edges[wrist] if node != toward]
        if not fingers:
            self._stiff_hand(side, elbow, wrist)
            return
        thumb = self._thumb(wrist, fingers)
        knuckles = tuple(node for node in fingers if node != thumb)
        self._towards(f"hand_{side}", wrist, knuckles, -_TABLE["hand_l"][1][2])
        if thumb is None:
            return
        # across the knuckles, from the one farthest from the thumb to the nearest
        apart = [self.tree.length(thumb, node) for node in knuckles]
        near, far = knuckles[int(np.argmin(apart))], knuckles[int(np.argmax(apart))]
        wide = self.tree.length(near, far)
        if len(knuckles) > 1 and wide > 0.02 * self.size:
            share = float(_TABLE["thumb_side_l"][1][0] * self.size / wide)
            row = dict(self.rows[f"hand_{side}"])
            for node, sign in ((near, 1.0), (far, -1.0)):
                first = self.tree.joints[node][0]
                row[first] = row.get(first, 0.0) + sign * share
            self.rows[f"thumb_side_{side}"] = row
            self.used[f"thumb_side_{side}"] = (near, far, thumb)

    def _stiff_hand(self, side: str, elbow: int, wrist: int) -> None:
        """Where the hand has no end: it goes on from the forearm in the zero pose."""
        joint = self._own(wrist)
        if joint in self.axes:
            way = _unit(self.tree.rest[wrist] - self.tree.rest[elbow])
            length = -_TABLE["hand_l"][1][2]
            self._on(f"hand_{side}", wrist, joint, np.eye(3), length * way, self.size)

    def _thumb(self, wrist: int, fingers: list[int]) -> int | None:
        """Return the finger that is the thumb: named so, or the one that stands off most."""
        if len(fingers) < 2:
            return None
        named = [n for n in fingers if any("thumb" in name.lower() for name in self.tree.names[n])]
        if named:
            return named[0]
        if len(fingers) < 4:
            return None
        ends = [self.tree.longest(node, wrist)[1][-1] for node in fingers]
        rays = [_unit(self.tree.rest[end] - self.tree.rest[wrist]) for end in ends]
        off = [float(np.dot(ray, np.mean(rays, axis=0))) for ray in rays]
        return fingers[int(np.argmin(off))]

    def _foot(self, side: str) -> None:
        leg = "lr".index(side)
        ankle, outer = self.legs.nodes[leg][2], self.legs.outer[leg]
        joint = self._turner(outer[0]) if outer else self._own(ankle)
        axes = self._foot_axes(joint, ankle, outer[-1]) if outer else self._neutral(joint)
        if axes is not None:
            for place in ("ball", "heel"):
                at = np.array(_TABLE[f"{place}_l"][1])
                self._on(f"{place}_{side}", ankle, joint, axes, at, self.size)
            return
        if not outer:
            return
        ball = float(np.linalg.norm(_TABLE["ball_l"][1]))
        self._towards(f"ball_{side}", ankle, outer[:1], ball)

    def _foot_axes(self, joint: int, ankle: int, toes: int) -> FloatArray | None:
        if joint not in self.axes:
            return None
        if self.zero is not None:
            rest = self.tree.rest[toes] - self.tree.rest[ankle]
            if abs(float(_cosines(rest, self.zero[:, 2]))) < FLAT:
                across = np.cross(self.zero[:, 2], rest)
                return axes_along(self.zero[:, 2], across)
        up = np.broadcast_to(self.turn[2], self._at(ankle).shape)
        ahead = self._at(toes) - self._at(ankle)
        low = np.argsort(self._at(ankle) @ self.turn[2] + self._at(toes) @ self.turn[2])
        low = low[: len(self.upright)]  # a foot is flat when it is on the floor
        if np.median(np.abs(_cosines(ahead, up))[low]) > FLAT:
            return None
        return self._upright_axes(joint, axes_along(up, np.cross(up, ahead)), low)

    # ---- all of it

    def _map(self) -> BodyMap:
        order = [place for place in _TABLE if place in self.rows]
        needed = sorted({point for row in self.rows.values() for point in row})
        column = {point: i for i, point in enumerate(needed)}
        weights = np.zeros((len(order), len(needed)))
        for k, place in enumerate(order):
            for point, weight in self.rows[place].items():
                weights[k, column[point]] = weight
        joint_names = self.skeleton.names
        used = {node for nodes in self.used.values() for node in nodes}
        left_out = [
            joint_names[joint]
            for node, joints in enumerate(self.tree.joints)
            if node not in used
            for joint in joints
        ]
        parts = tuple(
            (place, tuple(self.tree.names[node][0] for node in self.used[place])) for place in order
        )
        return BodyMap(
            points=tuple(self.all_names[point] for point in needed),
            places=tuple(order),
            weights=weights,
            turn=self.turn,
            factor=self.factor,
            parts=parts,
            left_out=tuple(left_out),
            stature_m=self.factor * self.stature_m,
            confidence=self._confidence(),
            warnings=tuple(self.warnings),
        )


def axes_along(up: FloatArray, across: FloatArray) -> FloatArray:
    """Return x ahead, y left, z up as columns for up and roughly left, (T, 3) to (T, 3, 3)."""
    up = _unit(up)
    across = _unit(across - (across * up).sum(axis=-1, keepdims=True) * up)
    return np.stack((np.cross(across, up), across, up), axis=-1)


def _exchanged(pair: LimbPair) -> LimbPair:
    return replace(pair, nodes=pair.nodes[::-1], inner=pair.inner[::-1], outer=pair.outer[::-1])


def _cosines(a: FloatArray, b: FloatArray) -> FloatArray:
    cosines: FloatArray = (_unit(a) * _unit(b)).sum(axis=-1)
    return cosines


def _unit(vectors: FloatArray) -> FloatArray:
    unit: FloatArray = vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-9)
    return unit
