"""Watch a person, frame by frame, and learn what there is to learn.

python examples/learn_frame_by_frame.py
"""

from mplearn import LearnerConfig, MotionLearner
from mplearn.demonstrator import demonstrate
from mplearn.learner import PrimitiveBorn, Recognised

# A synthetic person performs before cameras; open_recording("take.c3d") would do as well.
script = ["BAD", "BAU", "SQD", "SQR"] * 5
recording = demonstrate(script, seed=1).recording

learner = MotionLearner(LearnerConfig(recording.channels, recording.rate_hz))
for frame in recording.frames:
    for event in learner.learn_one(frame):
        match event:
            case PrimitiveBorn(segment, primitive, exemplars):
                at = segment.end / recording.rate_hz
                print(f"{at:5.1f} s  primitive {primitive} learned from {exemplars} demonstrations")
            case Recognised(segment, primitive, distance):
                at = segment.end / recording.rate_hz
                print(f"{at:5.1f} s  primitive {primitive} recognised, {distance:.2f} nat away")
learner.end_stream()

library = learner.snapshot()
print(f"{len(library)} primitives; after each, most likely:")
for primitive in library.primitives:
    for following in library.predict_next([primitive.id], k=1):
        print(f"  {primitive.name} -> {library[following.id].name} ({following.probability:.2f})")
