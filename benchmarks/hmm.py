"""Fitting and scoring against hmmlearn: the same model, the same sequences."""

from typing import Any

import numpy as np
from hmmlearn.hmm import GaussianHMM

from mplearn.hmm import fit, score_batch, to_hmmlearn

from .interleaved import interleaved

STEPS = 5
CALLS = 200  # one call is too short for the clock


def motions(n: int, length: tuple[int, int], channels: int = 30) -> list[np.ndarray]:
    rng = np.random.default_rng(1)
    out = []
    for _ in range(n):
        t = np.linspace(0, 1, int(rng.integers(*length)))[:, None]
        phase, size = rng.uniform(0, 2, (2, channels))
        noise = rng.normal(0, 0.05, (len(t), channels))
        out.append(size * np.sin(3 * t + phase) + noise)
    return out


def peer(n_states: int) -> GaussianHMM:
    """hmmlearn's left-right model, in log space, with as many steps as ours."""
    model = GaussianHMM(
        n_states, "diag", n_iter=STEPS, tol=0, init_params="mc", params="mct", random_state=0
    )
    model.startprob_ = np.eye(n_states)[0]
    model.transmat_ = 0.9 * np.eye(n_states) + 0.1 * np.eye(n_states, k=1)
    model.transmat_[-1, -1] = 1.0
    return model


def rows() -> list[tuple[str, str, str, str]]:
    one = motions(1, (100, 101))[0]
    many = motions(200, (60, 160))
    models = [fit([each], 6) for each in many[:50]]
    peers = [to_hmmlearn(model) for model in models]
    functions: dict[str, Any] = {
        "fit": lambda: fit([one], 6, n_steps=STEPS),
        "fit, hmmlearn": lambda: peer(6).fit(one),
        "score": lambda: [models[0].score(one) for _ in range(CALLS)],
        "score, hmmlearn": lambda: [peers[0].score(one) for _ in range(CALLS)],
        "batch": lambda: score_batch(models, many),
        "batch, hmmlearn": lambda: [[p.score(s) for s in many[:20]] for p in peers[:10]],
    }
    took = interleaved(functions)
    took["batch, hmmlearn"] *= 50  # a fiftieth of the pairs
    for name in ("score", "score, hmmlearn"):
        took[name] /= CALLS
    return [
        (
            f"{what} ({size})",
            f"{1e3 * took[what]:.3f} ms",
            f"{1e3 * took[f'{what}, hmmlearn']:.2f} ms, hmmlearn",
            f"{took[f'{what}, hmmlearn'] / took[what]:.0f} x",
        )
        for what, size in (
            ("fit", "100 x 30, 6 states"),
            ("score", "100 x 30, 6 states"),
            ("batch", "50 models x 200 sequences"),
        )
    ]
