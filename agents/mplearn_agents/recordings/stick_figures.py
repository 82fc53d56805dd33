"""Stick figures: the points of recordings as they were read, and the person recognised in them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from mplearn.body import human_body, posture_of
from mplearn.recording import FloatArray
from mplearn_agents.recordings.inspection import Inspection, plain_points
from mplearn_agents.terminal.inert import printable

LEFT, RIGHT, MIDDLE, OTHER = "#c1272d", "#0f5e9c", "#222222", "#b0b0b0"
_LIMBS = (("hip", "knee", "ankle", "ball"), ("shoulder", "elbow", "wrist", "hand"))


def draw(inspections: Sequence[Inspection], path: Path) -> None:
    """Write a picture, a row a recording: as read, then the person at moments of it.

    Left is red and right is blue; both are seen from the front of the first axis, a little aside.
    """
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    columns = 1 + max((len(i.moments) for i in inspections), default=0)
    figure, axes = plt.subplots(
        len(inspections),
        columns,
        figsize=(1.9 * columns, 2.6 * len(inspections)),
        squeeze=False,
        layout="constrained",
    )
    for row, found in zip(axes, inspections, strict=True):
        for at in row:
            at.set_aspect("equal")
            at.axis("off")
        _points(row[0], found)
        for at, moment, features in zip(row[1:], found.moments, found.postures, strict=False):
            _person(at, features)
            at.set_title(f"{moment / found.recording.rate_hz:.1f} s", fontsize=6)
        name = printable(found.recording.name[:32])
        row[0].set_title(name, fontsize=6, loc="left", parse_math=False)
        if found.problem:
            text = printable(found.problem[:160])
            at = row[1 if columns > 1 else 0]
            where = {"transform": at.transAxes, "in_layout": False}  # it may be wider than the rest
            at.text(0, 0.4, text, fontsize=5, wrap=True, parse_math=False, **where)
    figure.savefig(path, dpi=110)
    plt.close(figure)


def _seen(points: FloatArray) -> FloatArray:
    """Return points as seen from ahead and 30 deg to the side: to the right, and up."""
    right = np.array([0.5, -0.866, 0.0])  # a person who faces x shows the left on the right side
    return np.stack((-(points @ right), points[..., 2] - 0.12 * (points[..., 0])), axis=-1)


def _points(at: Any, found: Inspection) -> None:
    recording = found.recording
    names = plain_points(recording)
    if not names:
        return
    moment = found.moments[len(found.moments) // 2] if found.moments else 0
    points = recording.markers[moment, : len(names)]
    flat = _seen(points)
    if recording.skeleton is not None:
        for joint, parent in enumerate(recording.skeleton.parents[: len(names)]):
            if parent >= 0 and np.linalg.norm(points[joint] - points[parent]) < 0.8:
                _line(at, flat[[parent, joint]], OTHER, 0.8)
    at.plot(flat[:, 0], flat[:, 1], ".", color=OTHER, markersize=2)
    if found.places is not None:
        places = dict(
            zip(found.places.marker_names, _seen(found.places.markers[moment]), strict=True)
        )
        for side, color in (("l", LEFT), ("r", RIGHT)):
            for limb in _LIMBS:
                way = [places[f"{p}_{side}"] for p in limb if f"{p}_{side}" in places]
                if len(way) > 1:
                    _line(at, np.array(way), color, 1.2)
        sided = [(n, p) for n, p in places.items() if n.endswith(("_l", "_r")) or n[0] in "LR"]
        for name, place in sided:
            left = name.endswith("_l") or (name[0] == "L" and not name.endswith("_r"))
            at.plot(*place, ".", color=LEFT if left else RIGHT, markersize=3)


def _person(at: Any, features: FloatArray) -> None:
    body = human_body()
    tree = body.tree
    places, turns = tree.forward(posture_of(features, body=body))
    for child, parent in enumerate(tree.parent):
        if parent >= 0:
            name = tree.body_names[child]
            color = LEFT if name.endswith("_l") else RIGHT if name.endswith("_r") else MIDDLE
            _line(at, _seen(places[[parent, child]]), color, 1.4)
    ends = {"head": (0.02, 0, 0.24), "hand_l": (0, 0, -0.18), "hand_r": (0, 0, -0.18)}
    ends |= {"toes_l": (0.08, 0, 0), "toes_r": (0.08, 0, 0)}
    for name, end in ends.items():
        b = tree.body(name)
        color = LEFT if name.endswith("_l") else RIGHT if name.endswith("_r") else MIDDLE
        _line(at, _seen(np.array([places[b], places[b] + turns[b] @ np.array(end)])), color, 1.4)
    head = tree.body("head")
    nose = places[head] + np.array([[0.02, 0, 0.12], [0.13, 0, 0.1]]) @ turns[head].T
    _line(at, _seen(nose), MIDDLE, 1.4)
    at.set_xlim(-0.95, 0.95)
    at.set_ylim(-0.2, 2.1)


def _line(at: Any, way: FloatArray, color: str, width: float) -> None:
    at.plot(way[:, 0], way[:, 1], "-", color=color, linewidth=width, solid_capstyle="round")
