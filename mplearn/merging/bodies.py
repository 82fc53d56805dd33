"""Bodies that are known from different streams: who is the same person?"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace

import numpy as np

from ..body.observer.known_bodies import BodiesState, KnownBodies
from ..recording import FloatArray


def merge_bodies(
    first: KnownBodies,
    second: KnownBodies,
    known: Mapping[int, int],
    apart: Collection[int],
) -> tuple[BodiesState, dict[int, int]]:
    """Return all known bodies together, and the number there of each person of the second.

    Who is the same is found one to one, the surest first, but for what was told; all others are new
    to the first, however many people it tells apart. Neither changes.

    Args:
        first: Keeps its numbers.
        second: Gets others.
        known: Number in the first of people of the second, as far as that was told.
        apart: People of the first who are nobody else of the second, as was told.

    Example:
        >>> import numpy as np
        >>> from mplearn.body.observer.known_bodies import IdentityConfig
        >>> upper_arm, thigh = 0.30, 0.42  # [m]
        >>> first, second = (KnownBodies(np.full(2, 0.01), IdentityConfig()) for _ in range(2))
        >>> first.n_people = second.n_people = 1
        >>> for _ in range(20):
        ...     first.learn(0, np.array([upper_arm, thigh]))
        ...     second.learn(0, np.array([0.9 * upper_arm, 0.9 * thigh]))  # a smaller person
        >>> merged, numbers = merge_bodies(first, second, {}, ())
        >>> merged.n_people, numbers
        (2, {0: 1})
    """
    mine, theirs, config = first.state(), second.state(), first.config
    numbers = dict(known)
    free = [i for i in range(mine.n_people) if i not in apart and i not in numbers.values()]
    others = [j for j in range(theirs.n_people) if j not in numbers]
    pairs = _likenesses(first, mine, theirs, [(i, j) for i in free for j in others])
    for likeness, i, j in sorted(pairs, reverse=True):
        if likeness > config.caution and j not in numbers and i not in numbers.values():
            numbers[j] = i
    new = [j for j in range(theirs.n_people) if j not in numbers]
    numbers |= {j: mine.n_people + k for k, j in enumerate(new)}
    n_people = mine.n_people + len(new)
    squares, counts = _summed(first, mine, theirs)
    more = max(0, n_people - len(mine.means))
    merged = replace(
        mine,
        n_people=n_people,
        means=np.pad(mine.means, ((0, more), (0, 0)), constant_values=np.nan),
        blocks=np.pad(mine.blocks, (0, more)),
        squares=squares,
        counts=counts,
    )
    for j, i in numbers.items():
        _add(merged, i, theirs.means[j], float(theirs.blocks[j]))
    return merged, numbers


def _summed(
    bodies: KnownBodies, mine: BodiesState, theirs: BodiesState
) -> tuple[FloatArray, FloatArray]:
    """Return squares and counts of both together; what is assumed counts once."""
    squares, counts = bodies.given
    return mine.squares + (theirs.squares - squares), mine.counts + (theirs.counts - counts)


def _likenesses(
    bodies: KnownBodies, mine: BodiesState, theirs: BodiesState, pairs: list[tuple[int, int]]
) -> list[tuple[float, int, int]]:
    """Return for pairs how much better one body than two explains what was seen here and there.

    In nat, before the number of the one here and that of the one there.
    """
    if not pairs:
        return []
    squares, counts = _summed(bodies, mine, theirs)
    variance = squares / counts
    people = np.concatenate((mine.means[: mine.n_people], theirs.means[: theirs.n_people]))
    usual = np.nanmean(people, axis=0)
    anybody = bodies.anybody(usual) + variance
    slips = bodies.config.slips
    found = []
    for i, j in pairs:
        one, two = mine.means[i], theirs.means[j]
        doubt = 1.0 + 4.0 / max(mine.blocks[i], 1.0) + 4.0 / max(theirs.blocks[j], 1.0)
        same = [bodies.fit(a, b, doubt * variance, slips) for a, b in ((one, two), (two, one))]
        new = [bodies.fit(each, usual, anybody, 0.5) for each in (one, two)]
        likeness = 0.5 * (sum(same) - sum(new))
        if likeness == likeness:  # of who came and went at once no distance is known
            found.append((likeness, i, j))
    return found


def _add(merged: BodiesState, person: int, mean: FloatArray, blocks: float) -> None:
    """Take over the second's mean of a person into arrays that are still being made."""
    own, before = merged.means[person], merged.blocks[person]
    both = (own == own) & (mean == mean) & (before > 0) & (blocks > 0)
    share = blocks / max(before + blocks, 1.0)
    step = np.where(both, mean - own, 0.0)
    merged.squares[:] += step**2 * before * share
    merged.means[person] = np.where(np.isnan(own), mean, own + share * step)
    merged.blocks[person] = before + blocks
