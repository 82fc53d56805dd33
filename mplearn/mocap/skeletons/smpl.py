"""SMPL, SMPL-H and SMPL-X poses in ``.npz`` files, as AMASS has them, or ``.npy`` [SMPL] [AMASS].

Such a file holds how each joint of a body model turns, and where the model is; how long the bones
are comes from the model, which has a licence of its own and is neither needed nor shipped. The
rotations are taken alone, on the bones of a person of mean proportions and 1.70 m [Winter2009].
Fingers, jaw and eyes are left out.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from ...maths.rotations import matrix_to_quaternion, rotation_vector_to_matrix
from ...option_names import option
from ...recording import BoolArray, FloatArray, Recording
from ..files import bad_file, suffix
from ..findings import Findings
from ..placing.space import Space
from ..rates import rate_beside
from ..reader import Hints, Reader
from .npz_file import RATES, Arrays, HeldArrays, NPZFile, finite, npy_shape, read_npy
from .skeletal import Limbs, limb_order, skeletal_recording
from .stature import unit_of_places

STATURE_M = 1.70
"""How tall the person is whose bones turn [m]."""

# Each joint, its parent, and where it is from it in a T pose as a share of the stature: forward,
# left, up. The order is that of the models' rotations.
_JOINTS = (
    ("pelvis", "", 0.0, 0.0, 0.0),
    ("left_hip", "pelvis", 0.0, 0.050, -0.045),
    ("right_hip", "pelvis", 0.0, -0.050, -0.045),
    ("spine1", "pelvis", 0.0, 0.0, 0.065),
    ("left_knee", "left_hip", 0.0, 0.0, -0.245),
    ("right_knee", "right_hip", 0.0, 0.0, -0.245),
    ("spine2", "spine1", 0.0, 0.0, 0.075),
    ("left_ankle", "left_knee", 0.0, 0.0, -0.246),
    ("right_ankle", "right_knee", 0.0, 0.0, -0.246),
    ("spine3", "spine2", 0.0, 0.0, 0.035),
    ("left_foot", "left_ankle", 0.075, 0.0, -0.030),
    ("right_foot", "right_ankle", 0.075, 0.0, -0.030),
    ("neck", "spine3", 0.0, 0.0, 0.120),
    ("left_collar", "spine3", 0.0, 0.035, 0.070),
    ("right_collar", "spine3", 0.0, -0.035, 0.070),
    ("head", "neck", 0.010, 0.0, 0.050),
    ("left_shoulder", "left_collar", 0.0, 0.075, -0.005),
    ("right_shoulder", "right_collar", 0.0, -0.075, -0.005),
    ("left_elbow", "left_shoulder", 0.0, 0.172, 0.0),
    ("right_elbow", "right_shoulder", 0.0, -0.172, 0.0),
    ("left_wrist", "left_elbow", 0.0, 0.146, 0.0),
    ("right_wrist", "right_elbow", 0.0, -0.146, 0.0),
)
_ENDS = (
    ("head_end", "head", 0.0, 0.0, 0.075),
    ("left_foot_end", "left_foot", 0.045, 0.0, 0.0),
    ("right_foot_end", "right_foot", 0.045, 0.0, 0.0),
    ("left_wrist_end", "left_wrist", 0.0, 0.108, 0.0),
    ("right_wrist_end", "right_wrist", 0.0, -0.108, 0.0),
)
BODY_JOINTS = tuple(name for name, *_ in _JOINTS)
"""Names of the joints of the body, in the order of the models."""

_TO_OURS = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])  # theirs: x left, y up
_N_BODY = len(_JOINTS)
_MODELS = {24: "SMPL", 52: "SMPL-H", 55: "SMPL-X", 22: "the body alone", 23: "SMPL without root"}

POSES = ("poses", "smpl_poses", "fullpose", "full_pose", "pose")
ROOTS = ("root_orient", "global_orient")
_BODIES = ("pose_body", "body_pose")
_FAR_M = 20.0  # from where all begins: hardly a place in metres
_SQUARE = 0.01  # by which matrices and quaternions are off rotations, at most
_PLACES = ("trans", "transl", "smpl_trans", "root_trans")
_SCALE = "smpl_scaling"  # AIST++: by how much its places are larger than the model's
MOTION_X = 322
"""Numbers a frame of Motion-X: root, body, hands, jaw, face, place, betas."""
_MOTION_X_HZ = 30.0


class SMPLReader(Reader):
    """Reads the poses of SMPL's family from ``.npz`` files: see the module's docstring.

    The rotations are axis-angle vectors [rad], matrices or quaternions, under ``poses``, or under
    ``root_orient`` and ``pose_body`` (``global_orient`` and ``body_pose``); places under ``trans``
    [m]; the rate under ``mocap_framerate``. The world of AMASS is z up. Motion-X has all in one
    array of 322 numbers a frame, at 30 Hz.
    """

    format = "SMPL"
    suffixes = (".npz", ".npy")

    def accepts(self, path: Path) -> bool:
        """Whether it is an archive, or an array as Motion-X has it."""
        return suffix(path) == ".npz" or npy_shape(path)[1:] == (MOTION_X,)

    def read(self, path: Path, hints: Hints, *, positions: bool) -> Recording:
        """Read angles, or where the joints of a person of 1.70 m are; see `Reader.read`."""
        findings = Findings(self.format)
        whole = suffix(path) == ".npy"
        archive = _motion_x(path) if whole else NPZFile(path)
        vectors = _vectors(archive, findings)
        rate_hz = hints.rate_hz or archive.rate_hz(len(vectors)) or rate_beside(path, findings)
        if rate_hz is None and whole:
            rate_hz = _MOTION_X_HZ
            findings.note(f"{rate_hz:g} Hz, as is usual in Motion-X")
        if rate_hz is None:
            raise bad_file(path, f"none of {', '.join(RATES[:5])}", f"one, or {option('rate_hz')}")
        limbs = mean_person()
        local = np.broadcast_to(np.eye(3), (len(vectors), len(limbs.names), 3, 3)).copy()
        turns = rotation_vector_to_matrix(vectors)
        local[:, :_N_BODY] = _TO_OURS @ turns @ _TO_OURS.T
        local[:, 0] = turns[:, 0] @ _TO_OURS.T  # the root's parent is the world
        places = _places(archive, len(vectors), findings)
        unit_m = _unit(path, places, turns[:, 0, :, 1], hints, findings)
        findings.note(
            f"the bones are those of a person of mean proportions and {STATURE_M:.2f} m: "
            "the file holds none"
        )
        motion = limbs.motion(local, places * unit_m, rate_hz, Space(1.0, "z", "x"))
        metres = replace(hints, unit_m=1.0)  # the bones are ours, whatever the unit of places
        recording = skeletal_recording(path, motion, metres, findings, positions=positions)
        assert recording.report is not None
        return replace(recording, report=replace(recording.report, unit_m=unit_m))


def _motion_x(path: Path) -> Arrays:
    """Return the arrays that an array of Motion-X is made of."""
    array = finite(path, "the array", read_npy(path))
    if array.ndim != 2 or array.shape[1] != MOTION_X:
        raise bad_file(path, f"an array of shape {array.shape}", f"(frames, {MOTION_X})")
    return HeldArrays(path, {"poses": array[:, :66], "trans": array[:, 309:312]})


def mean_person() -> Limbs:
    """Return the skeleton of a person of mean proportions in a T pose, x forward, z up [m]."""
    names = tuple(name for name, *_ in (*_JOINTS, *_ENDS))
    return Limbs(
        names,
        tuple(names.index(parent) if parent else -1 for _, parent, *_ in (*_JOINTS, *_ENDS)),
        STATURE_M * np.array([place for _, _, *place in (*_JOINTS, *_ENDS)]),
        tuple(limb_order(name, is_root=i == 0) for i, (name, *_) in enumerate(_JOINTS))
        + ("",) * len(_ENDS),
    )


def _vectors(archive: Arrays, findings: Findings) -> FloatArray:
    """Return the rotation vectors of the body's joints, shape (T, 22, 3) [rad]."""
    name = archive.first_of(POSES)
    root, body = archive.first_of(ROOTS), archive.first_of(_BODIES)
    if name is not None:
        poses = _as_vectors(archive, name, findings)
    elif root is not None and body is not None:
        parts = [_as_vectors(archive, part, findings) for part in (root, body)]
        if len({len(part) for part in parts}) > 1:
            raise bad_file(archive.path, f"{root} and {body} of other lengths", "a row a frame")
        poses = np.concatenate([part.reshape(len(part), -1) for part in parts], axis=1)
    else:
        raise bad_file(
            archive.path,
            f"arrays {', '.join(archive.names[:8])}",
            "'poses', or 'root_orient' and 'pose_body', as in AMASS",
        )
    width = int(np.prod(poses.shape[1:]))
    if poses.ndim < 2 or width % 3 or width < 3 * _N_BODY or len(poses) == 0:
        raise bad_file(
            archive.path,
            f"poses of shape {poses.shape}",
            f"three numbers a joint, of {_N_BODY} joints or more: {_MODELS[24]} has 72 in a row, "
            f"{_MODELS[52]} 156, {_MODELS[55]} 165",
        )
    n_joints = width // 3
    model = _MODELS.get(n_joints, f"{n_joints} joints")
    if n_joints > _N_BODY:
        findings.leave_out([f"rotations of {n_joints - _N_BODY} joints of hands and face"])
    findings.note(f"the poses are those of {model}")
    vectors = poses.reshape(len(poses), n_joints, 3)[:, :_N_BODY]
    turns = np.linalg.norm(np.nan_to_num(vectors[:, 1:]), axis=2).max(axis=1)
    if np.median(turns) > 2.0 * np.pi:  # no joint but the root turns so far
        findings.warn("joints turn by more than a full turn: the rotations are taken for degrees")
        vectors = np.radians(vectors)
    return vectors


