"""Other libraries' segmenters on the same takes, with their own defaults."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from importlib import import_module
from importlib.util import find_spec
from itertools import pairwise
from types import MappingProxyType
from typing import Any

import numpy as np

from ...body import view_of
from ...errors import MPLearnError
from ...mocap import resample
from ...recording import FloatArray, Recording
from ...segmentation import make_segmenter
from ..cycles import score_cuts
from ..observing import observe
from ..table import Table, percent
from .rhythm import bouts_of

RATE_HZ = 30.0
"""Rate at which all are run: some take minutes for a minute of motion at more [1/s]."""

_HISTORY = 10  # windows that FLOSS remembers
FLOSS_REGIME = 0.45  # of the corrected arc curve: stumpy's own example draws regimes below it
_ITERATIONS = 50  # of Gibbs sampling, and what follows: keypoint-MoSeq's settings
_LATENT, _LAGS = 10, 3
_TRANSITIONS = {"gamma": 1e3, "alpha": 5.7, "kappa": 1e6, "num_states": 100}
_AUTOREGRESSION = {"nlags": _LAGS, "S_0_scale": 0.01, "K_0_scale": 10.0}


def ours(frames: FloatArray, rate_hz: float) -> list[int]:
    """Return the cuts of the default segmenter, on-line."""
    segmenter = make_segmenter("kohlmorgen-lemm", frames.shape[1], rate_hz)
    return [segment.end for segment in segmenter.segment(frames)][:-1]


def pelt(frames: FloatArray, _: float, noise: float = 1.0) -> list[int]:
    """Return the change points of ruptures' PELT, at the penalty of the BIC.

    That takes the variance of noise, which nobody knows, as a share of that of all.
    """
    library: Any = import_module("ruptures")
    n, width = frames.shape
    penalty = float(np.log(n) * width * noise * frames.var(axis=0).mean())
    found = library.Pelt().fit(frames).predict(pen=penalty)
    return [int(each) for each in found][:-1]


def clasp(frames: FloatArray, _: float) -> list[int]:
    """Return the change points of claspy's ClaSP."""
    library: Any = import_module("claspy.segmentation")
    return [int(each) for each in library.BinaryClaSPSegmentation().fit_predict(frames)]


def floss(frames: FloatArray, rate_hz: float) -> list[int]:
    """Return where FLOSS, on-line on the channel that moves most, sees a regime begin.

    The window is a second; the first ten are the history that it needs, and all that it remembers.
    """
    library: Any = import_module("stumpy")
    window = max(3, round(rate_hz))
    channel = np.ascontiguousarray(frames[:, frames.var(axis=0).argmax()])
    if len(channel) <= _HISTORY * window:
        return []
    history = channel[: _HISTORY * window]
    stream = library.floss(library.stump(history, window), history, m=window, L=window)
    found: list[int] = []
    for i, value in enumerate(channel[_HISTORY * window :]):
        stream.update(value)
        curve = stream.cac_1d_
        lowest = int(np.argmin(curve))
        at = i + 1 + lowest
        if curve[lowest] < FLOSS_REGIME and (not found or at > found[-1] + window):
            found.append(at)
    return found


def moseq(frames: FloatArray, _: float) -> list[int]:
    """Return where the syllable of MoSeq's autoregressive HMM changes.

    Of the whitened principal components, with the settings that keypoint-MoSeq has for it.
    """
    import_module("jax").config.update("jax_enable_x64", True)
    numbers: Any = import_module("jax.numpy")
    library: Any = import_module("jax_moseq.models.arhmm")
    centred = frames - frames.mean(axis=0)
    modes, sizes, _axes = np.linalg.svd(centred, full_matrices=False)
    width = min(_LATENT, int((sizes > 1e-9 * sizes[0]).sum()))
    latent = np.sqrt(len(frames)) * modes[None, :, :width]
    data = {"x": numbers.asarray(latent), "mask": numbers.ones(latent.shape[:2])}
    settings = dict(_AUTOREGRESSION, latent_dim=width)
    model = library.init_model(data, trans_hypparams=_TRANSITIONS, ar_hypparams=settings)
    for _iteration in range(_ITERATIONS):
        model = library.resample_model(data, **model)
    states = np.asarray(model["states"]["z"])[0]
    return (np.flatnonzero(np.diff(states)) + 1 + _LAGS).tolist()


