"""MVNX: the XML of Xsens MVN, segments of a person from inertial sensors [MVNX].

Positions and orientations of the segments are the world's, z up; a segment's origin is the joint
towards the pelvis, and in a T pose all its axes are the world's. Which of them a file holds is
chosen when it is exported:

* both: joint angles or positions; orientations alone: the same, but the pelvis stays where it is;
* positions alone: positions; joint angles alone: angles.

Of several subjects all are read, side by side, their names before those of the segments; each is a
take of its own (`each_person`).
"""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np

from ...maths.rotations import quaternion_to_matrix
from ...option_names import option
from ...recording import FloatArray, Recording, Skeleton, marker_channels
from ..files import bad_file, read_text, stem
from ..findings import Findings
from ..placing.space import Space, placed
from ..reader import Hints, Reader
from .mvnx_file import SAME_RATE, MVNXFile, read_mvnx
from .skeletal import Limbs, SkeletalMotion, limb_order, skeletal_recording

_SPACE = Space(1.0, "z", "x", says_up=True)
_LOOSE_M = 0.01  # bones that vary more are no bones
_SHORTEST_END_M = 0.01
_USUAL_PARENTS = dict(
    entry.split("<")
    for entry in (
        "L5<Pelvis L3<L5 T12<L3 T8<T12 Neck<T8 Head<Neck "
        + " ".join(
            f"{s}Shoulder<T8 {s}UpperArm<{s}Shoulder {s}ForeArm<{s}UpperArm {s}Hand<{s}ForeArm "
            f"{s}UpperLeg<Pelvis {s}LowerLeg<{s}UpperLeg {s}Foot<{s}LowerLeg {s}Toe<{s}Foot"
            for s in ("Right", "Left")
        )
    ).split()
)


class MVNXReader(Reader):
    """Reads MVNX files, versions 2 to 4: see the module's docstring for what they may hold."""

    format = "MVNX"
    suffixes = (".mvnx",)
    begins = ("<MVNX",)

    def read(self, path: Path, hints: Hints, *, positions: bool) -> Recording:
        """Read angles, or where the segments' origins and ends are; see `Reader.read`."""
        findings = Findings(self.format)
        files = read_mvnx(path, read_text(path), findings)
        people = [_subject(path, file, hints, findings, positions=positions) for file in files]
        return people[0] if len(people) == 1 else _side_by_side(path, people, findings)


def _subject(
    path: Path, file: MVNXFile, hints: Hints, findings: Findings, *, positions: bool
) -> Recording:
    """Return the recording of one subject."""
    rate_hz = hints.rate_hz or file.rate_hz
    if rate_hz is None:
        raise bad_file(path, "no frameRate", f"one, or {option('rate_hz')}")
    if file.orientations is not None:
        motion = _motion(file, rate_hz, findings)
        recording = skeletal_recording(path, motion, hints, findings, positions=positions)
    elif positions and file.positions is not None:
        recording = _points(path, file, file.positions, rate_hz, hints, findings)
    elif not positions and file.joint_angles is not None:
        recording = _angles(file, file.joint_angles, rate_hz, findings)
    else:
        what = "positions or orientations" if positions else "orientations or joint angles"
        raise bad_file(path, f"it holds no {what} of segments", "an export with them")
    return replace(recording, name=stem(path), person=file.subject)


def _side_by_side(path: Path, people: list[Recording], findings: Findings) -> Recording:
    """Return the recordings of several subjects as one, the subjects' names before all others."""
    rates = {each.rate_hz for each in people}
    if max(rates) > (1.0 + SAME_RATE) * min(rates):
        raise bad_file(
            path, f"subjects at {', '.join(f'{rate:g}' for rate in sorted(rates))} Hz", "one rate"
        )
    said = [each.person.replace(":", " ") or f"subject{k}" for k, each in enumerate(people)]
    names = [f"{name}_{k}" if said.count(name) > 1 else name for k, name in enumerate(said)]
    if len(set(names)) < len(names):  # Anna_1 is there beside two called Anna
        names = [f"{name}_{k}" for k, name in enumerate(said)]
    frames = np.full((max(map(len, people)), sum(len(each.channels) for each in people)), np.nan)
    at = 0
    for each in people:
        frames[: len(each), at : at + len(each.channels)] = each.frames
        at += len(each.channels)
    if len(set(map(len, people))) > 1:
        findings.warn("the subjects have other numbers of frames: missing at the end")
    first = people[0].report
    assert first is not None
    return replace(
        people[0],
        frames=frames,
        channels=tuple(
            f"{name}:{channel}"
            for name, each in zip(names, people, strict=True)
            for channel in each.channels
        ),
        person="",
        skeleton=_of_all(names, people),
        report=findings.report(people[0].rate_hz, first.unit_m, first.up),
    )


