"""Marker sets: which markers sit where on a body, and which set a recording's names belong to.

A set is data: marker name -> (body, offset in that body's frame on the reference human of 1.75 m).
On any other body the offset is stretched with the segment, so that every set works on the human of
every size and on the robot. Where a body has no such segment (the robot has no clavicles and no
abdomen), the marker goes to the segment that carries it there.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np

from mplearn.errors import BodyError
from mplearn.maths.read_only import read_only
from mplearn.recording import BoolArray, FloatArray, IntArray

from ..kinematics.tree import KinematicTree
from ..models.human import human_body
from .tables import TABLES

CARRIER = {"abdomen": "pelvis", "clavicle_l": "chest", "clavicle_r": "chest"}
LEAST_SHARE = 0.6  # of a recording's markers that a set must know to be taken for it,
LEAST_OF_SET = 0.75  # or of the set's own that must be among them
WATCHED_SHARE = 2 / 3  # of the markers that an observer watches, that a stream must have


@dataclass(frozen=True, eq=False)
class MarkerSet:
    """Where markers sit on a person.

    Attributes:
        name: Name of the set.
        names: Names of the M markers.
        bodies: Name of the body that carries each, length M.
        offsets: Positions in that body's frame on the reference human, shape (M, 3) [m].

    Example:
        >>> from mplearn.body import marker_set
        >>> known = marker_set("plug_in_gait39")
        >>> known.knows(["Subject:LSHO", "lamp"])  # whoever the subject is
        (True, False)
    """

    name: str
    names: tuple[str, ...]
    bodies: tuple[str, ...]
    offsets: FloatArray

    def select(self, marker_names: Sequence[str]) -> MarkerSet:
        """Return the set in the order of a recording's own names.

        Raises:
            BodyError: A name is not in this set.
        """
        index = {plain_name(name): i for i, name in enumerate(self.names)}
        rows = [index.get(plain_name(name), -1) for name in marker_names]
        missing = [name for name, i in zip(marker_names, rows, strict=True) if i < 0]
        if missing:
            raise BodyError(
                f"marker set {self.name!r} has no markers {missing}; it has {', '.join(self.names)}"
            )
        return MarkerSet(
            name=self.name,
            names=tuple(marker_names),
            bodies=tuple(self.bodies[i] for i in rows),
            offsets=self.offsets[rows],
        )

    def knows(self, marker_names: Sequence[str]) -> tuple[bool, ...]:
        """Return, for each name of a recording, whether it is in this set."""
        known = {plain_name(name) for name in self.names}
        return tuple(plain_name(name) in known for name in marker_names)

    def at_joints(self) -> BoolArray:
        """Return which markers lie at the joint of two segments of a limb, shape (M,)."""
        tree = human_body().tree
        joints = {
            (tree.body_names[tree.parent[child]], *np.round(tree.offset[child], 6))
            for child, name in enumerate(tree.body_names)
            if tree.parent[child] >= 0 and name != "head"  # necks begin at many places
        }
        at = [
            (body, *np.round(offset, 6)) in joints
            for body, offset in zip(self.bodies, self.offsets, strict=True)
        ]
        return np.array(at, dtype=np.bool_)

    def attach(
        self, tree: KinematicTree, reference: KinematicTree | None = None
    ) -> tuple[IntArray, FloatArray]:
        """Put the markers on a body.

        Args:
            tree: The body.
            reference: Where the offsets were measured; the human of 1.75 m where not given.

        Returns:
            Index of each marker's body, shape (M,), and offsets there, shape (M, 3) [m].

        Raises:
            BodyError: The body lacks a segment that carries markers.
        """
        reference = reference or human_body().tree
        factors = segment_factors(tree, reference)
        bodies, offsets = [], []
        for carrier, offset in zip(self.bodies, self.offsets, strict=True):
            name, at = carrier, offset
            while name not in tree.body_names and name in CARRIER:
                at = at + reference.offset[reference.body(name)]
                name = CARRIER[name]
            bodies.append(tree.body(name))
            offsets.append(at * factors[bodies[-1]])
        return np.array(bodies, dtype=np.int64), np.array(offsets)


def segment_factors(tree: KinematicTree, reference: KinematicTree) -> FloatArray:
    """Return how much larger each body is than the reference human's, shape (B, 3).

    Along a limb it is the ratio of the segment lengths, elsewhere the ratio of the hips' heights.
    """
    factors = np.full_like(tree.offset, tree.offset[0, 2] / reference.offset[0, 2])
    for child, name in enumerate(tree.body_names):
        parent = tree.parent[child]
        if parent < 0 or name not in reference.body_names:
            continue
        same = reference.body(name)
        if reference.body_names[reference.parent[same]] != tree.body_names[parent]:
            continue
        length = abs(reference.offset[same, 2])
        if length > 0.05:
            factors[parent, 2] = abs(tree.offset[child, 2]) / length
    return factors


def plain_name(name: str) -> str:
    """Return a name without its subject's prefix, in capitals: ``Male:lfhd`` -> ``LFHD``."""
    return name.rsplit(":", 1)[-1].strip().upper()


@cache
def marker_set(name: str) -> MarkerSet:
    """Return a marker set by name.

    Raises:
        BodyError: There is none of that name.

    Example:
        >>> len(marker_set("plug_in_gait39").names)
        39
    """
    if name not in TABLES:
        raise BodyError(f"no marker set {name!r}; there are {', '.join(TABLES)}")
    table = TABLES[name]
    return MarkerSet(
        name=name,
        names=tuple(table),
        bodies=tuple(body for body, _ in table.values()),
        offsets=read_only(np.array([offset for _, offset in table.values()])),
    )


def find_marker_set(marker_names: Sequence[str]) -> MarkerSet:
    """Return the set that a recording's markers belong to, found by their names.

    Prefixes up to a colon and case do not matter. The set that knows the most of the names wins,
    the smaller one in a tie; names that it does not know are the caller's to drop
    (`MarkerSet.knows`).

    Raises:
        BodyError: A name occurs twice, or no set knows enough of the names.

    Example:
        >>> names = "LFHD RFHD C7 T10 CLAV STRN LSHO LELB RSHO RELB LASI RASI".split()
        >>> found = find_marker_set([f"Anna:{name}" for name in names])
        >>> found.knows(["LASI", "bottle"])
        (True, False)
    """
    plain = [plain_name(name) for name in marker_names]
    twice = sorted({name for name in plain if plain.count(name) > 1})
    if twice:
        raise BodyError(f"the markers {twice} occur more than once")
    known = {name: sum(marker_set(name).knows(plain)) for name in TABLES}
    best = max(TABLES, key=lambda name: (known[name], -len(TABLES[name])))
    enough = max(min(LEAST_SHARE * len(plain), LEAST_OF_SET * len(TABLES[best])), 6)
    if known[best] < enough:
        raise BodyError(
            f"no marker set knows the markers {list(marker_names)[:6]}...: {best!r} comes closest "
            f"with {known[best]} of {len(plain)}, and {math.ceil(enough)} are needed; there are "
            f"{', '.join(TABLES)}, and mplearn.anatomy.recognise finds the body in recordings "
            "with other names"
        )
    return marker_set(best)
