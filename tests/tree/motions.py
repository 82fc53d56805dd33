"""Streams of motions for the tree's tests: smooth curves between random key postures."""

import numpy as np

RATE_HZ = 50.0


class Motions:
    """A repertoire of motions, each a smooth curve through key postures of its own."""

    def __init__(self, n_motions, n_channels=6, seed=0):
        self.rng = np.random.default_rng(seed)
        self.keys = self.rng.normal(0, 1, (n_motions, 4, n_channels))

    def perform(self, motion, seconds=None):
        """Return one execution, shape (L, D), varied in duration, amplitude, posture, and noise."""
        rng = self.rng
        n_frames = round((seconds or rng.uniform(0.8, 1.4)) * RATE_HZ)
        at = np.linspace(0, 3, n_frames)
        low = np.minimum(at.astype(int), 2)
        share = (1 - np.cos(np.pi * (at - low)))[:, None] / 2
        keys = self.keys[motion] * rng.normal(1, 0.05) + rng.normal(0, 0.04, self.keys.shape[2])
        curve = (1 - share) * keys[low] + share * keys[low + 1]
        return curve + rng.normal(0, 0.02, curve.shape)

    def session(self, n_rounds):
        """Return (motion, execution) pairs: all motions in random order, so many times."""
        order = [m for _ in range(n_rounds) for m in self.rng.permutation(len(self.keys))]
        return [(int(m), self.perform(m)) for m in order]
