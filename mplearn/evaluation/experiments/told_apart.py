"""Contents of many short takes told apart, in one style and in several in one stream."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Sequence
from itertools import combinations

import numpy as np

from ...errors import MPLearnError
from ...learner import LearnerConfig, MotionLearner, learnable_rate
from ...mocap import resample
from ...recording import Recording
from ..contents import content_of, merged
from ..hearing import hear
from ..ownership import Heard, OwnershipRates, rate_ownership
from ..partitions import adjusted_rand
from ..table import Table, percent

SHARED = 0.2  # of a primitive's segments: a content with fewer only strays into it
NOTE = (
    "All takes in one stream, in an order that is drawn, each a stretch of its own, learned "
    "on-line from nothing. The content and the style are those that the take's name tells. As "
    "named: each content is a class. Merged: walking and walking while turning are one, for they "
    "are nearly one motion relative to the pelvis; so are raising and waving of the same hand, for "
    "waving begins with raising. Owned, purity, inside, recognised, false positives, "
    "demonstrations: as for activities. Covered: share of the moving time in any primitive at the "
    "end. ARI: adjusted Rand index of classes against primitives, over the segments in primitives; "
    "a class that is several primitives, such as both halves of a cycle, lowers it. Shared: pairs "
    f"of classes that each have {percent(SHARED, 0)} of the segments of one primitive, and how "
    "many such primitives."
)


def content_table(takes: Sequence[Recording], seed: int = 0) -> Table:
    """Learn takes whose names tell their contents: each style by itself, then all together.

    Args:
        takes: Takes of the same channels; those whose names tell nothing are left out.
        seed: Seed of the order.

    Returns:
        For each style, and for all, a row for contents as named and one for merged ones.

    Example:
        >>> import numpy as np
        >>> from mplearn import Recording
        >>> lift = np.sin(np.linspace(0, np.pi, 80)) ** 2
        >>> def take(name, size, n):
        ...     frames = np.outer(size * lift, [1.0, 0.5])
        ...     return Recording(frames, 50.0, ("x", "y"), name=f"dataset-2_{name}_active_{n:03}")
        >>> shown = {"bow": 1.0, "wave-left-hand": -1.0}
        >>> takes = [take(name, shown[name], n) for name in shown for n in range(1, 5)]
        >>> [row[0] for row in content_table(takes).rows]
        ['active', 'active']
    """
    told = [(take, content) for take in takes if (content := content_of(take.name))]
    styles = sorted({content.style for _, content in told})
    groups = [(style, [t for t, content in told if content.style == style]) for style in styles]
    if len(styles) > 1:
        groups.append((" + ".join(styles), [take for take, _ in told]))
    rows = []
    left_out: dict[str, MPLearnError] = {}
    for style, own in groups:
        order = np.random.default_rng(seed).permutation(len(own))
        heard = _hear([own[i] for i in order], left_out)
        for name, class_of in (("as named", str), ("merged", merged)):
            rows.append((style, str(len(heard)), name, *_cells(_rate(heard, class_of))))
    unlike = "; ".join(f"{name} ({error})" for name, error in left_out.items())
    return Table(
        "Contents told apart",
        (
            "styles",
            "takes",
            "contents",
            "primitives",
            "owned",
            "purity",
            "inside",
            "covered",
            "recognised",
            "false positives",
            "ARI",
            "demonstrations",
            "shared",
        ),
        tuple(rows),
        f"{NOTE} Left out: {unlike}." if unlike else NOTE,
    )


def _hear(
    takes: Iterable[Recording], left_out: dict[str, MPLearnError]
) -> list[tuple[Recording, Heard]]:
    """Learn takes one after another; what cannot be learned is put into ``left_out``."""
    learner: MotionLearner | None = None
    heard = []
    for take in takes:
        try:
            if learner is None:
                learner = MotionLearner(LearnerConfig(take.channels, learnable_rate(take.rate_hz)))
            take = resample(take, learner.config.rate_hz)
            heard.append((take, hear(learner, take)))
        except MPLearnError as error:  # the others can be learned nevertheless
            left_out[take.name] = error
    return heard


def _rate(
    heard: Iterable[tuple[Recording, Heard]], class_of: Callable[[str], str]
) -> OwnershipRates:
    labelled = []
    for take, said in heard:
        content = content_of(take.name)
        label = class_of(content.content) if content else ""
        labelled.append((np.full(len(take), label, dtype=f"<U{max(1, len(label))}"), said))
    return rate_ownership(labelled)


def _cells(rates: OwnershipRates) -> tuple[str, ...]:
    classes = np.array([label for label, _ in rates.shown])
    nodes = np.array([node for _, node in rates.shown])
    return (
        str(len(rates.primitives)),
        f"{len(rates.owned)} of {len(rates.activities)}",
        percent(rates.purity),
        percent(rates.inside),
        percent(rates.covered),
        percent(rates.recognised),
        percent(rates.false_positive),
        f"{adjusted_rand(classes, nodes):.2f}" if len(nodes) else "-",
        f"{rates.mean_demonstrations:.1f}",
        ", ".join(f"{a} + {b} ({n})" for (a, b), n in _shared(rates.shown)) or "-",
    )


def _shared(shown: Iterable[tuple[str, int]]) -> list[tuple[tuple[str, str], int]]:
    """Return the pairs of classes that share primitives, and how many, the most first."""
    votes: dict[int, Counter[str]] = defaultdict(Counter)
    for label, node in shown:
        votes[node][label] += 1
    pairs: Counter[tuple[str, str]] = Counter()
    for each in votes.values():
        many = sorted(label for label, n in each.items() if n >= SHARED * each.total())
        pairs.update((a, b) for a, b in combinations(many, 2))
    return pairs.most_common()
