"""Generation and retiming of a path, against the playing time and against a dense solution."""

from typing import Any

import numpy as np

from mplearn import hmm
from mplearn.generation import STYLES, generate, retime
from mplearn.generation.smooth import most_likely_trajectory
from mplearn.library import Primitive

from .interleaved import interleaved

RATE_HZ, JOINTS, PRIMITIVES = 100.0, 30, 10


def path() -> list[Primitive]:
    rng = np.random.default_rng(1)
    found = []
    for id in range(PRIMITIVES):
        goal, phase = rng.uniform(-1, 1, (2, JOINTS))
        motions = []
        for _ in range(4):
            t = np.linspace(0, 1, int(rng.integers(90, 140)))[:, None]
            motions.append(goal * np.sin(2 * t + phase) + rng.normal(0, 0.02, (len(t), JOINTS)))
        model = hmm.fit(motions, 8)
        found.append(Primitive.from_exemplars(id, model, motions, RATE_HZ))
        found[-1].dynamics  # noqa: B018 (a library has them once and for all)
    return found


def rows() -> list[tuple[str, str, str, str]]:
    primitives, channels = path(), tuple(f"joint_{i}" for i in range(JOINTS))
    start = primitives[0].exemplars[0][0]

    def made(style: Any) -> Any:
        rng = np.random.default_rng(0)
        return generate(primitives, channels, RATE_HZ, style=style, start=start, rng=rng)

    motion = made("smooth")
    limits, accelerations = np.full(JOINTS, 1.0), np.full(JOINTS, 12.0)
    functions: dict[str, Any] = {style: (lambda s=style: made(s)) for style in STYLES}
    functions["retiming to velocity and acceleration limits"] = lambda: retime(
        motion, limits, accelerations
    )
    functions["dense"] = lambda: _dense(primitives[0])
    functions["banded"] = lambda: _banded(primitives[0])
    took = interleaved(functions)
    size = (
        f"{PRIMITIVES} primitives, {motion.duration_s:.0f} s at {RATE_HZ:.0f} Hz, {JOINTS} joints"
    )
    table = [
        (
            f"{name} ({size})",
            f"{1e3 * took[name]:.2f} ms",
            f"{motion.duration_s:.0f} s, playing it",
            f"{motion.duration_s / took[name]:.0f} x",
        )
        for name in functions
        if name not in ("dense", "banded")
    ]
    table.append(
        (
            "trajectory-HMM alone (1 primitive)",
            f"{1e3 * took['banded']:.2f} ms",
            f"{1e3 * took['dense']:.1f} ms, numpy.linalg.solve of the whole matrices",
            f"{took['dense'] / took['banded']:.0f} x",
        )
    )
    return table


def _states(primitive: Primitive) -> np.ndarray:
    n = round(primitive.mean_duration_s * RATE_HZ)
    return np.arange(n) * primitive.hmm.n_states // n


def _banded(primitive: Primitive) -> np.ndarray:
    known = primitive.dynamics
    return most_likely_trajectory(known.means, known.variances, _states(primitive), RATE_HZ)


def _dense(primitive: Primitive) -> np.ndarray:
    known, states = primitive.dynamics, _states(primitive)
    n = len(states)
    velocity = (np.eye(n, k=1) - np.eye(n, k=-1)) * RATE_HZ / 2
    acceleration = (np.eye(n, k=1) - 2 * np.eye(n) + np.eye(n, k=-1)) * RATE_HZ**2
    velocity[[0, -1]] = acceleration[[0, -1]] = 0.0
    w = np.concatenate([np.eye(n), velocity, acceleration])
    out = np.empty((n, known.means.shape[2]))
    for d in range(out.shape[1]):
        weights = 1.0 / known.variances[:, states, d].ravel()
        pull = weights * known.means[:, states, d].ravel()
        out[:, d] = np.linalg.solve(w.T @ (weights[:, None] * w), w.T @ pull)
    return out
