"""Keep every motion that a learner closes: frames and primitive, a row each, in SQLite.

python examples/segments_to_sqlite.py

`mplearn.store` keeps a whole life of learning; this keeps only what you want of it. A segment's
frames are those of your own stream, `segment.start` to `segment.end`, so hold them until it closes.
"""

import sqlite3

import numpy as np

from mplearn import LearnerConfig, MotionLearner
from mplearn.demonstrator import demonstrate
from mplearn.learner import FrameBuffer, SegmentClosed

recording = demonstrate(["BAD", "BAU"] * 6, seed=1).recording
learner = MotionLearner(LearnerConfig(recording.channels, recording.rate_hz))
held = FrameBuffer(len(recording.channels))

kept = sqlite3.connect(":memory:")
kept.execute("create table motion (start integer, stop integer, primitive integer, frames blob)")
for frame in recording.frames:
    held.append(frame)
    for event in learner.learn_one(frame):
        if isinstance(event, SegmentClosed):
            start, end = event.segment.start, event.segment.end
            if event.placement is not None:  # something moved
                motion = held.take(start, end).astype(np.float32)
                row = (start, end, event.placement.node_id, motion.tobytes())
                kept.execute("insert into motion values (?, ?, ?, ?)", row)
            held.drop_before(end)

rows = kept.execute("select start, stop, primitive, frames from motion").fetchall()
start, stop, primitive, blob = rows[-1]
motion = np.frombuffer(blob, np.float32).reshape(stop - start, -1)
shown = recording.frames[start:stop].astype(np.float32)
assert np.array_equal(motion, shown, equal_nan=True)  # a hidden marker is NaN
print(f"{len(rows)} motions; the last, of primitive {primitive}: {motion.shape} of {motion.dtype}")
