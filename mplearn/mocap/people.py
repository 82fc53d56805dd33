"""Recordings of several people at once, as a recording of each."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from itertools import product

from ..option_names import option
from ..recording import ReadReport, Recording, Skeleton, marker_channels
from .markers.names import WORD_MARKS, shared_start
from .placing.hanging import hanging, trees_of
from .skeletons.kinematics import AXIS_MARK

FEWEST_JOINTS = 12  # of a person's skeleton
FEWEST_MARKERS = 10  # that people have in common; clusters on limbs are smaller
LEAST_SIZE = 0.5  # of the largest tree of joints: hands and props are smaller
_SIDE = re.compile(r"left|right|lft|rgt|links|rechts|^[lr](?=[A-Z_ ]|$)", re.IGNORECASE)
_LOOK = 100  # frames


def each_person(recording: Recording) -> tuple[Recording, ...]:
    """Return a recording of each person in a recording of points; that itself where there is one.

    People are told apart by the prefix of their markers, as in ``Anna:LASI`` and ``Ben:LASI``, or
    by their skeletons' trees of joints. Each recording's `person` is that prefix, or the name of
    the tree's root; its name is the take's with it.

    Args:
        recording: Markers, or joint positions with their skeleton [m].

    Example:
        >>> import numpy as np
        >>> names = tuple(f"{who}:M{k}" for who in ("Anna", "Ben") for k in range(12))
        >>> both = Recording(np.zeros((5, 72)), 50.0, marker_channels(names), "duet")
        >>> [(each.name, each.person, len(each.marker_names)) for each in each_person(both)]
        [('duet (Anna)', 'Anna', 12), ('duet (Ben)', 'Ben', 12)]
    """
    if not recording.is_markers:
        return (recording,)
    found = _by_prefix(recording) if recording.skeleton is None else _by_tree(recording)
    if len(found) < 2:
        return (recording,)
    names = recording.marker_names
    others = sorted(set(range(len(names))) - {k for points in found.values() for k in points})
    note = (
        f"{len(found)} people: {', '.join(found)}; each is a take of its own "
        f"({option('person')} picks one)"
    )
    report = recording.report or ReadReport("", recording.rate_hz)
    report = replace(
        report,
        notes=(*report.notes, note),
        left_out=(*report.left_out, *(names[k] for k in others)),
    )
    return tuple(
        replace(_of_points(recording, who, points), report=report) for who, points in found.items()
    )


def _by_prefix(recording: Recording) -> Mapping[str, list[int]]:
    """Return the markers of each person, by prefix, if several have markers of the same names."""
    names = recording.marker_names
    shared = shared_start(names)  # body_0_nose, body_1_nose
    for separator, cut in product(WORD_MARKS, (str.partition, str.rpartition)):
        groups: dict[str, dict[str, int]] = {}
        for k, name in enumerate(names):
            prefix, found, rest = cut(name.removeprefix(shared), separator)
            if found:
                groups.setdefault(shared + prefix, {})[rest.lower()] = k
        largest = max((len(group) for group in groups.values()), default=0)
        people = {
            prefix: list(group.values())
            for prefix, group in groups.items()
            if len(group) > largest / 2
            and any(
                len(group.keys() & other.keys()) >= max(FEWEST_MARKERS, largest / 2)
                for key, other in groups.items()
                if key != prefix
            )
        }
        if len({_SIDE.sub("", prefix) for prefix in people}) > 1:  # hands are no people
            return people
    return {}


def _by_tree(recording: Recording) -> Mapping[str, list[int]]:
    """Return the joints of each tree that can be a person's, by the name of its root."""
    skeleton = recording.skeleton
    assert skeleton is not None
    some = recording.markers[:: max(1, len(recording) // _LOOK)]
    parents, lengths = hanging(some, skeleton.parents)
    trees = trees_of(parents)
    real = {root: [k for k in tree if not _shows_axes(skeleton, k)] for root, tree in trees.items()}
    sizes = {
        root: float(lengths[tree].sum())
        for root, tree in real.items()
        if len(tree) >= FEWEST_JOINTS
    }
    largest = max(sizes.values(), default=0.0)
    chosen = [root for root, size in sizes.items() if size > LEAST_SIZE * largest]
    roots_of = [skeleton.names[root] for root in chosen]
    prefixes = [name.rpartition(":")[0] for name in roots_of]  # Anna:Pelvis, Ben:Pelvis
    if all(prefixes) and len(set(prefixes)) == len(prefixes):
        roots_of = prefixes
    return {name: trees[root] for name, root in zip(roots_of, chosen, strict=True)}


def _shows_axes(skeleton: Skeleton, joint: int) -> bool:
    return skeleton.names[joint].endswith(tuple(f"{AXIS_MARK}{axis}" for axis in "xyz"))


def _of_points(recording: Recording, who: str, points: list[int]) -> Recording:
    """Return the recording of some points, in their order."""
    markers = recording.markers[:, points]
    names = tuple(recording.marker_names[k] for k in points)
    skeleton = recording.skeleton
    if skeleton is not None:
        at = {old: new for new, old in enumerate(points)}
        skeleton = Skeleton(
            names,
            tuple(at.get(skeleton.parents[k], -1) for k in points),
            skeleton.offsets[points],
            tuple(skeleton.ends[k] for k in points),
        )
    return replace(
        recording,
        frames=markers.reshape(len(markers), -1),
        channels=marker_channels(names),
        name=f"{recording.name} ({who})",
        person=who,
        skeleton=skeleton,
    )
