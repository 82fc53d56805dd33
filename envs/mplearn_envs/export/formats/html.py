"""A film in one HTML file: any browser plays it, without a server, and nothing is loaded.

The page holds the robot (bodies, hinges, shapes) and the motion as numbers, and a script of our own
that does forward kinematics and draws on a canvas. A content security policy allows this script and
this style alone, by their hashes.
"""

from __future__ import annotations

import base64
import hashlib
import html
import json
import re
from collections.abc import Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from mplearn.errors import RecordingError

from ..format import Format, Reading, in_order
from ..motion import RobotMotion
from ..robot_model import RobotModel
from .shapes import shapes

_MARK = re.compile("@([A-Z_]+)@")
_START, _END = '<script type="application/json" id="motion">', "</script>"


class HTMLFilm(Format):
    """See the module's docstring."""

    name = "html"
    about = "a film in one HTML file that any browser plays, to look at and to send around"
    suffix = ".html"

    def write(self, path: Path, motions: Sequence[RobotMotion], model: RobotModel) -> None:
        """Write one motion."""
        (motion,) = motions
        script, style, page = (_part(f"film.{kind}") for kind in ("js", "css", "html"))
        content = json.dumps(_content(motion, model), separators=(",", ":"), allow_nan=False)
        texts = {
            "SCRIPT_HASH": _hash(script),
            "STYLE_HASH": _hash(style),
            "TITLE": html.escape(motion.name),
            "STYLE": style,
            "SCRIPT": script,
            "MOTION": content.replace("<", "\\u003c"),
        }
        page = _MARK.sub(lambda found: texts[found[1]], page)
        path.write_text(page, encoding="utf-8")

    def read(self, path: Path, model: RobotModel) -> tuple[Reading, ...]:
        """Return the motion of a film."""
        _, _, rest = path.read_text(encoding="utf-8", errors="replace").partition(_START)
        try:
            content = json.loads(rest[: rest.index(_END)])
            order = in_order(path, "joint", content["joints"], model.joint_names)
            pos, quat, joints = (
                np.array(content[key], dtype=np.float64)
                for key in ("root_pos", "root_quat", "joint_pos")
            )
            rate_hz = float(content["rate_hz"])
        except (ValueError, KeyError, TypeError, IndexError) as error:
            raise RecordingError(f"{path}: no film of a motion: {error!r}") from error
        if joints.ndim == 2 and joints.shape[1] == len(order):
            joints = joints[:, order]
        return (Reading(rate_hz, pos, quat, joints).require(path, model),)


def _content(motion: RobotMotion, model: RobotModel) -> dict[str, Any]:
    own, bodies = model.model, []
    for b, body in enumerate(model.bodies):
        hinges = np.flatnonzero(model.joint_bodies == b)
        bodies.append(
            {
                "parent": int(model.parents[b]),
                "pos": own.body_pos[body].round(7).tolist(),
                "quat": own.body_quat[body].round(8).tolist(),
                "joints": [
                    {
                        "index": int(j),
                        "axis": model.axes[j].round(8).tolist(),
                        "anchor": own.jnt_pos[model.joints[j]].round(7).tolist(),
                        "shift": float(
                            model.shift[j]
                            + model.signs[j] * own.qpos0[own.jnt_qposadr[model.joints[j]]]
                        ),
                    }
                    for j in hinges
                ],
            }
        )
    return {
        "name": motion.name,
        "robot": model.name,
        "rate_hz": motion.rate_hz,
        "height": round(float(np.ptp(model.at_zero.pos[0, :, 2])), 3) * 1.15,
        "bodies": bodies,
        "shapes": shapes(model),
        "joints": list(motion.joint_names),
        "spans": [span._asdict() for span in motion.spans],
        "root_pos": motion.root_pos.round(6).tolist(),
        "root_quat": motion.root_quat.round(7).tolist(),
        "joint_pos": motion.joint_pos.round(6).tolist(),
    }


def _part(name: str) -> str:
    return (files(__package__) / name).read_text(encoding="utf-8")


def _hash(text: str) -> str:
    digest = hashlib.sha256(text.encode("utf-8")).digest()
    return f"sha256-{base64.b64encode(digest).decode('ascii')}"
