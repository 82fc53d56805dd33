"""Follow a learner from another program: its events as one line of JSON each.

python examples/events_as_json.py
"""

import json

from mplearn import LearnerConfig, MotionLearner
from mplearn.demonstrator import demonstrate
from mplearn.learner import SegmentClosed, plain_event

recording = demonstrate(["BAD", "BAU"] * 6, seed=1).recording
learner = MotionLearner(LearnerConfig(recording.channels, recording.rate_hz))
for events in learner.learn_recording(recording):
    for event in events:
        if not isinstance(event, SegmentClosed):  # every event is a value; choose what you send
            print(json.dumps(plain_event(event, recording.rate_hz), allow_nan=False))
