"""Arrays of joints' places, ``.npy`` or ``.npz``, as pose estimators and data sets have them.

Such an array holds no names: how many joints there are tells which they may be, and of several
layouts the one whose bones keep their lengths, and are as long on both sides. Hands, face and what
else comes behind the body's joints are left out.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ...errors import RecordingError
from ...recording import FloatArray, Recording, marker_channels
from ..files import bad_file, stem, suffix
from ..findings import Findings
from ..markers.columns import MEDIAPIPE_POSE
from ..markers.pictures import hold_scores, warn_of_pictures
from ..numbers import without_unseen
from ..options import option
from ..placing.space import Space, placed
from ..rates import rate_beside
from ..reader import Hints, Reader
from .npz_file import NPZFile, finite, read_npy
from .smpl import BODY_JOINTS, POSES, ROOTS

_FACE = "nose left_eye right_eye left_ear right_ear"
_FEET = "left_big_toe left_small_toe left_heel right_big_toe right_small_toe right_heel"


def _both(*joints: str) -> str:
    return " ".join(f"{side}_{joint}" for joint in joints for side in ("left", "right"))


def _chain(side: str, *joints: str) -> str:
    return " ".join(f"{side}_{joint}" for joint in joints)


_ARM, _LEG = ("shoulder", "elbow", "wrist"), ("hip", "knee", "ankle")
_HAND = ("clavicle", *_ARM, "hand", "handtip", "thumb")
_COCO = f"{_FACE} {_both(*_ARM, *_LEG)}"
LAYOUTS = {
    "COCO": _COCO,
    "Human3.6M": (
        f"mid_hip {_chain('right', *_LEG)} {_chain('left', *_LEG)} spine thorax nose head "
        f"{_chain('left', *_ARM)} {_chain('right', *_ARM)}"
    ),
    "SMPL": " ".join(BODY_JOINTS),
    "OpenPose": (
        f"nose neck {_chain('right', *_ARM)} {_chain('left', *_ARM)} mid_hip "
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
}
"""Joints of a body by layout, in order."""

_BY_NUMBER = {
    17: ("COCO", "Human3.6M"),
    25: ("OpenPose", "Kinect"),
    26: ("Halpe",),
    32: ("Azure Kinect",),
    133: ("COCO-WholeBody",),
    **dict.fromkeys((22, 24, 52, 55, 127, 144), ("SMPL",)),
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
_LOOK, _ENOUGH = 200, 6  # frames that are looked at; bones of arms and legs that are seen
# by how much bones may vary in time (median), differ from side to side, and from usual proportions
_VARY, _DIFFER, _ODD = 0.15, 0.25, 0.35


class JointArrayReader(Reader):
    """Reads arrays of joints, shape (T, J, 3): see the module's docstring."""

    format = "joint array"
    suffixes = (".npy", ".npz")

    def accepts(self, path: Path) -> bool:
        """Whether it is one array, or an archive with one of joints and none of poses."""
        if suffix(path) == ".npy":
            return True
        try:
            archive = NPZFile(path)
        except RecordingError:
            return False
        poses = archive.first_of((*POSES, *ROOTS))
        return poses is None and archive.first_of(_NAMES) is not None

    def read(self, path: Path, hints: Hints, *, positions: bool) -> Recording:
        """Read the joints; see `Reader.read`."""
        findings = Findings(self.format)
        said_hz = None
        if suffix(path) == ".npy":
            points = finite(path, "the array", read_npy(path))
        else:
            archive = NPZFile(path)
            name = archive.first_of(_NAMES)
            if name is None:
                raise bad_file(path, f"arrays {', '.join(archive.names[:8])}", "one of joints")
            points, said_hz = archive.numbers(name), archive.rate_hz()
        points = _as_joints(path, points)
        rate_hz = hints.rate_hz or said_hz or rate_beside(path, findings)
        if rate_hz is None:
            raise bad_file(path, "no rate", f"one in its name, or {option('rate_hz')}")
        points = without_unseen(points)
        if hold_scores(points):
            raise bad_file(
                path,
                "pixels, and as third numbers how sure each is: points of a picture",
                "places in space, (frames, joints, 3)",
            )
        layout = _layout(path, points)
        names = tuple(LAYOUTS[layout].split())
        findings.note(f"{points.shape[1]} joints: those of {layout}")
        if points.shape[1] > len(names):
            findings.leave_out([f"{points.shape[1] - len(names)} points of hands, face and others"])
        points = points[:, : len(names)]
        warn_of_pictures(points, names, findings)
        at = placed(path, points, names, rate_hz, USUAL, hints, findings)
        return Recording(
            at.points.reshape(len(points), -1),
            rate_hz,
            marker_channels(names),
            stem(path),
            report=findings.report(rate_hz, at.unit_m, at.up),
        )


def _as_joints(path: Path, array: FloatArray) -> FloatArray:
    """Return an array as joints, shape (T, J, 3)."""
    points = array[0] if array.ndim == 4 and len(array) == 1 else array
    if points.ndim == 4 and points.shape[1] == 1:
        points = points[:, 0]
    if points.ndim == 2 and points.shape[1] // 3 in _BY_NUMBER and points.shape[1] % 3 == 0:
        points = points.reshape(len(points), -1, 3)
    if points.ndim != 3 or points.shape[2] not in (3, 4) or points.shape[1] not in _BY_NUMBER:
        raise bad_file(
            path,
            f"an array of shape {array.shape}",
            f"(frames, joints, 3), of {', '.join(map(str, sorted(_BY_NUMBER)))} joints; a table "
            "(CSV) can name others",
        )
    if not len(points):
        raise bad_file(path, "0 frames", "at least one")
    return points[..., :3].copy()  # the fourth says how sure a joint is


def _layout(path: Path, points: FloatArray) -> str:
    """Return which joints these are, by the bones that they would have."""
    candidates = _BY_NUMBER[points.shape[1]]
    some = points[:: -(-len(points) // _LOOK)]
    unlike = {name: _unlikeness(some, LAYOUTS[name].split()) for name in candidates}
    best = min(unlike, key=lambda name: unlike[name])
    if not np.isfinite(unlike[best]):
        raise bad_file(
            path,
            f"{points.shape[1]} points whose arms and legs would not be a person's in the order of "
            f"{' or '.join(candidates)}",
            "joints in such an order; a table (CSV) can name others",
        )
    return best


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