PEERS: Mapping[str, tuple[str, bool, Callable[[FloatArray, float], list[int]]]] = MappingProxyType(
    {
        "ours": ("", True, ours),
        "ruptures, PELT": ("ruptures", False, pelt),
        "PELT, noise 10 %": ("ruptures", False, partial(pelt, noise=0.1)),
        "PELT, noise 1 %": ("ruptures", False, partial(pelt, noise=1e-2)),
        "claspy, ClaSP": ("claspy", False, clasp),
        "stumpy, FLOSS": ("stumpy", True, floss),
        "MoSeq, AR-HMM": ("jax_moseq", False, moseq),
    }
)
"""By name: the library, whether it is on-line, and its cuts of frames at a rate."""


def segmenter_table(takes: Iterable[Recording]) -> Table:
    """Cut takes with each segmenter that is installed, and hold the cuts against their rhythm.

    Args:
        takes: Takes of people, labelled or not.

    Example:
        >>> from mplearn.demonstrator import demonstrate
        >>> take = demonstrate(["BAR", "BAL"] * 4, seed=1, rate_hz=50.0).recording
        >>> table = segmenter_table([take])
        >>> table.rows[0][0]
        'ours'
    """
    motions, left_out = [], []
    for take in takes:
        try:
            features = observe(resample(take, min(RATE_HZ, take.rate_hz)))
        except MPLearnError as error:  # the others can be cut nevertheless
            left_out.append(f"{take.name} ({error})")
            continue
        view = view_of(features.channels)
        seen = view.see(features.frames)
        motions.append((features, seen, bouts_of(features, seen, view.channels)))
    rows = []
    for name, (library, online, cut) in PEERS.items():
        if library and find_spec(library) is None:
            left_out.append(f"{name} (not installed: pip install {library})")
            continue
        if motions:
            cut(motions[0][1][: round(12 * RATE_HZ)], RATE_HZ)  # compiles what is compiled
        scores, took_s, n_cuts, changes = [], 0.0, 0, []
        for take, seen, bouts in motions:
            begin = time.perf_counter()
            cuts = cut(seen, take.rate_hz)
            took_s += time.perf_counter() - begin
            n_cuts += len(cuts)
            scores += [score_cuts(bout, cuts) for bout in bouts]
            changes += _changes(take, cuts)
        minutes = sum(take.duration_s for take, _, _ in motions) / 60
        spreads = [score.spread for score in scores if score.spread == score.spread]
        per_cycle = [score.per_cycle for score in scores]
        rows.append(
            (
                name,
                "yes" if online else "no",
                f"{n_cuts / max(minutes, 1e-9):.0f}",
                f"{np.median(per_cycle):.2f}" if scores else "-",
                percent(float(np.mean(np.array(per_cycle) < 0.8)) if scores else np.nan, 0),
                f"{np.median(spreads):.3f}" if spreads else "-",
                percent(float(np.mean(changes)) if changes else np.nan, 0),
                f"{took_s / max(minutes, 1e-9):.2f} s",
            )
        )
    note = (
        f"The same takes, seen as a learner sees them, at {RATE_HZ:g} Hz. Ours is the default "
        "segmenter; the others are run with their own defaults, PELT, which has none, at the "
        "penalty of the Bayesian information criterion, with all variance, or a share of it, for "
        "that of noise; FLOSS on-line on the channel that moves "
        "most, with windows of a second and a memory of ten. Cycles as in the table of rhythm: "
        "wanted are 2 cuts a cycle. ClaSP and FLOSS look for changes of the activity rather than "
        "for turns: changes found are those between labelled activities with a cut within half a "
        "second."
    )
    return Table(
        "Segmenters of other libraries",
        (
            "segmenter",
            "on-line",
            "cuts a minute",
            "cuts a cycle",
            "missed",
            "spread of the phase",
            "changes found",
            "time for a minute",
        ),
        tuple(rows),
        f"{note} Left out: {'; '.join(left_out)}." if left_out else note,
    )


def _changes(take: Recording, cuts: list[int]) -> list[bool]:
    """Return, for each change of the labelled activity, whether a cut is near it."""
    ordered = sorted(take.labels, key=lambda label: label.start)
    at = [b.start for a, b in pairwise(ordered) if a.label != b.label]
    near = 0.5 * take.rate_hz
    return [any(abs(cut - each) <= near for cut in cuts) for each in at]
