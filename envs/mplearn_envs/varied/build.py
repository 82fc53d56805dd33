"""Make the varied library: ``python -m mplearn_envs.varied.build``, some ten minutes of a core.

Six people perform 900 motions each before the cameras, of a vocabulary of 138, in an order that
they have mostly in common (`mplearn.demonstrator.drawn_sequencing`). A `MotionLearner` watches
their markers, one after another, and learns, like any user's: nobody tells it where a motion ends,
or which it was. Then it learns no more, and recognises what all eight people do: so each has a
graph of what was seen to follow what. Of the two people of "test" nothing else is learned.

Kept are the primitives that the humanoid can perform, and of each person the ways that were seen
more than once and that lead back again. Names are those that the demonstrator gives to what is
recognised, as a person would on seeing it. Beside the library, ``facts.json`` holds how often what
followed what with each person, and what the humanoid makes of it: verdicts and times, so that an
environment begins at once.
"""

from __future__ import annotations

import json
from collections import Counter, defaultdict
from collections.abc import Collection
from dataclasses import dataclass, field, replace
from typing import Any

import networkx as nx
import numpy as np

from mplearn import LearnerConfig, MotionLearner
from mplearn.demonstrator import (
    PRIMITIVES,
    Demonstration,
    Person,
    demonstrate,
    drawn_sequencing,
    markov_script,
)
from mplearn.learner import Recognised, SegmentClosed
from mplearn.library import PrimitiveLibrary
from mplearn.recording import LabelledSegment, Segment
from mplearn_envs.data.build import RULES
from mplearn_envs.mechanics.reference import rest_reference
from mplearn_envs.robot import humanoid
from mplearn_envs.skills.repertoire import Repertoire
from mplearn_envs.skills.skills import Skills
from mplearn_envs.skills.soonest import performed

from .people import FACTS, PATH, SPLITS, Ways, graph_of

ORDER = 12  # what people have in common
RATE_HZ = 50.0
N_SHOWN = 900  # motions that are watched of each person
BALANCE = 2.0  # all primitives are shown about equally often
LEAST_SEEN = 2  # times that a person goes on in a way: once may be a mistake of the recogniser


@dataclass
class Seen:
    """What was recognised of a person.

    Attributes:
        ways: How often what followed what.
        called: What the demonstrator calls that which was recognised as a primitive, how often.
    """

    ways: Counter[tuple[int, int]] = field(default_factory=Counter)
    called: defaultdict[int, Counter[str]] = field(default_factory=lambda: defaultdict(Counter))


def order_of(person: int) -> dict[str, dict[str, float]]:
    """Return how likely a person goes on from each primitive to others, by name."""
    drawn = drawn_sequencing(
        np.random.default_rng(ORDER), person=np.random.default_rng((ORDER, person))
    )
    return {
        name: {other: weight / sum(row.values()) for other, weight in row.items()}
        for name, row in drawn.items()
    }


def shown_by(person: int, n_motions: int = N_SHOWN) -> Demonstration:
    """Return what a person performs before the cameras."""
    rng = np.random.default_rng((ORDER, person, 2))
    script = markov_script(n_motions, rng, order_of(person), BALANCE)
    who = Person.random(np.random.default_rng((ORDER, person, 3)), name=f"person-{person}")
    return demonstrate(script, person, person=who, rate_hz=RATE_HZ)


def taught(people: Collection[int], n_motions: int = N_SHOWN) -> MotionLearner:
    """Return a learner that has watched some people, one after another."""
    learner: MotionLearner | None = None
    for person in people:
        recording = shown_by(person, n_motions).recording
        config = LearnerConfig(recording.channels, RATE_HZ, scaffolding=False, tree=RULES)
        learner = learner or MotionLearner(config)
        for _ in learner.learn_recording(recording, at_once=len(recording.frames)):
            pass
    assert learner is not None
    return learner


def recognised(learner: MotionLearner, person: int, n_motions: int = N_SHOWN) -> Seen:
    """Return what a learner, which learns no more, recognises of a person."""
    shown, start = shown_by(person, n_motions), learner.n_frames
    learner.pause()
    seen, last, longest = Seen(), None, learner.config.longest_pause_s * RATE_HZ
    known: dict[Segment, int] = {}
    segments: list[Segment] = []
    for events in learner.learn_recording(shown.recording, at_once=len(shown.recording.frames)):
        segments += [event.segment for event in events if isinstance(event, SegmentClosed)]
        known |= {e.segment: e.primitive for e in events if isinstance(e, Recognised)}
    for segment in segments:
        id = known.get(segment)
        if id is None:  # what is unknown is no way
            last = None
            continue
        if last is not None and segment.start - last.end <= longest:
            seen.ways[known[last], id] += 1
        seen.called[id][_label(shown.truth, segment, start)] += 1
        last = segment
    return seen