def _of_all(names: list[str], people: list[Recording]) -> Skeleton | None:
    """Return one skeleton with the trees of all subjects; None where they have none."""
    trees = [each.skeleton for each in people if each.skeleton is not None]
    if len(trees) < len(people):
        return None
    starts = np.cumsum([0, *(len(tree.names) for tree in trees)])
    return Skeleton(
        tuple(f"{name}:{j}" for name, tree in zip(names, trees, strict=True) for j in tree.names),
        tuple(
            parent + int(start) if parent >= 0 else -1
            for tree, start in zip(trees, starts, strict=False)
            for parent in tree.parents
        ),
        np.concatenate([tree.offsets for tree in trees]),
        tuple(end for tree in trees for end in tree.ends),
    )


def _usual_parents(segments: list[str]) -> dict[str, str]:
    """Return the parents that segments have in MVN's skeleton, however their names are spelled."""
    named = {_letters(segment): segment for segment in segments}
    usual = ((_letters(child), _letters(parent)) for child, parent in _USUAL_PARENTS.items())
    return {named[child]: named[parent] for child, parent in usual if {child, parent} <= set(named)}


def _letters(name: str) -> str:
    return re.sub(r"[^a-z0-9]", "", name.lower())


def _tree(file: MVNXFile, findings: Findings) -> tuple[list[int], list[int]]:
    """Return the segments that hang on the first one, parents first, and each one's parent."""
    said = {child: parent for _, parent, _, child, _ in file.joints}
    parent_of = _usual_parents(file.segments) | said
    order, place = [0], {file.segments[0]: 0}
    parents = [-1]
    waiting = list(range(1, len(file.segments)))
    while True:
        hanging = [i for i in waiting if parent_of.get(file.segments[i]) in place]
        if not hanging:
            break
        for index in hanging:
            parents.append(place[parent_of[file.segments[index]]])
            place.setdefault(file.segments[index], len(order))
            order.append(index)
        waiting = [i for i in waiting if i not in set(hanging)]
    findings.leave_out(file.segments[i] for i in waiting)
    return order, parents


def _offsets(file: MVNXFile, order: list[int], parents: list[int]) -> FloatArray:
    """Return where each segment's origin is in its parent, as the file says, shape (S, 3) [m]."""
    at = {child: file.points.get((parent, point)) for _, parent, point, child, _ in file.joints}
    offsets = np.zeros((len(order), 3))
    for index, segment in enumerate(order):
        said = at.get(file.segments[segment])
        if parents[index] >= 0 and said is not None:
            offsets[index] = said
        elif parents[index] >= 0 and file.t_pose is not None:
            offsets[index] = file.t_pose[segment] - file.t_pose[order[parents[index]]]
    return offsets