def _as_vectors(archive: Arrays, name: str, findings: Findings) -> FloatArray:
    """Return an array of rotations as rotation vectors, whatever it holds; others as they are.

    Missing ones, NaN, stay missing.

    Raises:
        RecordingError: It holds matrices that are no rotations, or so many numbers a joint as no
            rotation has that is known here.
    """
    values = archive.numbers(name)
    if values.ndim == 3 and len(values) == 1 and values.shape[2] >= 3 * _N_BODY:
        values = values[0]  # a batch of one, as networks have it
    width = int(np.prod(values.shape[1:]))
    if width and width % 9 == 0:
        matrices = values.reshape(len(values), width // 9, 3, 3)
        seen = np.asarray(~np.isnan(matrices).any(axis=(2, 3)))
        known = matrices[seen]
        off = np.abs(np.einsum("nik,nil->nkl", known, known) - np.eye(3)).max(initial=0.0)
        square = len(known) > 0 and off < _SQUARE
        if square and (np.linalg.det(known) > 0).all():
            findings.note(f"{name} holds matrices")
            return _rotation_vectors(matrix_to_quaternion(known), seen)
        if square or values.shape[2:] == (3, 3):
            raise bad_file(archive.path, f"{name} with matrices that are no rotations", "rotations")
    per_joint = values.shape[-1] if values.ndim == 3 else 3
    if per_joint == 4:
        seen = np.asarray(~np.isnan(values).any(axis=2))
        known = values[seen]
        if len(known) and np.abs(np.linalg.norm(known, axis=1) - 1.0).max() < _SQUARE:
            share = np.abs(known).mean(axis=0)  # joints are turned little: w is large
            order, places = ("w, x, y, z", [0, 1, 2, 3]), ("x, y, z, w", [3, 0, 1, 2])
            said, columns = order if share[0] > share[3] else places
            findings.warn(f"{name} holds quaternions, taken as {said}")
            return _rotation_vectors(known[:, columns], seen)
    if per_joint != 3:
        raise bad_file(
            archive.path, f"{name} of shape {values.shape}", "rotation vectors, three numbers each"
        )
    return values


def _rotation_vectors(quaternions: FloatArray, seen: BoolArray) -> FloatArray:
    """Return rotation vectors [rad] of quaternions (w, x, y, z) where they were seen, else NaN.

    Args:
        quaternions: Shape (n, 4).
        seen: Where they belong, n times true, shape (T, J).

    Returns:
        Shape (T, J, 3).
    """
    from scipy.spatial.transform import Rotation

    vectors = np.full((*seen.shape, 3), np.nan)
    vectors[seen] = Rotation.from_quat(quaternions, scalar_first=True).as_rotvec()
    return vectors


def _places(archive: Arrays, n_frames: int, findings: Findings) -> FloatArray:
    name = archive.first_of(_PLACES)
    if name is None:
        findings.warn("there is no 'trans': the pelvis is taken to stay where it is")
        height = -float(mean_person().offsets[[1, 4, 7, 10], 2].sum())
        return np.tile([0.0, 0.0, height], (n_frames, 1))
    places = archive.numbers(name)
    if places.size != 3 * n_frames or places.shape[-1:] != (3,):
        raise bad_file(archive.path, f"{name} of shape {places.shape}", f"({n_frames}, 3)")
    places = places.reshape(n_frames, 3)
    scale = archive.numbers(_SCALE).ravel() if _SCALE in archive.names else np.ones(1)
    if len(scale) == 1 and scale[0] > 0 and scale[0] != 1.0:
        findings.note(f"{name} is divided by {_SCALE}, {scale[0]:.5g}: it is metres then")
        places = places / scale[0]
    return places


def _unit(
    path: Path, places: FloatArray, upward: FloatArray, hints: Hints, findings: Findings
) -> float:
    """Return the unit of the pelvis' places [m]: metres, or by its height where they are far off.

    Args:
        path: The file, for messages.
        places: Shape (T, 3).
        upward: Where the trunk points to, shape (T, 3).
        hints: What the caller says.
        findings: Where to tell what was found.
    """
    known = ~np.isnan(places).any(axis=1) & ~np.isnan(upward).any(axis=1)
    far = known.any() and np.median(np.abs(places[known]).max(axis=1)) >= _FAR_M
    if hints.unit_m is None and not far:
        return 1.0
    axis = int(np.abs(upward[known].sum(axis=0)).argmax())
    return unit_of_places(path, places[known, axis], 1.0, hints, findings)
