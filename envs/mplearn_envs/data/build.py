"""Make the built-in library: ``python -m mplearn_envs.data.build`` writes ``default.mplearn``.

The demonstrator performs the paper's 22 primitives, a `MotionLearner` watches its markers and
learns them, like any user's. Only what acting needs is kept (no recogniser), and the primitives get
the names that the demonstrator gives them, as a person would name them on seeing them.
"""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from dataclasses import replace
from pathlib import Path

import numpy as np

from mplearn import LabelledSegment, LearnerConfig, MotionLearner, PrimitiveLibrary, Segment
from mplearn.demonstrator import PRIMITIVES, demonstrate, markov_script
from mplearn.learner import PrimitiveBorn, Recognised
from mplearn.tree import TreeConfig

PATH = Path(__file__).parent / "default.mplearn"
SEED = 1
N_MOTIONS = 200
BALANCE = 0.5  # all primitives are shown about equally often
RULES = replace(
    TreeConfig(),
    sequence_share=0.0,
    ignore_fragments=False,
    drop_fragments=False,
    max_born=math.inf,
)
"""Of births, when the embedded libraries were learned: they stay what they were."""


def build_default() -> PrimitiveLibrary:
    """Return the built-in library."""
    script = markov_script(N_MOTIONS, np.random.default_rng(SEED), balance=BALANCE)
    demonstration = demonstrate(script, SEED)
    recording = demonstration.recording
    config = LearnerConfig(recording.channels, recording.rate_hz, scaffolding=False, tree=RULES)
    learner = MotionLearner(config)
    votes: defaultdict[int, Counter[str]] = defaultdict(Counter)
    for event in (*learner.learn_many(recording.frames), *learner.end_stream()):
        if isinstance(event, (Recognised, PrimitiveBorn)):
            label = _label(demonstration.truth, event.segment)
            votes[event.primitive][label] += 1
    library = replace(learner.snapshot(), recogniser=None)
    for id in library.ids:
        meaning = PRIMITIVES[votes[id].most_common(1)[0][0]].meaning
        if meaning not in library:
            library = library.rename(id, meaning)
    return library


def _label(truth: tuple[LabelledSegment, ...], segment: Segment) -> str:
    """Return the label that covers most of a segment."""
    return max(
        truth, key=lambda known: min(known.end, segment.end) - max(known.start, segment.start)
    ).label


def main() -> None:
    """Write the library into the package."""
    library = build_default()
    library.save(PATH)
    print(f"{PATH.name}: {len(library)} primitives, {PATH.stat().st_size / 1024:.0f} KiB")


if __name__ == "__main__":
    main()