def _motion(file: MVNXFile, rate_hz: float, findings: Findings) -> SkeletalMotion:
    order, parents = _tree(file, findings)
    assert file.orientations is not None
    moving = [i for i, parent in enumerate(parents) if parent >= 0]
    above = [parents[i] for i in moving]
    world = _turns(file, order, moving, above, findings)
    local = world.copy()
    local[:, moving] = world[:, above].swapaxes(-1, -2) @ world[:, moving]
    offsets = _offsets(file, order, parents)
    if file.positions is None:
        places = np.zeros((len(world), 3))
        places[:, 2] = -_lowest(offsets, parents)
        findings.warn("there are no positions: the pelvis is taken to stay where it is")
    else:
        points = file.positions[:, order]
        places = points[:, 0]
        bones, loose = _bones(points, world, moving, above)
        if len(loose):
            offsets[moving] = bones
            if loose.max() > _LOOSE_M:
                name = file.segments[order[moving[int(loose.argmax())]]]
                findings.warn(
                    f"{name} moves {loose.max():.3f} m in its parent: taken at its median"
                )
    names = [file.segments[i] for i in order]
    orders = [limb_order(name, is_root=i == 0) for i, name in enumerate(names)]
    for index in sorted(set(range(len(order))) - set(parents)):
        ends = [place for (segment, _), place in file.points.items() if segment == names[index]]
        end = max(ends, key=lambda place: float(np.linalg.norm(place)), default=np.zeros(3))
        if np.linalg.norm(end) > _SHORTEST_END_M:
            names.append(f"{names[index]}_end")
            parents.append(index)
            orders.append("")
            offsets = np.concatenate([offsets, end[None]])
    limbs = Limbs(tuple(names), tuple(parents), offsets, tuple(orders))
    return limbs.motion(local, places, rate_hz, _SPACE)


def _turns(
    file: MVNXFile, order: list[int], moving: list[int], above: list[int], findings: Findings
) -> FloatArray:
    """Return how the segments are turned, shape (T, S, 3, 3).

    Quaternions begin with w; where bones are rigid only if they end with it, they do.
    """
    assert file.orientations is not None
    quaternions = file.orientations[:, order]
    sizes = np.linalg.norm(quaternions, axis=2)
    quaternions = np.where(sizes[..., None] > 0.5, quaternions, np.nan)
    world = quaternion_to_matrix(quaternions)
    if file.positions is None:
        return world
    points = file.positions[:, order]
    _, loose = _bones(points, world, moving, above)
    if not len(loose) or np.median(loose) <= _LOOSE_M:
        return world
    ending = quaternion_to_matrix(quaternions[..., [3, 0, 1, 2]])
    _, less = _bones(points, ending, moving, above)
    if np.median(less) > _LOOSE_M:
        return world
    findings.warn("the quaternions are taken as x, y, z, w: else the bones are not rigid")
    return ending


def _bones(
    points: FloatArray, world: FloatArray, moving: list[int], above: list[int]
) -> tuple[FloatArray, FloatArray]:
    """Return where segments are in their parents, shape (B, 3), and how far they move there (B,).

    Both are empty where there are no bones, or they were never seen.
    """
    bones = points[:, moving] - points[:, above]
    in_parent = (world[:, above].swapaxes(-1, -2) @ bones[..., None])[..., 0]
    seen = ~np.isnan(in_parent).any(axis=(1, 2))
    if not seen.any() or not moving:
        return np.empty((0, 3)), np.empty(0)
    middle: FloatArray = np.median(in_parent[seen], axis=0)
    return middle, np.linalg.norm(in_parent[seen] - middle, axis=2).max(axis=0)


def _lowest(offsets: FloatArray, parents: list[int]) -> float:
    heights = np.zeros(len(parents))
    for index, parent in enumerate(parents):
        if parent >= 0:
            heights[index] = heights[parent] + offsets[index, 2]
    return float(heights.min())


def _points(
    path: Path,
    file: MVNXFile,
    points: FloatArray,
    rate_hz: float,
    hints: Hints,
    findings: Findings,
) -> Recording:
    order, parents = _tree(file, findings)
    names = tuple(file.segments[i] for i in order)
    place = placed(path, points[:, order], names, rate_hz, _SPACE, hints, findings)
    offsets = _offsets(file, order, parents) * place.unit_m @ place.axes.T
    return Recording(
        place.points.reshape(len(points), -1),
        rate_hz,
        marker_channels(names),
        skeleton=Skeleton(names, tuple(parents), offsets),
        report=findings.report(rate_hz, place.unit_m, place.up),
    )


def _angles(
    file: MVNXFile, angles_deg: FloatArray, rate_hz: float, findings: Findings
) -> Recording:
    frames = np.radians(angles_deg.reshape(len(angles_deg), -1))
    channels = tuple(f"{joint[0]}.r{axis}" for joint in file.joints for axis in "xyz")
    findings.note("joint angles as Xsens defines them: abduction, rotation, flexion")
    return Recording(frames, rate_hz, channels, report=findings.report(rate_hz))
