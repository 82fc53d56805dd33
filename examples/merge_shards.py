"""Learn the parts of a corpus apart, as on several machines, and make one learner of them.

python examples/merge_shards.py
"""

from mplearn import LearnerConfig, MotionLearner
from mplearn.demonstrator import Person, demonstrate
from mplearn.merging import merge_learners

shards = []
for seed, person in ((1, Person(height_m=1.6)), (2, Person(height_m=1.85))):
    recording = demonstrate(["BAD", "BAU"] * 6, seed=seed, person=person).recording
    learner = MotionLearner(LearnerConfig(recording.channels, recording.rate_hz))
    learner.learn_many(recording.frames)
    learner.end_stream()
    print(f"shard {seed}: {len(learner.snapshot())} primitives")
    shards.append(learner)

merged = merge_learners(shards)
library = merged.snapshot()
print(f"together: {len(library)} primitives of {len(merged.tree.people)} people")
