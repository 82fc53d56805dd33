"""How far two segments are apart: the one measure that tree, search, rejection and novelty go by.

A distance of your own derives from `Distance`, demands one method, and joins by one line:

    register_distance("mine", MyDistance)
    TreeConfig(distance="mine")
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from functools import cache
from typing import NamedTuple

import numpy as np

from ..errors import InvalidValueError
from ..hmm.kernels import log_likelihood
from ..maths.compiling import njit
from ..maths.sums import LANES, squares_tile
from ..plugins import join_installed
from ..recording import FloatArray, IntArray
from .config import TreeConfig

_N_DRAWS = 8  # sequences that `MonteCarloDistance` generates of each model
_SEED = 20120301


class Exemplar(NamedTuple):
    """A segment, normalised as it is compared, and its model.

    Attributes:
        columns: Points, shape (D, P).
        means: Shape (N, D).
        variances: Shape (N, D).
        log_norms: Log of what normalises the Gaussian of each state, shape (N,).
        log_stay: Shape (N,).
        log_next: Shape (N,).
        own: Log-likelihood of the points under the model, shape ().
        duration: How long the segment lasts [frame], shape ().
        extent: How far it is from its mean posture held still, a length, shape ().

    Example:
        >>> import numpy as np
        >>> from mplearn.tree import PrimitiveTree, TreeConfig
        >>> tree = PrimitiveTree(TreeConfig(), n_channels=2, rate_hz=100.0)
        >>> lift = np.outer(np.sin(np.linspace(0, np.pi, 60)), [1.0, 0.5])
        >>> placed = [tree.insert(k * lift) for k in (1.0, 1.01, 0.99, -1.0, -1.01)]
        >>> exemplar = tree.bank[0]
        >>> float(exemplar.duration), len(exemplar.columns) == len(exemplar.means[0])
        (60.0, True)
    """

    columns: FloatArray
    means: FloatArray
    variances: FloatArray
    log_norms: FloatArray
    log_stay: FloatArray
    log_next: FloatArray
    own: FloatArray
    duration: FloatArray
    extent: FloatArray


class Distance(ABC):
    """How far segments are apart.

    `divergence` is what a distance is named after, and what `Match.distance` reports. The rules
    add, average and compare `length`, which should grow linearly with the difference of postures.

    Args:
        config: Rules of the tree; ``power`` makes a length of a divergence.

    Example:
        >>> from mplearn.tree import TreeConfig
        >>> likelihood = LikelihoodDistance(TreeConfig())
        >>> float(likelihood.length(9.0)), likelihood.divergence_of(3.0)
        (3.0, 9.0)
    """

    def __init__(self, config: TreeConfig) -> None:
        self.power = config.power

    @abstractmethod
    def divergence(
        self, exemplar: Exemplar, others: Exemplar, rows: IntArray, weights: FloatArray
    ) -> FloatArray:
        """Return how far an exemplar is from others, shape (k,).

        It must be symmetric, 0 between equal exemplars, and deterministic.

        Args:
            exemplar: The one.
            others: Many, stacked: each array has one axis more, in front.
            rows: Which of them, shape (k,).
            weights: Weight of each point, shape (P,).
        """

    def pairwise(self, exemplars: Exemplar, others: Exemplar, weights: FloatArray) -> FloatArray:
        """Return how far each of some exemplars is from the one of others beside it, shape (n,).

        Args:
            exemplars: Many, stacked.
            others: As many.
            weights: Weight of each point, shape (P,).
        """
        found = np.empty(len(exemplars.own))
        for k in range(len(found)):
            one = Exemplar(*(part[k, ...] for part in exemplars))
            found[k] = self.divergence(one, others, np.array([k]), weights)[0]
        return found

    def length(self, divergence: FloatArray | float) -> FloatArray:
        """Return divergences on the scale of the rules; what is below 0 by chance counts as 0."""
        return np.asarray(np.maximum(divergence, 0.0) ** self.power)

    def divergence_of(self, length: float) -> float:
        """Return the divergence that has this length."""
        return float(length ** (1 / self.power))


class LikelihoodDistance(Distance):
    """The symmetric likelihood distance [nat a frame] [Kulic2012, eq. 5], on training sequences.

    Each direction is ``[log P(O | own) - log P(O | other)] / T``; the segments themselves stand for
    generated sequences: cheaper, and without sampling noise.

    Example:
        >>> from mplearn.tree import TreeConfig, make_distance
        >>> distance = make_distance(TreeConfig(power=0.5))
        >>> isinstance(distance, LikelihoodDistance), float(distance.length(9.0))  # its root
        (True, 3.0)
    """

    def divergence(
        self, exemplar: Exemplar, others: Exemplar, rows: IntArray, weights: FloatArray
    ) -> FloatArray:
        """Return eq. 5 in both directions, averaged, per unit of weight."""
        return _likelihood(exemplar, others, rows, weights)

    def pairwise(self, exemplars: Exemplar, others: Exemplar, weights: FloatArray) -> FloatArray:
        """Return the divergences of exemplars from those beside them, all in one loop."""
        return _pairwise_likelihood(exemplars, others, weights)


class MonteCarloDistance(Distance):
    """The symmetric likelihood distance as the paper prints it: on sequences that models generate.

    Every model is sampled with the same random numbers, so that the distance is symmetric,
    deterministic, and the same in a tree, in a recogniser and in a stored library.

    Example:
        >>> import numpy as np
        >>> from mplearn.tree import PrimitiveTree, TreeConfig
        >>> config = TreeConfig(distance="monte_carlo", n_sampled=64)  # as the paper prints it
        >>> tree = PrimitiveTree(config, n_channels=2, rate_hz=100.0)
        >>> lift = np.outer(np.sin(np.linspace(0, np.pi, 60)), [1.0, 0.5])
        >>> placed = [tree.insert(k * lift) for k in (1.0, 1.01, 0.99, -1.0, -1.01, -0.99)]
        >>> len(tree.leaves)
        2
    """

    def __init__(self, config: TreeConfig) -> None:
        super().__init__(config)
        self._n_points = config.normalisation.n_points
        self._moves = np.random.default_rng(_SEED).random((_N_DRAWS, self._n_points))

    def divergence(
        self, exemplar: Exemplar, others: Exemplar, rows: IntArray, weights: FloatArray
    ) -> FloatArray:
        """Return eq. 5 in both directions, averaged over draws, per unit of weight."""
        width = exemplar.means.shape[1]
        noise = np.random.default_rng(_SEED).standard_normal((_N_DRAWS, width, self._n_points))
        return _monte_carlo(exemplar, others, rows, weights, self._moves, noise)


ENTRY_POINTS = "mplearn.distances"
"""Group of the entry points by which an installed package brings distances of its own."""

#: Distances by the name that `TreeConfig.distance` gives; see `register_distance`.
_KINDS: dict[str, Callable[[TreeConfig], Distance]] = {
    "likelihood": LikelihoodDistance,
    "monte_carlo": MonteCarloDistance,
}


def register_distance(name: str, kind: Callable[[TreeConfig], Distance]) -> None:
    """Let `TreeConfig.distance` name a distance of one's own.

    A library that was learned by it needs it registered where the library is opened: by this, or
    by an entry point of the group ``mplearn.distances`` of an installed package.

    Raises:
        InvalidValueError: The name is taken by another.

    Example:
        >>> from mplearn.tree import TreeConfig, make_distance
        >>> class Doubled(LikelihoodDistance):
        ...     def divergence(self, exemplar, others, rows, weights):
        ...         return 2.0 * super().divergence(exemplar, others, rows, weights)
        >>> register_distance("doubled", Doubled)
        >>> type(make_distance(TreeConfig(distance="doubled"))).__name__
        'Doubled'
    """
    if _KINDS.setdefault(name, kind) is not kind:
        raise InvalidValueError(f"there is a distance {name!r} already")


def make_distance(config: TreeConfig) -> Distance:
    """Return the distance that a configuration names.

    Raises:
        InvalidValueError: There is none of that name.

    Example:
        >>> type(make_distance(TreeConfig())).__name__
        'LikelihoodDistance'
    """
    _load_entry_points()
    if config.distance not in _KINDS:
        raise InvalidValueError(
            f"no distance {config.distance!r}; there are {', '.join(_KINDS)} "
            "(register_distance adds one)"
        )
    return _KINDS[config.distance](config)


@cache
def _load_entry_points() -> None:
    join_installed(ENTRY_POINTS, register_distance)


class _Chain(NamedTuple):
    """The model of an exemplar, ``scales`` being -1 / (2 variance)."""

    means: FloatArray
    variances: FloatArray
    scales: FloatArray
    log_norms: FloatArray
    log_stay: FloatArray
    log_next: FloatArray


@njit(cache=True)
def _of_one(exemplar: Exemplar) -> _Chain:
    means, variances, norms = exemplar.means, exemplar.variances, exemplar.log_norms
    scales = -0.5 / variances
    return _Chain(means, variances, scales, norms, exemplar.log_stay, exemplar.log_next)


@njit(cache=True)
def _of_many(others: Exemplar, row: int) -> _Chain:
    means, variances, norms = others.means[row], others.variances[row], others.log_norms[row]
    scales = -0.5 / variances
    return _Chain(means, variances, scales, norms, others.log_stay[row], others.log_next[row])


@njit(cache=True)
def _score(columns: FloatArray, model: _Chain, weights: FloatArray) -> float:
    """Return log P(points | model), of points (D, P).

    As of a `LeftRightHMM`, but in another order: norms and missing values apart from the rest, and
    in each state only the points at which the chain can be there, for it ends in its last.
    """
    densities = _densities(columns, model)
    n_states, n_points = densities.shape
    for n, row in enumerate(densities):
        for t in range(n, n_points - n_states + n + 1):
            if row[t] != row[t]:
                row[t] = _seen_density(
                    columns[:, t], model.means[n], model.variances[n], model.log_norms[n]
                )
            row[t] *= weights[t]
    return log_likelihood(densities, model.log_stay, model.log_next, True)


@njit(cache=True)
def _densities(columns: FloatArray, model: _Chain) -> FloatArray:
    """Return log-densities, shape (N, P), at least where the chain can be."""
    n_channels, n_points = columns.shape
    means, scales, norms = model.means, model.scales, model.log_norms
    n_states = len(means)
    densities = np.empty((n_states, n_points))
    if n_states < LANES or n_points < LANES:
        for n, row in enumerate(densities):
            row[:] = norms[n]
            for d in range(n_channels):
                for t in range(n_points):
                    u = columns[d, t] - means[n, d]
                    row[t] += scales[n, d] * u * u
        return densities
    for state in range(0, n_states, LANES):
        row_at = min(state, n_states - LANES)
        end = min(row_at + LANES + n_points - n_states, n_points)
        for t in range(row_at, end, LANES):
            squares_tile(columns, means, scales, norms, row_at, min(t, n_points - LANES), densities)
    return densities


@njit(cache=True)
def _seen_density(
    point: FloatArray, mean: FloatArray, variance: FloatArray, log_norm: float
) -> float:
    """Return the log-density of the channels of a point that are not missing."""
    total = log_norm
    for d in range(len(point)):
        if point[d] == point[d]:
            total -= 0.5 * (point[d] - mean[d]) ** 2 / variance[d]
        else:
            total += 0.5 * np.log(2 * np.pi * variance[d])
    return total


@njit(cache=True)
def own_scores(exemplars: Exemplar, weights: FloatArray) -> FloatArray:
    """Return the log-likelihood of each one's points under its model, as distances take it.

    Args:
        exemplars: Many, stacked.
        weights: Weight of each point, shape (P,).
    """
    out = np.empty(len(exemplars.columns))
    for k in range(len(out)):
        out[k] = _score(exemplars.columns[k], _of_many(exemplars, k), weights)
    return out


@njit(cache=True)
def _likelihood(
    exemplar: Exemplar, others: Exemplar, rows: IntArray, weights: FloatArray
) -> FloatArray:
    mine = _of_one(exemplar)
    mass = weights.sum()
    out = np.empty(len(rows))
    for k, row in enumerate(rows):
        forth = exemplar.own.item() - _score(exemplar.columns, _of_many(others, row), weights)
        back = others.own[row] - _score(others.columns[row], mine, weights)
        out[k] = 0.5 * (forth + back) / mass
    return out


@njit(cache=True)
def _pairwise_likelihood(exemplars: Exemplar, others: Exemplar, weights: FloatArray) -> FloatArray:
    mass = weights.sum()
    out = np.empty(len(exemplars.own))
    for k in range(len(out)):
        mine, theirs = _of_many(exemplars, k), _of_many(others, k)
        forth = exemplars.own[k] - _score(exemplars.columns[k], theirs, weights)
        back = others.own[k] - _score(others.columns[k], mine, weights)
        out[k] = 0.5 * (forth + back) / mass
    return out


@njit(cache=True)
def _generated(model: _Chain, moves: FloatArray, noise: FloatArray) -> FloatArray:
    """Return a sequence of a left-right model that ends in its last state, shape (D, P)."""
    means, variances = model.means, model.variances
    n_states, n_points = len(means), len(moves)
    out = np.empty_like(noise)
    state = 0
    for t in range(n_points):
        left = n_points - t
        must = n_states - state >= left  # no more points than states to go through
        if t and state < n_states - 1 and (must or moves[t] > np.exp(model.log_stay[state])):
            state += 1
        for d in range(len(noise)):
            out[d, t] = means[state, d] + np.sqrt(variances[state, d]) * noise[d, t]
    return out


@njit(cache=True)
def _monte_carlo(
    exemplar: Exemplar,
    others: Exemplar,
    rows: IntArray,
    weights: FloatArray,
    moves: FloatArray,
    noise: FloatArray,
) -> FloatArray:
    mine = _of_one(exemplar)
    mass = weights.sum() * len(moves)
    out = np.zeros(len(rows))
    for k, row in enumerate(rows):
        theirs = _of_many(others, row)
        for draw in range(len(moves)):
            here = _generated(mine, moves[draw], noise[draw])
            there = _generated(theirs, moves[draw], noise[draw])
            forth = _score(here, mine, weights) - _score(here, theirs, weights)
            back = _score(there, theirs, weights) - _score(there, mine, weights)
            out[k] += 0.5 * (forth + back) / mass
    return out
