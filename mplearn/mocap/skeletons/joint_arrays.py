"""Arrays of joints' places, ``.npy`` or ``.npz``, as pose estimators and data sets have them.

Such an array holds no names: how many joints there are tells which they may be, and of several
layouts the one whose bones keep their lengths, and are as long on both sides. Hands, face and what
else comes behind the body's joints are left out. Of several people all are read, each of whom
becomes a take (`each_person`). Features of motion (HumanML3D) become joints again.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ...errors import RecordingError
from ...option_names import option
from ...recording import FloatArray, Recording
from ..files import bad_file, suffix
from ..findings import Findings
from ..markers.columns import MEDIAPIPE_POSE
from ..markers.pictures import hold_scores, warn_of_pictures
from ..numbers import without_unseen
from ..placing.placed_markers import placed_markers
from ..placing.space import Space
from ..rates import rate_beside
from ..reader import Hints, Reader
from .motion_features import RATES_HZ, joints_of_features
from .npz_file import NPZFile, finite, npy_shape, read_npy
from .smpl import BODY_JOINTS, MOTION_X, POSES, ROOTS

_FACE = "nose left_eye right_eye left_ear right_ear"
_FEET = "left_big_toe left_small_toe left_heel right_big_toe right_small_toe right_heel"


def _both(*joints: str) -> str:
    return " ".join(f"{side}_{joint}" for joint in joints for side in ("left", "right"))


def _chain(side: str, *joints: str) -> str:
    return " ".join(f"{side}_{joint}" for joint in joints)


_ARM, _LEG = ("shoulder", "elbow", "wrist"), ("hip", "knee", "ankle")
_HAND = ("clavicle", *_ARM, "hand", "handtip", "thumb")
_ARM_OF_XSENS = ("collar", *_ARM)
_COCO = f"{_FACE} {_both(*_ARM, *_LEG)}"
_OPENPOSE_BODY = f"nose neck {_chain('right', *_ARM)} {_chain('left', *_ARM)}"
_UP = ("ankle", "knee", "hip")
_NO = "-"  # a joint that nobody needs: a copy of another, the end of a thumb
LAYOUTS = {
    "COCO": _COCO,
    "Human3.6M": (
        f"mid_hip {_chain('right', *_LEG)} {_chain('left', *_LEG)} spine thorax nose head "
        f"{_chain('left', *_ARM)} {_chain('right', *_ARM)}"
    ),
    "SMPL": " ".join(BODY_JOINTS),
    "OpenPose": (
        f"{_OPENPOSE_BODY} mid_hip "
        f"{_chain('right', *_LEG)} {_chain('left', *_LEG)} right_eye left_eye right_ear left_ear "
        f"{_FEET}"
    ),
    "Kinect": (
        f"spine_base spine_mid neck head {_chain('left', *_ARM, 'hand')} "
        f"{_chain('right', *_ARM, 'hand')} {_chain('left', *_LEG, 'foot')} "
        f"{_chain('right', *_LEG, 'foot')} spine_shoulder {_chain('left', 'handtip', 'thumb')} "
        f"{_chain('right', 'handtip', 'thumb')}"
    ),
    "Halpe": f"{_COCO} head neck hip {_both('big_toe', 'small_toe', 'heel')}",
    "Azure Kinect": (
        f"pelvis spine_navel spine_chest neck {_chain('left', *_HAND)} {_chain('right', *_HAND)} "
        f"{_chain('left', *_LEG, 'foot')} {_chain('right', *_LEG, 'foot')} head nose left_eye "
        "left_ear right_eye right_ear"
    ),
    "MediaPipe": " ".join(MEDIAPIPE_POSE),
    "COCO-WholeBody": f"{_COCO} {_FEET}",
    "Human3.6M in full": (
        f"mid_hip {_chain('right', *_LEG, 'foot')} {_NO} {_chain('left', *_LEG, 'foot')} {_NO} "
        f"{_NO} spine thorax nose head {_NO} {_chain('left', *_ARM)} {_NO} {_NO} {_NO} {_NO} "
        f"{_NO} {_chain('right', *_ARM)} {_NO} {_NO} {_NO} {_NO}"
    ),
    "LAFAN1": (
        f"pelvis {_chain('left', *_LEG, 'foot')} {_chain('right', *_LEG, 'foot')} spine1 spine2 "
        f"spine3 neck head {_chain('left', 'collar', *_ARM)} {_chain('right', 'collar', *_ARM)}"
    ),
    "KIT-ML": (
        f"pelvis spine1 spine3 neck head {_chain('right', *_ARM)} {_chain('left', *_ARM)} "
        f"{_chain('right', *_LEG)} {_NO} {_chain('right', 'foot')} "
        f"{_chain('left', *_LEG)} {_NO} {_chain('left', 'foot')}"
    ),
    "first Kinect": (
        f"spine_base spine_mid spine_shoulder head {_chain('left', *_ARM, 'hand')} "
        f"{_chain('right', *_ARM, 'hand')} {_chain('left', *_LEG, 'foot')} "
        f"{_chain('right', *_LEG, 'foot')}"
    ),
    "Panoptic": (
        f"neck nose mid_hip {_chain('left', *_ARM, *_LEG)} {_chain('right', *_ARM, *_LEG)} "
        "left_eye left_ear right_eye right_ear"
    ),
    "OpenPose of COCO": (
        f"{_OPENPOSE_BODY} {_chain('right', *_LEG)} {_chain('left', *_LEG)} right_eye left_eye "
        "right_ear left_ear"
    ),
    "MPI-INF-3DHP": (
        f"{_NO} {_NO} {_NO} {_NO} mid_hip thorax {_NO} head "
        f"{_NO} {_chain('left', *_ARM)} {_NO} {_NO} {_chain('right', *_ARM)} {_NO} "
        f"{_chain('left', *_LEG)} {_NO} {_chain('left', 'foot')} "
        f"{_chain('right', *_LEG)} {_NO} {_chain('right', 'foot')}"
    ),
    "MPI-INF-3DHP's test": (
        f"head thorax {_chain('right', *_ARM)} {_chain('left', *_ARM)} {_chain('right', *_LEG)} "
        f"{_chain('left', *_LEG)} mid_hip {_NO} {_NO}"
    ),
    "MPII": (
        f"{_chain('right', *_UP)} {_chain('left', *_LEG)} mid_hip thorax {_NO} head "
        f"{_chain('right', *_ARM[::-1])} {_chain('left', *_ARM)}"
    ),
    "LSP": (
        f"{_chain('right', *_UP)} {_chain('left', *_LEG)} {_chain('right', *_ARM[::-1])} "
        f"{_chain('left', *_ARM)} thorax head"
    ),
    "Xsens": (
        f"pelvis {_NO} {_NO} {_NO} spine neck head {_chain('right', *_ARM_OF_XSENS)} "
        f"{_chain('left', *_ARM_OF_XSENS)} {_chain('right', *_LEG, 'toe')} "
        f"{_chain('left', *_LEG, 'toe')}"
    ),
    "CrowdPose": f"{_both(*_ARM, *_LEG)} head thorax",
}
"""Joints of a body by layout, in order; those called ``-`` are left out."""

_BY_NUMBER = {
    14: ("LSP", "CrowdPose"),
    16: ("MPII",),
    17: ("COCO", "Human3.6M", "MPI-INF-3DHP's test"),
    18: ("OpenPose of COCO",),
    19: ("Panoptic",),
    20: ("first Kinect",),
    21: ("KIT-ML",),
    22: ("SMPL", "LAFAN1"),
    23: ("COCO-WholeBody", "Xsens"),
    25: ("OpenPose", "Kinect"),
    26: ("Halpe",),
    28: ("MPI-INF-3DHP",),
    32: ("Azure Kinect", "Human3.6M in full"),
    133: ("COCO-WholeBody",),
    136: ("Halpe",),
    **dict.fromkeys((49, 65, 67, 135, 137), ("OpenPose",)),
    **dict.fromkeys((24, 45, 52, 55, 73, 127, 144), ("SMPL",)),
    **dict.fromkeys((33, 75, 543, 553), ("MediaPipe",)),  # with hands and face
}
_NAMES = (
    *("positions_3d", "positions", "joints", "joints3d", "joints_3d", "keypoints3d"),
    *("keypoints_3d", "keypoints", "kp3d", "pose3d", "pose_3d", "xyz", "jtr", "skeleton", "arr_0"),
)
# bones, and how long they are as shares of the stature [Winter2009]
_BONES = {
    ("hip", "knee"): 0.245,
    ("knee", "ankle"): 0.246,
    ("shoulder", "elbow"): 0.186,
    ("elbow", "wrist"): 0.146,
}
USUAL = Space(1.0, says_unit=False)  # what an array cannot say
_MOST_PEOPLE = 10  # that are in an array
_LOOK, _ENOUGH = 200, 6  # frames that are looked at; bones of arms and legs that are seen
# by how much bones may vary in time (median), differ from side to side, and from usual proportions
_VARY, _DIFFER, _ODD = 0.15, 0.25, 0.35


class JointArrayReader(Reader):
    """Reads arrays of joints: see the module's docstring.

    Of one person they are (T, J, 3), (T, 3 J), (3, T, J), (T, 3, J) or (J, 3, T). Of several people
    they are (T, P, J, 3), (P, T, J, 3), (T, J, 3, P), or (3, T, J, P), as networks have it, where
    that may be one of a batch, (1, 3, T, J, P). (J, T, 3) is read where T is no number of joints.
    """

    format = "joint array"
    suffixes = (".npy", ".npz")

    def accepts(self, path: Path) -> bool:
        """Whether it is one array, or an archive with one of joints and none of poses."""
        if suffix(path) == ".npy":
            return npy_shape(path)[1:] != (MOTION_X,)
        try:
            archive = NPZFile(path)
        except RecordingError:
            return False
        poses = archive.first_of((*POSES, *ROOTS))
        return poses is None and _name_of_joints(archive) is not None

    def read(self, path: Path, hints: Hints, *, positions: bool) -> Recording:
        """Read the joints; see `Reader.read`."""
        findings = Findings(self.format)
        archive = None
        if suffix(path) == ".npy":
            points = finite(path, "the array", read_npy(path))
        else:
            archive = NPZFile(path)
            name = _name_of_joints(archive)
            if name is None:
                raise bad_file(path, f"arrays {', '.join(archive.names[:8])}", "one of joints")
            points = archive.numbers(name)
        usual_hz = None
        if not points.size:
            raise bad_file(path, "0 frames", "at least one")
        if points.ndim == 2 and points.shape[1] in RATES_HZ:
            usual_hz = RATES_HZ[points.shape[1]]
            findings.note(f"{points.shape[1]} features of motion, at {usual_hz:g} Hz as is usual")
            points = joints_of_features(path, points)
        people = _as_people(path, points)
        said_hz = None if archive is None else archive.rate_hz(len(people[0]))
        rate_hz = hints.rate_hz or said_hz or rate_beside(path, findings) or usual_hz
        if rate_hz is None:
            raise bad_file(path, "no rate", f"one in its name, or {option('rate_hz')}")
        people = [without_unseen(points) for points in people]
        people = [points for points in people if not np.isnan(points).all()] or people[:1]
        if any(map(hold_scores, people)):
            raise bad_file(
                path,
                "pixels, and as third numbers how sure each is: points of a picture",
                "places in space, (frames, joints, 3)",
            )
        n_joints = people[0].shape[1]
        layout = _layout(path, max(people, key=lambda points: np.isfinite(points).sum()))
        joints = LAYOUTS[layout].split()
        findings.note(f"{n_joints} joints: those of {layout}")
        if n_joints > len(joints):
            findings.leave_out([f"{n_joints - len(joints)} points of hands, face and others"])
        kept = [k for k, joint in enumerate(joints) if joint != _NO]
        names = tuple(joints[k] for k in kept)
        if len(people) > 1:
            names = tuple(f"person{p}:{name}" for p in range(len(people)) for name in names)
        points = np.concatenate([points[:, kept] for points in people], axis=1)
        warn_of_pictures(points, names, findings)
        return placed_markers(path, points, names, rate_hz, USUAL, hints, findings)


def _name_of_joints(archive: NPZFile) -> str | None:
    """Return the name of the array of joints: a usual one, or that of the only one of their shape.

    None for none, and for several.
    """
    usual = archive.first_of(_NAMES)
    if usual is not None:
        return usual
    shapes = {name: archive.shape(name) for name in archive.names}
    fitting = [
        name
        for name, shape in shapes.items()
        if len(shape) in (3, 4) and shape[-1] in (3, 4) and shape[-2] in _BY_NUMBER
    ]
    return fitting[0] if len(fitting) == 1 else None


def _as_people(path: Path, array: FloatArray) -> list[FloatArray]:
    """Return an array as the joints of each person, shape (T, J, 3) each."""
    if array.ndim == 5 and len(array) == 1:  # a batch of one take, as networks have it
        array = array[0]
    if array.ndim == 4 and array.shape[1] in _BY_NUMBER and array.shape[2] == 3 != array.shape[3]:
        array = np.moveaxis(array, 3, 1)  # (T, J, 3, P)
    points = array
    last = array.shape[-1:]
    channels_first = array.ndim == 3 or (array.ndim == 4 and last[0] not in (3, 4))
    if array.ndim == 3 and last[0] in (3, 4) and array.shape[1] not in _BY_NUMBER:
        points = array.swapaxes(0, 1) if len(array) in _BY_NUMBER else array  # (J, T, 3)
    if channels_first and array.shape[0] == 3 and array.shape[2] in _BY_NUMBER:
        points = np.moveaxis(array, 0, -1)  # (T, J, 3), or (T, J, P, 3)
        points = points.swapaxes(1, 2) if array.ndim == 4 else points
    elif array.ndim == 3 and array.shape[1] == 3:  # (J, 3, T), as networks have it, or (T, 3, J)
        ways = [array.transpose(2, 0, 1), array.transpose(0, 2, 1)]
        ways = [way for way in ways if way.shape[1] in _BY_NUMBER]
        points = min(ways, key=lambda way: min(_unlike(way).values()), default=array)
    if points.ndim == 4 and points.shape[2] in _BY_NUMBER:
        of_each = points if len(points) <= points.shape[1] else points.swapaxes(0, 1)
        told_apart = len(of_each) < of_each.shape[1] and len(of_each) <= _MOST_PEOPLE
        people = list(of_each) if len(of_each) == 1 or told_apart else []
    elif points.ndim == 2 and points.shape[1] // 3 in _BY_NUMBER and points.shape[1] % 3 == 0:
        people = [points.reshape(len(points), -1, 3)]
    else:
        people = [points]
    shapes = {points.shape[1:] for points in people if points.ndim == 3}
    if not any(shape[0] in _BY_NUMBER and shape[1] in (3, 4) for shape in shapes):
        raise bad_file(
            path,
            f"an array of shape {array.shape}",
            "(frames, joints, 3), (frames, people, joints, 3) with fewer people than frames, or "
            "(3, frames, joints, people), of "
            f"{', '.join(map(str, sorted(_BY_NUMBER)))} joints; a table (CSV) can name others",
        )
    return [points[..., :3].copy() for points in people]  # the fourth says how sure a joint is


def _layout(path: Path, points: FloatArray) -> str:
    """Return which joints these are, by the bones that they would have."""
    unlike = _unlike(points)
    best = min(unlike, key=lambda name: unlike[name])
    if not np.isfinite(unlike[best]):
        raise bad_file(
            path,
            f"{points.shape[1]} points whose arms and legs would not be a person's in the order of "
            f"{' or '.join(unlike)}",
            "joints in such an order; a table (CSV) can name others",
        )
    return best


def _unlike(points: FloatArray) -> dict[str, float]:
    """Return how little like a person's arms and legs are in each layout that there can be."""
    some = points[:: -(-len(points) // _LOOK)]
    names = _BY_NUMBER[points.shape[1]]
    return {name: _unlikeness(some, LAYOUTS[name].split()) for name in names}


def _unlikeness(points: FloatArray, names: list[str]) -> float:
    """Return how little like a person's arms and legs are, as shares; infinite for none."""
    lengths = np.full((2, len(_BONES)), np.nan)
    vary = np.zeros_like(lengths)
    for k, (upper, lower) in enumerate(_BONES):
        for side, word in enumerate(("left", "right")):
            ends = (points[:, names.index(f"{word}_{joint}")] for joint in (upper, lower))
            apart = np.linalg.norm(np.subtract(*ends), axis=1)
            apart = apart[np.isfinite(apart)]
            if len(apart) and np.median(apart) > 0:
                lengths[side, k] = np.median(apart)
                vary[side, k] = np.median(np.abs(apart / lengths[side, k] - 1.0))
    seen = np.isfinite(lengths)
    if seen.sum() < _ENOUGH:
        return np.inf
    odd = np.log(lengths / list(_BONES.values()))
    odd -= np.median(odd[seen])
    differ = np.abs(odd[0] - odd[1])
    off = [(vary[seen], _VARY), (differ[np.isfinite(differ)], _DIFFER), (np.abs(odd[seen]), _ODD)]
    if any((shares > limit).any() for shares, limit in off):
        return np.inf
    return float(sum(shares.mean() for shares, _ in off if len(shares)))
