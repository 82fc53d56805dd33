"""What stands beside each exported file: what was meant, so that a check can tell.

A CSV without a header says neither its rate nor its robot, and a motion that was mirrored is a
motion. So a JSON file of the same name says robot, rate, order of joints and bodies, primitives,
and where all bodies are at some moments.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mplearn.errors import RecordingError
from mplearn.recording import FloatArray
from mplearn.writing import written_whole

from .motion import RobotMotion
from .robot_model import RobotModel

_VERSION = 1
_MOMENTS = 16


@dataclass(frozen=True, eq=False)
class Meant:
    """What was meant by one motion of a file.

    Attributes:
        name: What it is called.
        rate_hz: Frames per second [1/s].
        n_frames: How many there are.
        times_s: Some moments, shape (K,) [s].
        pos: Where the bodies are then, shape (K, B, 3) [m].
        quat: How they are turned (w, x, y, z), shape (K, B, 4).
    """

    name: str
    rate_hz: float
    n_frames: int
    times_s: FloatArray
    pos: FloatArray
    quat: FloatArray


@dataclass(frozen=True, eq=False)
class Sidecar:
    """What was meant by a file.

    Attributes:
        format: Name of its format.
        robot: Name of the robot.
        body_names: Names of its bodies.
        motions: What was meant by each motion.
    """

    format: str
    robot: str
    body_names: tuple[str, ...]
    motions: tuple[Meant, ...]


def sidecar_path(path: Path) -> Path:
    """Return where the sidecar of a file or folder stands."""
    return path.with_name(path.name + ".json")


def write_sidecar(
    path: Path, format: str, motions: Sequence[RobotMotion], model: RobotModel
) -> None:
    """Write what is meant by a file beside it."""
    clips = []
    for motion in motions:
        frames = np.unique(np.linspace(0, len(motion) - 1, _MOMENTS).round().astype(np.int64))
        bodies = model.forward(
            motion.root_pos[frames], motion.root_quat[frames], motion.joint_pos[frames]
        )
        clips.append(
            {
                "name": motion.name,
                "rate_hz": motion.rate_hz,
                "n_frames": len(motion),
                "primitives": [span._asdict() for span in motion.spans],
                "frames": frames.tolist(),
                "body_pos": bodies.pos.round(7).tolist(),
                "body_quat": bodies.quat.round(8).tolist(),
            }
        )
    content = {
        "mplearn_export": _VERSION,
        "format": format,
        "robot": model.name,
        "joints": list(model.joint_names),
        "bodies": list(model.body_names),
        "motions": clips,
    }
    with written_whole(sidecar_path(path)) as file:
        file.write_text(json.dumps(content, separators=(",", ":")), encoding="utf-8")


def read_sidecar(path: Path) -> Sidecar | None:
    """Return what was meant by a file; None where nothing says so.

    Raises:
        RecordingError: The sidecar is damaged, or of a later version.
    """
    beside = sidecar_path(path)
    if not beside.is_file():
        return None
    try:
        content = json.loads(beside.read_text("utf-8"))
        version = content["mplearn_export"]
        if version != _VERSION:
            raise ValueError(f"it is of version {version}, known is {_VERSION}")
        bodies = tuple(content["bodies"])
        motions = []
        for clip in content["motions"]:
            rate_hz, frames = float(clip["rate_hz"]), np.array(clip["frames"], dtype=np.float64)
            pos = np.array(clip["body_pos"], dtype=np.float64)
            quat = np.array(clip["body_quat"], dtype=np.float64)
            shape = (len(frames), len(bodies))
            if pos.shape != (*shape, 3) or quat.shape != (*shape, 4) or not rate_hz > 0:
                raise ValueError(f"its bodies are of shapes {pos.shape} and {quat.shape}")
            n_frames = int(clip["n_frames"])
            motions.append(Meant(clip["name"], rate_hz, n_frames, frames / rate_hz, pos, quat))
        return Sidecar(content["format"], content["robot"], bodies, tuple(motions))
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise RecordingError(
            f"{beside} is not what `mplearn export` wrote beside {path.name!r}: {error!r}; "
            "without it, the file is checked by itself"
        ) from error
