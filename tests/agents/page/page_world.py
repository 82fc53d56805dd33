"""Messages as the processes send them, made up: a world of any number of primitives."""

from __future__ import annotations

import random

import numpy as np

from mplearn.body import human_body
from mplearn_agents.page.figures import poses_of, shapes_of

HOSTILE = [
    "<img src=x onerror=alert(1)>",
    "</text><script>alert(1)</script>",
    "\u202egnirts desrever",
    "{2} ${7} %s",
    "a" * 80,
    "Überkopf 上げる 🙌",
    "'\"&amp;--",
]


def bodies():
    shapes = shapes_of(human_body().model())
    return {"kind": "bodies", "person": shapes, "robot": shapes}


def stream(n=43):
    channels = [f"c{k}" for k in range(n)]
    return {"kind": "stream", "source": "made up", "channels": channels} | {
        "rate_hz": 100.0,
        "stride": 2,
        "frame": 0,
        "store": "",
    }


def standing():
    body = human_body()
    return poses_of(body.tree, body.rest[None])[0]


def live(first, n=10, channels=43, seed=0):
    rows = np.random.default_rng(seed).normal(size=(n, channels)).astype(np.float32)
    pose = standing()
    header = {"kind": "live", "first": first, "n": n, "bodies": len(pose)}
    return header, pose.tobytes() + rows.tobytes()


def knowledge(n, names=(), revision=1, branches=12):
    """Return n primitives below some inner nodes, each followed by three others."""
    rng = random.Random(0)
    inner = [1000 + k for k in range(branches if n > 20 else 0)]
    nodes = [{"id": 0, "parent": None, "n": n}]
    nodes += [{"id": id, "parent": 0, "n": 5} for id in inner]
    primitives, edges = [], []
    for id in range(1, n + 1):
        name = names[id - 1] if id <= len(names) else f"P{id}"
        of = 3 if id % 7 == 0 else 0
        shown = 2 if of else 3 + id % 20
        primitives.append({"id": id, "name": name, "n": shown, "of": of, "duration_s": 1.2})
        nodes.append({"id": id, "parent": rng.choice(inner) if inner else 0, "n": shown})
        for p, to in zip((0.6, 0.3, 0.1), rng.sample(range(1, n + 1), min(3, n)), strict=False):
            edges.append([id, to, round(20 * p), p, 1.1])
    return {
        "kind": "knowledge",
        "primitives": primitives,
        "nodes": nodes,
        "edges": edges,
        "revision": revision,
        "waiting": {"n": 0, "times": 0, "of": 2},
    }


def segment(start, end, primitive=None, state="known", why=""):
    return {
        "kind": "segment",
        "start": start,
        "end": end,
        "primitive": primitive,
        "state": state,
        "why": why,
    }
