"""Segmenters frame by frame: what one costs, and the worst; ruptures as the off-line peer."""

import time
from collections.abc import Callable
from functools import partial

import numpy as np

from mplearn.segmentation import KohlmorgenLemm, KohlmorgenLemmConfig, Segmenter, make_segmenter

from .interleaved import interleaved

RATE_HZ, CHANNELS, WINDOWS = 100.0, 30, 500


def motion(n_frames: int) -> np.ndarray:
    """Minimum-jerk movements between random postures, a second each, with a little noise."""
    rng = np.random.default_rng(1)
    x = np.arange(1, 101) / 100
    bell = x**3 * (10 - 15 * x + 6 * x**2)
    postures = rng.normal(size=(n_frames // 100 + 1, CHANNELS))
    steps = np.diff(postures, axis=0)[:, None] * bell[:, None]
    frames = (postures[:-1, None] + steps).reshape(-1, CHANNELS)
    return frames + 2e-4 * rng.normal(size=frames.shape)


def segmenters() -> dict[str, Segmenter]:
    fifo_s = WINDOWS / RATE_HZ
    settings = {
        "on-line path": KohlmorgenLemmConfig(fifo_s=fifo_s),
        "on-line path, C from the envelope": KohlmorgenLemmConfig(
            fifo_s=fifo_s, switch_cost_s=None
        ),
        "exact path, 200 windows": KohlmorgenLemmConfig(exact=True),
    }
    built: dict[str, Segmenter] = {
        f"Kohlmorgen-Lemm, {name}": KohlmorgenLemm(CHANNELS, RATE_HZ, config)
        for name, config in settings.items()
    }
    for name in ("kohlmorgen-lemm", "zero-velocity", "kinematic-centroid"):
        built[f"{name}, as by default"] = make_segmenter(name, CHANNELS, RATE_HZ)
    return built


def worst_frame(segmenter: Segmenter, frames: np.ndarray) -> float:
    """Return the longest processor time of a frame [s]: the machine may be busy with others."""
    times = []
    for frame in frames:
        begin = time.thread_time()
        segmenter.update(frame)
        times.append(time.thread_time() - begin)
    return max(times)


def ruptures_window(frames: np.ndarray) -> object:
    """Off-line peer: sliding windows with an l2 cost over the direction of motion."""
    import ruptures

    velocity = np.diff(frames, axis=0)
    direction = velocity / np.linalg.norm(velocity, axis=1, keepdims=True)
    return ruptures.Window(width=20, model="l2").fit_predict(direction, n_bkps=len(frames) // 100)


def rows() -> list[tuple[str, str, str, str]]:
    frames = motion(4000)
    built = segmenters()
    functions: dict[str, Callable[[], object]] = {
        name: partial(segmenter.segment, frames) for name, segmenter in built.items()
    }
    took = interleaved({**functions, "ruptures": partial(ruptures_window, frames)}, rounds=3)
    peer = took["ruptures"] / len(frames)
    return [
        (
            f"{name} ({CHANNELS} channels)",
            f"{1e6 * took[name] / len(frames):.1f} us a frame",
            f"{1e6 * peer:.0f} us a frame, ruptures.Window off-line; "
            f"worst frame {1e3 * worst_frame(segmenter, frames):.2f} ms",
            f"{peer * len(frames) / took[name]:.1f} x",
        )
        for name, segmenter in built.items()
    ]
