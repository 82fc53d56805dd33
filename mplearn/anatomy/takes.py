"""Recordings of several takes, or of several dialects, as points of one body."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from ..body import find_marker_set
from ..body.marker_sets.marker_set import WATCHED_SHARE
from ..errors import BodyError, MPLearnError
from ..recording import Recording, marker_channels
from .body_map import BodyMap
from .bones import with_bones
from .facing import MirroredError
from .labels import names_skin, without_shared_ends
from .markers import recognise_markers
from .skeletons import recognise_skeleton


@dataclass(frozen=True, eq=False)
class Bodies:
    """Takes as points of one body.

    Attributes:
        recordings: Those in which a body was recognised. Takes of one marker set that have most
            points in common have the same channels: a point that one lacks is NaN there.
        maps: How each was recognised, by its name.
        marker_sets: Marker set of each, by its name: ``"landmarks"`` for skeletons.
        refused: Why not, by name, for the others.

    Example:
        >>> import numpy as np
        >>> from mplearn import Recording
        >>> from mplearn.anatomy import as_bodies
        >>> from mplearn.demonstrator import demonstrate
        >>> take = demonstrate(["BAR"], seed=1).recording
        >>> lamp = Recording(np.zeros((100, 3)), 100.0, ("lamp.x", "lamp.y", "lamp.z"), name="lamp")
        >>> bodies = as_bodies([take, lamp])
        >>> len(bodies.recordings), list(bodies.refused)
        (1, ['lamp'])
    """

    recordings: tuple[Recording, ...]
    maps: Mapping[str, BodyMap]
    marker_sets: Mapping[str, str]
    refused: Mapping[str, MPLearnError]


def recognise(recording: Recording, *, names: Mapping[str, str] | None = None) -> BodyMap:
    """Find the body in a recording of markers, or of joint positions with or without a skeleton.

    Args:
        recording: Markers [m], or joint positions, best with the joints' axes
            (`Hints.joint_axes`). Points without a skeleton that hang together by bones are joints,
            whatever their names are those of among markers; where these are no whole body, or do
            not hang together, names tell.
        names: Place of the body by point, for what is known better; "" leaves a point out.

    Raises:
        BodyError: There is no body in it, with the reason, and the option that would settle it.

    Example:
        >>> from mplearn.demonstrator import demonstrate
        >>> recording = demonstrate(["BAR"], seed=1).recording
        >>> body = recognise(recording)
        >>> body.places[:3], body.unseen
        (('LFHD', 'RFHD', 'LBHD'), ())
        >>> body.apply(recording).is_markers
        True
    """
    if recording.skeleton is not None and recording.is_markers:
        return recognise_skeleton(recording, names)
    on_skin = recording.is_markers and names_skin(without_shared_ends(recording.marker_names))
    hanging = None if names or on_skin else with_bones(recording)
    if hanging is None:
        return recognise_markers(recording, names)
    try:
        body = recognise_skeleton(hanging)
    except MirroredError:
        raise
    except BodyError:
        if (named := _by_names(recording)) is None:
            raise
        return named
    loose = tuple(n for n in recording.marker_names if n not in hanging.marker_names)
    body = replace(body, left_out=(*body.left_out, *loose))
    return body if _is_whole(body) else _by_names(recording) or body


def _by_names(recording: Recording) -> BodyMap | None:
    """Return the body that names tell, if it is a whole one."""
    try:
        body = recognise_markers(recording)
    except MirroredError:
        raise
    except BodyError:
        return None
    return body if _is_whole(body) else None


def _is_whole(body: BodyMap) -> bool:
    return {"thigh_l", "thigh_r", "upper_arm_l", "upper_arm_r"}.isdisjoint(body.unseen)


def as_bodies(
    recordings: Sequence[Recording],
    *,
    names: Mapping[str, str] | None = None,
    strict: bool = False,
) -> Bodies:
    """Recognise the body in each take, and join takes of like markers by the places of the body.

    A learner takes all of them, those of other sets too (`MotionLearner.begin_stream`).

    Args:
        recordings: Markers, or joint positions with their skeleton (`Hints.joint_axes`).
        names: Place of the body by point, for what is known better; see `recognise`.
        strict: Whether a take in which nobody is recognised is an error; otherwise it is refused as
            long as another one is recognised.

    Raises:
        BodyError: No take holds a body, or one does not and ``strict`` is set.

    Example:
        >>> from mplearn.demonstrator import demonstrate
        >>> take = demonstrate(["BAD", "BAU"], seed=1).recording
        >>> bodies = as_bodies([take])
        >>> len(bodies.recordings), len(bodies.refused)
        (1, 0)
    """
    maps: dict[str, BodyMap] = {}
    refused: dict[str, MPLearnError] = {}
    found: list[Recording] = []
    for recording in recordings:
        try:
            body = recognise(recording, names=names)
            found.append(body.apply(recording))
        except MPLearnError as error:
            if strict or len(recordings) == 1:
                raise
            refused[recording.name] = error
            continue
        maps[recording.name] = body
    if not found:
        first = next(iter(refused.values()))
        raise BodyError(f"no body in any of {len(recordings)} takes; the first: {first}")
    sets = {each.name: find_marker_set(each.marker_names).name for each in found}
    points = _joined([(sets[each.name], each.marker_names) for each in found])
    return Bodies(
        tuple(_with_points(each, names) for each, names in zip(found, points, strict=True)),
        MappingProxyType(maps),
        MappingProxyType(sets),
        MappingProxyType(refused),
    )


def _joined(takes: Sequence[tuple[str, tuple[str, ...]]]) -> list[tuple[str, ...]]:
    """Return for each take, of a marker set and with points of it, with which points it is learned.

    Takes join, those of the most usual points first, as long as each of them has most of all points
    that they have together: whoever lacks more of them could not be measured.
    """
    groups: dict[str, list[list[tuple[str, ...]]]] = {}  # of points of takes, by marker set
    for (of_set, names), _ in Counter(takes).most_common():
        of_same = groups.setdefault(of_set, [])
        for group in of_same:
            least = min(len(each) for each in (*group, names))
            if least >= WATCHED_SHARE * len(set(names).union(*group)):
                group.append(names)
                break
        else:
            of_same.append([names])
    joined = {
        (of_set, names): tuple(dict.fromkeys(name for each in group for name in each))
        for of_set, of_same in groups.items()
        for group in of_same
        for names in group
    }
    return [joined[take] for take in takes]


def _with_points(recording: Recording, names: tuple[str, ...]) -> Recording:
    """Return a take with these points in this order, NaN where it lacks one."""
    if recording.marker_names == names:
        return recording
    markers = np.full((len(recording), len(names), 3), np.nan)
    markers[:, [names.index(name) for name in recording.marker_names]] = recording.markers
    frames = markers.reshape(len(recording), -1)
    return replace(recording, frames=frames, channels=marker_channels(names))
