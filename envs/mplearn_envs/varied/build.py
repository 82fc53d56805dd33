"""Make the varied library: ``python -m mplearn_envs.varied.build``, one to two minutes.

Six people perform 220 motions each before the cameras, of a vocabulary of 138, in an order that
they have mostly in common (`mplearn.demonstrator.drawn_sequencing`). Their markers are observed
like any user's. What is shown is cut by the demonstrator's own truth, as by a teacher who says
where a motion ends and which it was; each kind becomes one hidden Markov model of all its
performances. Of the two people of "test" nothing is learned but in which order they perform.

Beside the library, ``facts.json`` holds how often what followed what with each person, and what
the humanoid makes of it: verdicts and times, so that an environment begins at once.
"""

from __future__ import annotations

import json
from collections import defaultdict
from collections.abc import Iterator
from typing import Any

import numpy as np

from mplearn.body import MotionObserver, feature_channels, robot_body
from mplearn.demonstrator import PRIMITIVES, Person, demonstrate, drawn_sequencing, markov_script
from mplearn.hmm import fit
from mplearn.library import Primitive, PrimitiveLibrary
from mplearn.recording import FloatArray
from mplearn_envs.mechanics.reference import rest_reference
from mplearn_envs.robot import humanoid
from mplearn_envs.skills.repertoire import Repertoire
from mplearn_envs.skills.soonest import performed

from .people import FACTS, PATH, SPLITS, Ways, graph_of

ORDER = 12  # what people have in common
RATE_HZ = 50.0
N_SHOWN = 220  # motions that are watched of each person of "train"
N_COUNTED = 2000  # motions of which the order is known, of each person
BALANCE = 2.0  # all primitives are shown about equally often
N_STATES = 10


def order_of(person: int) -> dict[str, dict[str, float]]:
    """Return how likely a person goes on from each primitive to others, by name."""
    drawn = drawn_sequencing(
        np.random.default_rng(ORDER), person=np.random.default_rng((ORDER, person))
    )
    return {
        name: {other: weight / sum(row.values()) for other, weight in row.items()}
        for name, row in drawn.items()
    }


def names() -> tuple[str, ...]:
    """Return the primitives' names, in the order of their ids, from 1."""
    known = order_of(0)
    return tuple(name for name in PRIMITIVES if name in known)


def count_ways(person: int) -> Ways:
    """Return what follows what how often with a person, by id: what is to be expected, at least 1.

    Of whoever performs `N_COUNTED` motions for ever by their own order.
    """
    order, known = order_of(person), names()
    ids = {name: id for id, name in enumerate(known, start=1)}
    step = np.zeros((len(known), len(known)))
    for name, row in order.items():
        for other, probability in row.items():
            step[ids[name] - 1, ids[other] - 1] = probability
    share = np.full(len(known), 1.0 / len(known))
    for _ in range(2000):  # half a step each time: no cycle keeps it from settling
        share = 0.5 * (share + share @ step)
    times = np.maximum(np.rint(N_COUNTED * share[:, None] * step), 1.0)
    return [(int(a) + 1, int(b) + 1, int(times[a, b])) for a, b in np.argwhere(step > 0)]


def performances(person: int) -> Iterator[tuple[str, FloatArray]]:
    """Yield what is shown by a person: the primitive's name, and features of shape (T, 33)."""
    rng = np.random.default_rng((ORDER, person, 2))
    script = markov_script(N_SHOWN, rng, order_of(person), BALANCE)
    who = Person.random(np.random.default_rng((ORDER, person, 3)), name=f"person-{person}")
    shown = demonstrate(script, person, person=who, rate_hz=RATE_HZ)
    observer = MotionObserver(shown.recording.marker_names, RATE_HZ)
    frames = np.concatenate([observer.update(frame) for frame in shown.recording.frames])
    for segment in shown.truth:
        if segment.label and segment.end <= len(frames):
            yield segment.label, frames[segment.start : segment.end]


def build_varied() -> PrimitiveLibrary:
    """Return the primitives, with the transitions of the people of "train" together."""
    shown: defaultdict[str, list[FloatArray]] = defaultdict(list)
    for person in SPLITS["train"]:
        for name, frames in performances(person):
            shown[name].append(frames)
    primitives = tuple(
        Primitive.from_exemplars(
            id, fit(shown[name], N_STATES), shown[name], RATE_HZ, name=PRIMITIVES[name].meaning
        )
        for id, name in enumerate(names(), start=1)
    )
    ways = [way for person in SPLITS["train"] for way in count_ways(person)]
    channels = feature_channels(robot_body())
    return PrimitiveLibrary(
        primitives, graph_of(ways, len(primitives)), channels, RATE_HZ, body="robot"
    )


def facts_of(library: PrimitiveLibrary) -> dict[str, Any]:
    """Return people's ways, and what the humanoid makes of the library."""
    ways = [count_ways(person) for person in SPLITS["all"]]
    repertoire = Repertoire(library, humanoid())
    skills = repertoire.skills
    refused = [library[id].name for id in library.ids if not skills.feasibility(id).feasible]
    if refused:
        raise SystemExit(f"the humanoid cannot perform {refused}: choose other motions")
    first = performed(repertoire, repertoire.entries(rest_reference(humanoid())))
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
    library = build_varied()
    library.save(PATH)
    facts = facts_of(PrimitiveLibrary.load(PATH))
    FACTS.write_text(json.dumps(facts, separators=(",", ":")) + "\n", "utf-8")
    size = (PATH.stat().st_size + FACTS.stat().st_size) / 1024
    print(f"{PATH.name}, {FACTS.name}: {len(library)} primitives, {size:.0f} KiB")


if __name__ == "__main__":
    main()
