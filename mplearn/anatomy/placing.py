"""Places of the body set on a skeleton: each a weighted sum of its joints and their axes."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..body.marker_sets.tables import TABLES
from ..maths.rotation_kernels import nearest_rotation
from ..recording import FloatArray, IntArray, Skeleton
from .body_map import BodyMap
from .person import NECK_RISE, Person, axes_along, cosines, unit
from .plan import LimbPair

FLAT = 0.8  # cosine between a foot and the vertical up to which it stands on its sole
_TABLE = TABLES["landmarks"]
_LEG, _ARM = ("hip", "knee", "ankle"), ("shoulder", "elbow", "wrist")


class Placing:
    """Puts the places of the body on a person's skeleton.

    Args:
        person: The person.
        skeleton: Its skeleton, the points that show axes included.
        points: Where those are in some frames, shape (T, J, 3) [m].
        axes: The three points that show a joint's axes, by joint.
    """

    def __init__(
        self,
        person: Person,
        skeleton: Skeleton,
        points: FloatArray,
        axes: Mapping[int, tuple[int, int, int]],
    ) -> None:
        self.person, self.tree = person, person.tree
        self.skeleton, self.points, self.axes = skeleton, points, axes
        self.rows: dict[str, dict[int, float]] = {}
        self.used: dict[str, tuple[int, ...]] = {}  # nodes that a place was made of

    def map(self, told: Mapping[str, str]) -> BodyMap:
        """Return the map; what a user says of joints overrules what was found."""
        person = self.person
        for pair, names in ((person.legs, _LEG), (person.arms, _ARM)):
            if pair is not None:
                self._limbs(pair, names)
        if person.legs is not None:
            self._pelvis(person.legs)
        if person.arms is not None:
            self._chest(person.arms)
            self._head(person.arms)
        for k, side in enumerate("lr"):
            if person.arms is not None:
                self._hand(side, *person.arms.nodes[k][1:])
            if person.legs is not None:
                self._foot(side, person.legs.nodes[k][2], person.legs.outer[k])
        self._as_told(told)
        return self._gathered()

    # ---- how bones are turned

    def _neutral(self, joint: int) -> FloatArray | None:
        """Return the upright body's axes on a bone, as its zero pose has them, as columns.

        None where the recording does not show how the joint is turned.
        """
        if joint not in self.axes:
            return None
        zero: FloatArray | None = self.person.zero
        if zero is not None:
            return zero
        return self._upright_axes(joint, self.person.trunk, self.person.upright)

    def _upright_axes(self, joint: int, wanted: FloatArray, frames: IntArray) -> FloatArray:
        """Return the axes on a bone that are the wanted ones, (T, 3, 3), in some of the frames."""
        arms = self.points[:, list(self.axes[joint])] - self.points[:, [joint]]  # rows: its axes
        turned = np.einsum("tki,kj->tij", arms, np.linalg.inv(self._shown(joint)).T)
        total = np.einsum("tji,tjk->ik", turned[frames], wanted[frames])
        return np.asarray(nearest_rotation(total))

    def _shown(self, joint: int) -> FloatArray:
        """Return the points that show a joint's axes, in the zero pose, rows, (3, 3)."""
        shown: FloatArray = self.skeleton.offsets[list(self.axes[joint])]
        return shown

    # ---- ways to make a place

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
        length = float(np.median(np.linalg.norm(middle - self.person.at(node), axis=1)))
        share = float(far * self.person.size / length)
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

    def _limbs(self, pair: LimbPair, names: tuple[str, ...]) -> None:
        for side, nodes in zip("lr", pair.nodes, strict=True):
            for name, node in zip(names, nodes, strict=True):
                if name == "hip" and pair.one_root:
                    self._joint("pelvis", node)
                else:
                    self._joint(f"{name}_{side}", node)

    def _pelvis(self, legs: LimbPair) -> None:
        joint = self._turner((*legs.inner[0], *legs.nodes[0])[0])
        axes = self._neutral(joint)
        if axes is not None:
            for place in ("pelvis_front", "pelvis_back", "lumbar"):
                self._on_middle_of_hips(legs, place, joint, axes)
        elif len(self.person.spine) > 2:
            self._lumbar_on_spine(legs)

    def _chest(self, arms: LimbPair) -> None:
        joint = self._turner((*arms.inner[0], *arms.nodes[0])[0])
        axes, raised = self._neutral(joint), self.person.raised
        if axes is None and raised.any() and self.person.legs is not None:
            self._neck_above(arms, self.person.legs)
        elif axes is None or not raised.any():
            self._joint("neck", self.person.neck)
        if axes is None:
            return
        for place in ("sternum", "back", "chest_l", "chest_r", "neck")[: 5 if raised.any() else 4]:
            at = np.array(_TABLE[place][1]) - _TABLE["neck"][1]
            at = raised + self.person.trunk_sizes * at
            self._on(place, self.person.neck, joint, axes, at, 1.0)

    def _neck_above(self, arms: LimbPair, legs: LimbPair) -> None:
        """Put the base of the neck above the shoulders: on the way from the hips to them."""
        trunk = self.person.middle(arms, 0) - self.person.middle(legs, 0)
        length = float(np.median(np.linalg.norm(trunk, axis=1)))
        share = NECK_RISE * self.person.size / length
        self.rows["neck"] = {
            self.tree.joints[side[0]][0]: weight
            for pair, weight in ((arms, 0.5 * (1.0 + share)), (legs, -0.5 * share))
            for side in pair.nodes
        }
        self.used["neck"] = tuple(side[0] for side in arms.nodes)

    def _on_middle_of_hips(self, legs: LimbPair, place: str, joint: int, axes: FloatArray) -> None:
        left, right = (side[0] for side in legs.nodes)
        self._on(place, left, joint, axes, np.array(_TABLE[place][1]), self.person.trunk_sizes)
        row = self.rows[place]
        for node in (left, right):
            first = self.tree.joints[node][0]
            row[first] = row.get(first, 0.0) + (-0.5 if node == left else 0.5)

    def _lumbar_on_spine(self, legs: LimbPair) -> None:
        """Without the pelvis' axes: the lumbar joint lies towards the first joint of the spine."""
        left, right = (side[0] for side in legs.nodes)
        middle = self.person.middle(legs, 0)
        for node in self.person.spine[:-1]:
            length = float(np.median(np.linalg.norm(self.person.at(node) - middle, axis=1)))
            if length > 0.04 * self.person.size:
                share = float(_TABLE["lumbar"][1][2] * self.person.size / length)
                first = self.tree.joints
                row = {first[left][0]: 0.5 * (1 - share), first[right][0]: 0.5 * (1 - share)}
                row[first[node][0]] = share
                self.rows["lumbar"], self.used["lumbar"] = row, (node,)
                return

    def _head(self, arms: LimbPair) -> None:
        way = (arms.root, *self.person.head)
        after = way[way.index(self.person.neck) + 1 :]
        if not after and self.person.neck == arms.root:
            return
        far = [self.tree.length(self.person.neck, node) for node in after]
        rise = _TABLE["skull"][1][2]
        off = [abs(length - rise * self.person.size) for length in (0.0, *far)]
        skull = (self.person.neck, *after)[int(np.argmin(off))]
        if skull != self.person.neck:
            self._joint("skull", skull)
        beyond = (self.person.neck, *after)[int(np.argmin(off)) + 1 :]
        joint = self._turner(beyond[0]) if beyond else self._own(skull)
        axes = self._neutral(joint)
        origin = _TABLE["skull"][1] if skull != self.person.neck else (0.0, 0.0, 0.0)
        if axes is not None:
            for place in ("face", "ear_l", "ear_r", "crown"):
                at = np.array(_TABLE[place][1]) - origin
                self._on(place, skull, joint, axes, at, self.person.size)
        elif beyond and self._is_crown(skull, beyond[-1]):
            self._towards("crown", skull, beyond[-1:], _TABLE["crown"][1][2] - origin[2])

    def _is_crown(self, skull: int, end: int) -> bool:
        way = self.person.at(end) - self.person.at(skull)
        return bool(np.median(cosines(way, self.person.trunk[:, :, 2])[self.person.upright]) > 0.8)

    def _hand(self, side: str, elbow: int, wrist: int) -> None:
        toward = self.tree.way(elbow, wrist)[-2]
        fingers = [node for node in self.tree.edges[wrist] if node != toward]
        if not fingers:
            self._stiff_hand(side, elbow, wrist)
            return
        thumb = self._thumb(wrist, fingers)
        knuckles = tuple(self._knuckle(wrist, node) for node in fingers if node != thumb)
        self._towards(f"hand_{side}", wrist, knuckles, -_TABLE["hand_l"][1][2])
        if thumb is None:
            return
        # across the knuckles, from the one farthest from the thumb to the nearest
        apart = [self.tree.length(thumb, node) for node in knuckles]
        near, far = knuckles[int(np.argmin(apart))], knuckles[int(np.argmax(apart))]
        wide = self.tree.length(near, far)
        if len(knuckles) > 1 and wide > 0.02 * self.person.size:
            share = float(_TABLE["thumb_side_l"][1][0] * self.person.size / wide)
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
            way = unit(self.tree.rest[wrist] - self.tree.rest[elbow])
            length = -_TABLE["hand_l"][1][2]
            self._on(f"hand_{side}", wrist, joint, np.eye(3), length * way, self.person.size)

    def _knuckle(self, wrist: int, finger: int) -> int:
        """Return a finger's knuckle: its first joint, or its second behind one of the palm."""
        after = self.tree.longest(finger, wrist)[1][1:2]
        far = -_TABLE["hand_l"][1][2] * self.person.size
        return min((finger, *after), key=lambda node: abs(self.tree.length(wrist, node) - far))

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
        rays = [unit(self.tree.rest[end] - self.tree.rest[wrist]) for end in ends]
        off = [float(np.dot(ray, np.mean(rays, axis=0))) for ray in rays]
        return fingers[int(np.argmin(off))]

    def _foot(self, side: str, ankle: int, outer: tuple[int, ...]) -> None:
        joint = self._turner(outer[0]) if outer else self._own(ankle)
        axes = self._foot_axes(joint, ankle, outer[-1]) if outer else self._neutral(joint)
        if axes is not None:
            for place in ("ball", "heel"):
                at = np.array(_TABLE[f"{place}_l"][1])
                self._on(f"{place}_{side}", ankle, joint, axes, at, self.person.size)
            return
        if not outer:
            return
        ball = float(np.linalg.norm(_TABLE["ball_l"][1]))
        self._towards(f"ball_{side}", ankle, outer[:1], ball)

    def _foot_axes(self, joint: int, ankle: int, toes: int) -> FloatArray | None:
        if joint not in self.axes:
            return None
        if self.person.zero is not None:
            rest = self.tree.rest[toes] - self.tree.rest[ankle]
            if abs(float(cosines(rest, self.person.zero[:, 2]))) < FLAT:
                across = np.cross(self.person.zero[:, 2], rest)
                return axes_along(self.person.zero[:, 2], across)
        up = np.broadcast_to(self.person.turn[2], self.person.at(ankle).shape)
        ahead = self.person.at(toes) - self.person.at(ankle)
        low = np.argsort(
            self.person.at(ankle) @ self.person.turn[2] + self.person.at(toes) @ self.person.turn[2]
        )
        low = low[: len(self.person.upright)]  # a foot is flat when it is on the floor
        if np.median(np.abs(cosines(ahead, up))[low]) > FLAT:
            return None
        return self._upright_axes(joint, axes_along(up, np.cross(up, ahead)), low)

    def _as_told(self, told: Mapping[str, str]) -> None:
        """Put places where a user says they are, and leave out what is to be left out."""
        for name, place in told.items():
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

    def _gathered(self) -> BodyMap:
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
            points=tuple(self.skeleton.names[point] for point in needed),
            places=tuple(order),
            weights=weights,
            turn=self.person.turn,
            factor=self.person.factor,
            parts=parts,
            left_out=tuple(left_out),
            stature_m=self.person.factor * self.person.stature_m,
            confidence=self.person.confidence,
            warnings=tuple(self.person.warnings),
        )