def _label(truth: tuple[LabelledSegment, ...], segment: Segment, start: int) -> str:
    """Return the label that covers most of a segment, whose stream began at a frame."""
    low, high = segment.start - start, segment.end - start
    return max(truth, key=lambda known: min(known.end, high) - max(known.start, low)).label


def round_of(person: Seen, able: Collection[int]) -> list[tuple[int, int]]:
    """Return the ways of a person, among what the humanoid can perform, that lead back again.

    Of the largest part of the graph in which all is reached from everywhere: so nobody comes to a
    dead end.
    """
    ways = [
        (a, b)
        for (a, b), times in sorted(person.ways.items())
        if times >= LEAST_SEEN and a != b and a in able and b in able
    ]
    parts: list[set[int]] = list(nx.strongly_connected_components(nx.DiGraph(ways)))
    largest = max(parts, key=lambda part: (len(part), -min(part)))
    return [(a, b) for a, b in ways if a in largest and b in largest]


def build_varied(learner: MotionLearner) -> tuple[PrimitiveLibrary, list[Ways]]:
    """Return the primitives, with the transitions of the people of "train" together; all ways."""
    seen = [recognised(learner, person) for person in SPLITS["all"]]
    whole = learner.snapshot()
    skills = Skills(whole, humanoid())
    able = {id for id in whole.ids if skills.feasibility(id).feasible}
    ways = [[(a, b, each.ways[a, b]) for a, b in round_of(each, able)] for each in seen]
    kept = {id for of in ways for before, after, _ in of for id in (before, after)}
    called: defaultdict[int, Counter[str]] = defaultdict(Counter)
    for each in seen:
        for id, names in each.called.items():
            called[id] += names
    taken: Counter[str] = Counter()
    primitives = []
    for primitive in whole.primitives:
        if primitive.id in kept:
            name = PRIMITIVES[called[primitive.id].most_common(1)[0][0]].meaning
            taken[name] += 1
            name = name if taken[name] == 1 else f"{name} ({taken[name]})"
            primitives.append(replace(primitive, name=name, parent=None))
    together = [way for person in SPLITS["train"] for way in ways[person]]
    graph = graph_of(together, sorted(kept))
    library = replace(whole, primitives=tuple(primitives), graph=graph, tree=(), recogniser=None)
    return library, ways


def facts_of(library: PrimitiveLibrary, ways: list[Ways]) -> dict[str, Any]:
    """Return people's ways, and what the humanoid makes of the library."""
    repertoire = Repertoire(library, humanoid())
    skills = repertoire.skills
    first = [
        id
        for id in performed(repertoire, repertoire.entries(rest_reference(humanoid())))
        if all(any(before == id for before, *_ in of) for of in ways)
    ]
    edges = sorted({(before, after) for of in ways for before, after, _ in of})
    verdicts = [
        [id, v.speed, v.zmp_margin_m, v.torque_share, v.tempo, v.starts_up, v.ends_up]
        for id in library.ids
        for v in (skills.feasibility(id),)
    ]
    times = [[0, id, skills.transition_s(None, id)] for id in first]
    times += [[before, after, skills.transition_s(before, after)] for before, after in edges]
    return {
        "ways": ways,
        "starts": first,
        "verdicts": _rounded(verdicts),
        "durations_s": _rounded([[id, skills.duration_s(id)] for id in library.ids]),
        "times": _rounded(times),
    }


def _rounded(rows: list[list[Any]]) -> list[list[Any]]:
    return [[round(x, 6) if isinstance(x, float) else x for x in row] for row in rows]


def main() -> None:
    """Write the library and the facts into the package."""
    library, ways = build_varied(taught(SPLITS["train"]))
    library.save(PATH)
    facts = facts_of(PrimitiveLibrary.load(PATH), ways)
    FACTS.write_text(json.dumps(facts, separators=(",", ":")) + "\n", "utf-8")
    size = (PATH.stat().st_size + FACTS.stat().st_size) / 1024
    print(f"{PATH.name}, {FACTS.name}: {len(library)} primitives, {size:.0f} KiB")


if __name__ == "__main__":
    main()
