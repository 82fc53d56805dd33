"""Follow a learner from another program: its events as one line of JSON each.

python examples/events_as_json.py
"""

import json

from mplearn import LearnerConfig, MotionLearner
from mplearn.demonstrator import demonstrate
from mplearn.learner import Recognised, SegmentClosed, TransitionSeen

recording = demonstrate(["BAD", "BAU"] * 6, seed=1).recording
learner = MotionLearner(LearnerConfig(recording.channels, recording.rate_hz))
for events in learner.learn_recording(recording):
    for event in events:
        said: dict[str, object] = {"event": type(event).__name__}
        match event:
            case SegmentClosed(segment):
                said |= {"start": segment.start, "end": segment.end, "still": segment.still}
            case Recognised(segment, primitive, distance):
                said |= {"start": segment.start, "primitive": primitive, "distance": distance}
            case TransitionSeen(_, previous, primitive, count):
                said |= {"from": previous, "to": primitive, "count": count}
            case _:
                continue
        print(json.dumps(said, allow_nan=False))
