"""Signals whose boundaries are known exactly."""

import numpy as np

from mplearn.recording import FloatArray, LabelledSegment


def bell_motions(
    n_motions: int, n_channels: int, rate_hz: float, seed: int, noise: float = 0.0
) -> tuple[FloatArray, list[LabelledSegment]]:
    """Minimum-jerk movements between random postures, every fourth followed by a pause."""
    rng = np.random.default_rng(seed)
    posture = rng.normal(size=n_channels)
    pieces, labels, end = [], [], 0
    for i in range(n_motions):
        length = round(rng.uniform(0.6, 1.5) * rate_hz)
        x = np.arange(1, length + 1) / length
        bell = x**3 * (10 - 15 * x + 6 * x**2)
        target = posture + rng.normal(size=n_channels)
        pieces.append(posture + bell[:, None] * (target - posture))
        labels.append(LabelledSegment(end, end + length, f"m{i}"))
        end += length
        posture = target
        if i % 4 == 3:
            rest = round(rng.uniform(0.6, 1.5) * rate_hz)
            pieces.append(np.repeat(posture[None], rest, axis=0))
            end += rest
    frames = np.concatenate(pieces)
    return frames + noise * rng.normal(size=frames.shape), labels


def mackey_glass(n_modes: int, length: int, seed: int) -> tuple[FloatArray, list[int]]:
    """A Mackey-Glass series that switches between delays 17, 23 and 30; every 6th unit of time."""
    rng = np.random.default_rng(seed)
    step = 0.1
    series = [1.2 + 0.2 * rng.uniform()] * 302
    samples: list[float] = []
    delay = 0
    for _ in range(n_modes):
        delay = rng.choice([d for d in (17, 23, 30) if d != delay])
        lag = round(delay / step)
        for _ in range(length):
            for _ in range(60):
                late = series[-lag]
                series.append(series[-1] + step * (0.2 * late / (1 + late**10) - 0.1 * series[-1]))
            samples.append(series[-1])
    return np.array(samples), [length * (i + 1) for i in range(n_modes - 1)]
