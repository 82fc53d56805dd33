"""A person's segments, as suits and avatars stream them."""

from functools import cache

import numpy as np

from mplearn.anatomy import as_bodies
from mplearn.body import human_body
from mplearn.demonstrator import demonstrate
from mplearn.recording import FloatArray, ReadReport, Recording
from mplearn.sources import Stream

SCRIPT = ["BAR", "BAL"] * 3
RATE_HZ = 100.0


@cache
def segments() -> tuple[dict[str, FloatArray], dict[str, FloatArray]]:
    """Return where a person's bodies are, (T, 3) [m], and how they are turned, (T, 3, 3)."""
    tree = human_body().tree
    poses = [tree.forward(q) for q in demonstrate(SCRIPT, seed=3).posture.frames]
    places, turns = (np.array(each) for each in zip(*poses, strict=True))
    return (
        {name: places[:, i] for i, name in enumerate(tree.body_names)},
        {name: turns[:, i] for i, name in enumerate(tree.body_names)},
    )


def as_file(stream: Stream, frames: FloatArray, *, look: int | None = None) -> Recording:
    """Return what a file of the same frames is learned as: the places of a body.

    Args:
        stream: What the frames hold.
        frames: Shape (T, D), in metres, z up.
        look: The body is recognised in so many frames; in all where None.
    """
    assert stream.skeleton is not None
    report = ReadReport("file", RATE_HZ, stream.unit_m, "z")
    recording = Recording(
        frames, RATE_HZ, stream.channels, "file", skeleton=stream.skeleton, report=report
    )
    if look is None:
        return as_bodies([recording]).recordings[0]
    body = next(iter(as_bodies([recording.sliced(0, look)]).maps.values()))
    return body.apply(recording)
