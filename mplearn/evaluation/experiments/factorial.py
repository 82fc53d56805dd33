"""Whether added chains tell neighbouring motions apart better than one longer chain does."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence

import numpy as np

from ...body import view_of
from ...hmm import MotionModel, distance, fit, fit_factorial, needs_more_chains
from ...hmm.factorial.fit import margins
from ...recording import FloatArray, Recording
from ..executions import split_repetitions
from ..observing import observe
from ..table import Table, percent
from .sessions import by_person

N_STATES = 4
RATE_HZ = 25.0  # enough for whole motions, and the product of chains costs its states squared
FLOOR = 0.4  # of the standard deviation over all motions, the smallest of a state
Motions = Mapping[str, list[FloatArray]]


def factorial_table(takes: Iterable[Recording], n_pairs: int = 5) -> Table:
    """Compare models on the pairs of classes whose single chains are nearest to each other.

    Args:
        takes: Recordings of markers with labelled repetitions, of any number of people.
        n_pairs: Pairs a person, and of all people together.

    Returns:
        One row a kind of model, for people one by one and for all together.

    Example:
        >>> import numpy as np
        >>> from mplearn import LabelledSegment, Recording
        >>> wave = 1 - np.cos(2 * np.pi * np.arange(400) / 100)  # four repetitions
        >>> def take(name, size, person="anna"):
        ...     labels = tuple(LabelledSegment(100 * k, 100 * k + 100, name) for k in range(4))
        ...     frames = size * wave[:, None]
        ...     return Recording(frames, 100.0, ("elbow",), name=name, labels=labels, person=person)
        >>> table = factorial_table([take("up", 1.0), take("out", -1.0)], n_pairs=1)
        >>> [row[0] for row in table.rows][:2]
        ['people, one by one', 'people, one by one']
    """
    by_class: dict[str, dict[str, list[FloatArray]]]
    by_class = defaultdict(lambda: defaultdict(list))
    for person, own in by_person(takes).items():
        for take in split_repetitions(own):
            features = observe(take)
            frames = view_of(features.channels).see(features.frames)
            step = max(1, round(take.rate_hz / RATE_HZ))
            for label in take.labels:
                motion = frames[label.start : label.end : step]
                if len(motion) >= 2 * N_STATES:
                    by_class[person][label.label].append(motion)
                    by_class["all people"][label.label].append(motion)
    everyone = by_class.pop("all people")
    rows = _rows("people, one by one", list(by_class.values()), n_pairs)
    if len(by_class) > 1:
        rows += _rows("all people together", [everyone], n_pairs)
    return Table(
        title="Neighbouring motions told apart by more chains, or by a longer one",
        columns=(
            "motions of",
            "model",
            "parameters a channel",
            "told apart",
            "margin / its spread",
            "margin per frame",
            "pairs that ask for a chain",
        ),
        rows=tuple(rows),
        note=(
            f"The {n_pairs} pairs of classes whose {N_STATES}-state chains are nearest, fitted to "
            "every second execution and tried on the others. Told apart: executions that their own "
            "model explains better than the other does; the margin is in nat. A pair asks for a "
            "chain where the mean margin of what was learned is below twice its spread."
        ),
    )


def _rows(whose: str, groups: Sequence[Motions], n_pairs: int) -> list[tuple[str, ...]]:
    outcomes: dict[str, list[tuple[float, float, float, bool]]] = defaultdict(list)
    for motions in groups:
        motions = {name: own for name, own in motions.items() if len(own) > 1}
        if len(motions) < 2:
            continue
        pooled = np.concatenate([frames for own in motions.values() for frames in own])
        floor = (FLOOR * pooled.std(axis=0)) ** 2 + 1e-8
        learned = {name: own[::2] for name, own in motions.items()}
        unseen = {name: own[1::2] for name, own in motions.items()}
        for a, b in _nearest(learned, floor, n_pairs):
            for kind, (_, make) in _kinds(floor).items():
                model_a, model_b = make(learned[a]), make(learned[b])
                each = margins(model_a, unseen[a], model_b) + margins(model_b, unseen[b], model_a)
                asks = needs_more_chains(model_a, learned[a], model_b, learned[b])
                right = float(np.mean(np.array(each) > 0))
                mean = float(np.mean(each))
                spread = float(np.std(each))
                apart = mean / spread if spread > 0 else np.inf
                outcomes[kind].append((right, apart, mean, asks))
    sizes = {kind: size for kind, (size, _) in _kinds(np.ones(1)).items()}
    rows: list[tuple[str, ...]] = []
    for kind, values in outcomes.items():
        right, ratio, margin, asks = np.mean(values, axis=0)
        cells = percent(right), f"{ratio:.2f}", f"{margin:.1f} nat", percent(asks, 0)
        rows.append((whose, kind, str(sizes[kind]), *cells))
    return rows


def _kinds(
    floor: FloatArray,
) -> dict[str, tuple[int, Callable[[Sequence[FloatArray]], MotionModel]]]:
    """Models to compare: their numbers of parameters a channel, and how each is fitted."""
    n = N_STATES
    return {
        f"one chain of {n}": (2 * n, lambda s: fit(s, n, variance_floor=floor)),
        f"one chain of {2 * n}": (4 * n, lambda s: fit(s, 2 * n, variance_floor=floor)),
        f"one chain of {n}, one variance": (
            n + 1,
            lambda s: fit_factorial(s, (n,), variance_floor=floor),
        ),
        f"one chain of {2 * n}, one variance": (
            2 * n + 1,
            lambda s: fit_factorial(s, (2 * n,), variance_floor=floor),
        ),
        f"two chains of {n}, one variance": (
            2 * n + 1,
            lambda s: fit_factorial(s, (n, n), variance_floor=floor),
        ),
    }


def _nearest(learned: Motions, floor: FloatArray, n_pairs: int) -> list[tuple[str, str]]:
    """Return the pairs of classes whose models are nearest to each other."""
    models = {name: fit(own, N_STATES, variance_floor=floor) for name, own in learned.items()}
    names = sorted(models)
    apart = {
        (a, b): distance(models[a], learned[a], models[b], learned[b])
        for i, a in enumerate(names)
        for b in names[i + 1 :]
    }
    return sorted(apart, key=lambda pair: (apart[pair], pair))[:n_pairs]
