"""Small libraries of robot motions, made through the real classes, for the tests of this folder."""

from __future__ import annotations

from functools import cache

import numpy as np

from mplearn.graph import TransitionGraph
from mplearn.hmm import fit
from mplearn.library import Primitive, PrimitiveLibrary
from mplearn.recording import Recording
from mplearn_envs.robot import humanoid

RATE_HZ = 100.0
CHANNELS = humanoid().channels
STANDING_M = 0.885

ARMS = {"shoulder_pitch_l": -2.2, "shoulder_pitch_r": -2.2}
BOW = {"base_pitch": 0.8, "neck_pitch": 0.2}
SQUAT = {"base_height": -0.18, "base_pitch": 0.2, "shoulder_pitch_l": -1.2}
KICK = {"hip_pitch_l": -1.0, "knee_l": 0.4}
JUMP = {"base_height": 0.3}  # no foot is left on the floor
WAVE = {"shoulder_roll_r": -1.2, "elbow_r": -1.0}

# (name, posture at the start, posture at the end, seconds)
MOTIONS = (
    ("arms up", {}, ARMS, 1.0),
    ("arms down", ARMS, {}, 1.0),
    ("bow down", {}, BOW, 1.2),
    ("bow up", BOW, {}, 1.2),
    ("squat", {}, SQUAT, 1.1),
    ("rise", SQUAT, {}, 1.1),
    ("kick", {}, KICK, 0.8),
    ("retract", KICK, {}, 0.8),
    ("wave", {}, WAVE, 0.9),
    ("jump", {}, JUMP, 0.7),
)
CYCLE = ("arms up", "arms down", "squat", "rise", "bow down", "bow up")  # of a performance
NEXT = {0: (1,), 1: (0, 2, 4, 6, 8, 9), 2: (3,), 3: (0, 4, 6), 4: (5,), 5: (0, 2), 6: (7,), 7: (0,)}


def posture(changes: dict[str, float]) -> np.ndarray:
    """Return values of all channels: upright, arms hanging, but for some."""
    frame = np.zeros(len(CHANNELS))
    frame[0] = STANDING_M
    for name, value in changes.items():
        frame[CHANNELS.index(name)] += value
    return frame


def sweep(start: dict[str, float], end: dict[str, float], seconds: float) -> np.ndarray:
    """Return a minimum-jerk motion between two postures, shape (T, 33)."""
    x = np.linspace(0.0, 1.0, round(seconds * RATE_HZ) + 1)[:, None]
    share = x**3 * (10 - 15 * x + 6 * x**2)
    return posture(start) * (1 - share) + posture(end) * share


@cache
def standing_library(names: tuple[str, ...] | None = None, seed: int = 0) -> PrimitiveLibrary:
    """Return a library of some of the motions (all by default).

    "wave" is a dead end, "jump" is more than the robot can.
    """
    rng = np.random.default_rng(seed)
    primitives = []
    kept = [i for i, motion in enumerate(MOTIONS) if names is None or motion[0] in names]
    for i in kept:
        name, start, end, seconds = MOTIONS[i]
        exemplars = [
            sweep(start, end, seconds * rng.uniform(0.9, 1.1))
            + rng.normal(scale=0.005, size=len(CHANNELS))
            for _ in range(4)
        ]
        hmm = fit(exemplars, 10, variance_floor=1e-4)
        primitives.append(Primitive.from_exemplars(i + 3, hmm, exemplars, RATE_HZ, name=name))
    graph = TransitionGraph()
    for i in kept:
        graph.add_node(i + 3)
    for previous, followers in NEXT.items():
        for rank, follower in enumerate(followers):
            if previous in kept and follower in kept:
                for _ in range(rank + 1):
                    graph.observe(previous + 3, follower + 3, 1.0)
    return PrimitiveLibrary(tuple(primitives), graph, CHANNELS, RATE_HZ, "robot")


def recording(rounds: int = 8, seed: int = 0, *, ring: bool = True) -> Recording:
    """Return a performance in the robot's channels, over and over: in a ring, or pairs as drawn."""
    rng = np.random.default_rng(seed)
    motions = {name: (start, end, length) for name, start, end, length in MOTIONS}
    parts = []
    pairs = [k if ring else rng.integers(3) for _ in range(rounds) for k in range(3)]
    for name in (name for k in pairs for name in CYCLE[2 * k : 2 * k + 2]):
        start, end, length_s = motions[name]
        motion = sweep(start, end, length_s * rng.uniform(0.9, 1.1))
        still = np.repeat(motion[-1:], rng.integers(5, 20), axis=0)
        parts.append(np.vstack((motion, still)))
    frames = np.concatenate(parts)
    frames = frames + rng.normal(scale=0.003, size=frames.shape)
    return Recording(frames=frames, rate_hz=RATE_HZ, channels=CHANNELS)
