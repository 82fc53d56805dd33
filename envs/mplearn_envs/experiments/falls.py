"""What makes the robot fall, fitted to simulated random walks; and how well it is foretold.

    python -m mplearn_envs.experiments soak out/falls.jsonl --speeds 1.0 0.7 1.5 --steps 2500
    python -m mplearn_envs.experiments falls out/falls.jsonl --write

A proportional hazard (`mplearn_envs.execution.risk`) of each level, by the greatest likelihood: a
macro step of T seconds that strains the balance by x is survived with probability
exp(-T z exp(w . x)), where z is the same in all of an episode, for its body is: gamma-distributed
with mean 1 (a shared frailty, [Vaupel1979]). Of those that have walked for long most are robust, so
without it the first steps would be said to be safer than they are. How well that foretells falls is
measured on primitives that were left out of the fit, a fifth of them at a time.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize, minimize_scalar

from mplearn.errors import InvalidValueError
from mplearn.evaluation.table import Table
from mplearn.recording import BoolArray, FloatArray, IntArray
from mplearn_envs.execution.risk import STRAINS

from .soak import SoakedEpisode

FOLDS = 5
_PRIOR = 1.0  # weight of the squared weights, but for the first: few falls tell little
_WIDEST, _ALIKE = 4.0, 1e-6  # variances of frailty
_UNSEEN = 0.5  # falls: that there was none is no proof that there never is


class Trials(NamedTuple):
    """Macro steps of one level.

    Attributes:
        strain: What strained the balance, shape (N, F).
        time_s: How long each was to take, shape (N,) [s].
        fallen: Whether the robot fell, shape (N,).
        kind: Number of what was performed, shape (N,).
        episode: Number of the episode in which it was, shape (N,), which a fall ends; None is one
            for each.
    """

    strain: FloatArray
    time_s: FloatArray
    fallen: BoolArray
    kind: IntArray
    episode: IntArray | None = None

    @classmethod
    def of(cls, episodes: Iterable[SoakedEpisode]) -> Trials:
        """Return the macro steps of some episodes."""
        groups = [each.steps for each in episodes]
        steps = [step for group in groups for step in group]
        kinds = {name: k for k, name in enumerate(sorted({step.name for step in steps}))}
        return cls(
            np.array([step.strain for step in steps]),
            np.array([step.planned_s for step in steps]),
            np.array([step.fallen for step in steps]),
            np.array([kinds[step.name] for step in steps]),
            np.repeat(np.arange(len(groups)), [len(group) for group in groups]),
        )

    def part(self, of: BoolArray) -> Trials:
        """Return some of them, shape (N,)."""
        episode = None if self.episode is None else self.episode[of]
        return Trials(self.strain[of], self.time_s[of], self.fallen[of], self.kind[of], episode)


class Foretold(NamedTuple):
    """How well falls are foretold.

    Attributes:
        brier: Mean squared difference of what happened from how likely it was said to be.
        brier_same: The same for who says the same of every second.
        auc: How often a macro step with a fall was said to be riskier than one without.
        auc_same: The same for who says the same of every second.
        slope: By how much more the log hazard differs than was said: 1 where all is right.
    """

    brier: float
    brier_same: float
    auc: float
    auc_same: float
    slope: float


def fit(trials: Trials, spread: float = 0.0) -> FloatArray:
    """Return the likeliest weights, shape (F,); but for the first none is below 0.

    For more strain is no help, and what a few falls say otherwise would mislead where the strain is
    greater than any that was seen.

    Args:
        trials: Macro steps of one level.
        spread: Variance of how much likelier a body falls than those of its level do at the mean.
    """
    return _fitted(trials, spread)[0]


def fit_spread(trials: Trials) -> float:
    """Return the likeliest variance of how much likelier a body falls than others of its level."""
    if not trials.fallen.any():
        return 0.0
    found = minimize_scalar(
        lambda spread: _fitted(trials, spread)[1], (0.0, _WIDEST), (0.0, _WIDEST), method="bounded"
    )
    return float(found.x)


def _fitted(trials: Trials, spread: float) -> tuple[FloatArray, float]:
    """Return the likeliest weights, shape (F,), and by how much they fail (minus log likelihood).

    Where a body has come through a hazard H, S(H) = (1 + spread H)^(-1/spread) of its level's have
    not fallen, and exp(-H) where all are alike.
    """
    x, time_s, fallen = trials.strain, trials.time_s, trials.fallen
    own = np.arange(len(fallen)) if trials.episode is None else trials.episode
    n = int(own.max()) + 1
    fell = np.bincount(own, fallen, n) > 0
    scale = np.maximum(x.std(axis=0), 1e-6)
    scale[0] = 1.0

    def gone(hazard: FloatArray) -> FloatArray:
        return np.asarray(np.log1p(spread * hazard) / spread if spread > _ALIKE else hazard)

    def loss(scaled: FloatArray) -> tuple[float, FloatArray]:
        hazard = time_s * np.exp(np.clip(x @ (scaled / scale), -50.0, 50.0))
        at_last: FloatArray = np.bincount(own, hazard * fallen, n).astype(np.float64)
        before: FloatArray = np.bincount(own, hazard * ~fallen, n).astype(np.float64)
        within = np.clip(gone(before + at_last) - gone(before), 1e-300, 500.0)
        lost = gone(before) - np.where(fell, np.log(-np.expm1(-within)), 0.0)
        ends = np.where(fell, 1.0 / np.expm1(within), 0.0)
        rate, rate_last = (1.0 / (1.0 + spread * h) for h in (before, before + at_last))
        slope = np.where(fallen, -ends[own] * rate_last[own], rate[own])
        slope -= ~fallen * ends[own] * (rate_last - rate)[own]
        penalty = _PRIOR * (scaled[1:] @ scaled[1:])
        gradient = (x / scale).T @ (slope * hazard)
        gradient[1:] += 2.0 * _PRIOR * scaled[1:]
        return float(lost.sum() + penalty), gradient

    start = np.zeros(x.shape[1])
    start[0] = np.log(max(fallen.sum(), _UNSEEN) / time_s.sum())
    if not fallen.any():
        return start, loss(start)[0]
    bounds = [(None, None), *((0.0, None) for _ in start[1:])]
    found = minimize(loss, start, jac=True, bounds=bounds)
    return found.x / scale, float(found.fun)


def chances(weights: FloatArray, trials: Trials) -> FloatArray:
    """Return how likely the robot falls in each macro step, shape (N,)."""
    return -np.expm1(-trials.time_s * np.exp(np.clip(trials.strain @ weights, -50.0, 50.0)))


def foretold(trials: Trials, folds: int = FOLDS, seed: int = 0) -> Foretold:
    """Return how well falls are foretold of primitives that the fit has not seen.

    Args:
        trials: Macro steps of one level.
        folds: In so many parts the primitives are dealt, each left out once.
        seed: Of the dealing.

    Raises:
        InvalidValueError: There are no falls, or nothing but falls.
    """
    if trials.fallen.all() or not trials.fallen.any():
        raise InvalidValueError("how well falls are foretold can be told where there are some")
    fold = np.random.default_rng(seed).permutation(trials.kind.max() + 1)[trials.kind] % folds
    said, same = np.empty(len(fold)), np.empty(len(fold))
    for k in range(folds):
        seen, rest = trials.part(fold != k), trials.part(fold == k)
        said[fold == k] = chances(fit(seen), rest)
        rate = seen.fallen.sum() / seen.time_s.sum()
        same[fold == k] = -np.expm1(-rate * rest.time_s)
    fallen = trials.fallen
    log_hazard = np.log(-np.log1p(-np.clip(said, 1e-12, 1.0 - 1e-12)) / trials.time_s)
    known = np.column_stack((np.ones(len(fold)), log_hazard))
    return Foretold(
        float(np.mean((said - fallen) ** 2)),
        float(np.mean((same - fallen) ** 2)),
        _auc(said, fallen),
        _auc(same, fallen),
        float(fit(trials._replace(strain=known))[1]),
    )


def _auc(said: FloatArray, fallen: BoolArray) -> float:
    """Return how often one with a fall has more than one without; ties count half."""
    falls, rest = said[fallen][:, None], np.sort(said[~fallen])
    below = np.searchsorted(rest, falls, side="left")
    equal = np.searchsorted(rest, falls, side="right") - below
    return float((below + 0.5 * equal).mean() / len(rest))


def of_levels(episodes: Iterable[SoakedEpisode]) -> dict[str, Trials]:
    """Return the macro steps of each level."""
    known: dict[str, list[SoakedEpisode]] = {}
    for each in episodes:
        known.setdefault(each.level, []).append(each)
    return {level: Trials.of(group) for level, group in known.items()}


def falls_table(of_level: dict[str, Trials]) -> Table:
    """Return one row for each level: what was fitted, and how well it foretells."""
    rows = []
    for level, trials in of_level.items():
        spread, seen = fit_spread(trials), trials.fallen
        cells = ("-",) * 5
        if seen.any():
            well = foretold(trials)
            cells = (
                f"{well.brier:.4f} ({well.brier_same:.4f})",
                f"{well.auc:.2f} ({well.auc_same:.2f})",
                f"{well.slope:.2f}",
                ", ".join(f"{weight:.2f}" for weight in fit(trials, spread)),
                f"{spread:.2f}",
            )
        rows.append((level, str(len(seen)), str(int(seen.sum())), *cells))
    return Table(
        "Falls foretold, of primitives that the fit has not seen",
        ("body", "macro steps", "falls", "Brier", "AUC", "slope", "weights", "spread"),
        tuple(rows),
        "In brackets: who says the same of every second. Slope: by how much more the log hazard "
        "differs than was said; 1 is right; all three as if bodies of a level were alike. Weights "
        f"of the log hazard [1/s]: {', '.join(STRAINS)}; spread: variance of the factor by which "
        "bodies differ.",
    )
