"""How a person's postures usually deviate from those of others."""

from __future__ import annotations

import numpy as np

from ...recording import FloatArray, IntArray

_ROUNDS = 3  # means of primitives and people's offsets are found in turn


def offsets_of(
    postures: FloatArray, people: IntArray, n_people: int, groups: IntArray, prior: float
) -> FloatArray:
    """Return by how much each person's postures deviate from the others' in the same primitives.

    Args:
        postures: Mean posture of each leaf, shape (n, D).
        people: Whose leaf each is, shape (n,).
        n_people: How many people there are.
        groups: The primitive of each leaf, any numbers, shape (n,).
        prior: Shared primitives for which half of it is believed.

    Returns:
        Shape (n_people, D); zero for a person who shares nothing.
    """
    _, place = np.unique(groups, return_inverse=True)
    whose = np.zeros((n_people, place.max(initial=-1) + 1))  # leaves of each person in each
    np.add.at(whose, (people, place), 1.0)
    shared = ((whose > 0).sum(axis=0) > 1)[place]
    own, place = people[shared], place[shared]
    offsets = np.zeros((n_people, postures.shape[1]))
    if not len(own):
        return offsets
    member = np.equal.outer(np.unique(place), place).astype(np.float64)  # (groups, n)
    person = np.equal.outer(np.arange(n_people), own).astype(np.float64)  # (people, n)
    seen = postures[shared]
    at = np.unique(place, return_inverse=True)[1]
    for _ in range(_ROUNDS):
        means = member @ (seen - offsets[own]) / member.sum(axis=1)[:, None]
        offsets = person @ (seen - means[at]) / (person.sum(axis=1) + prior)[:, None]
    return offsets
