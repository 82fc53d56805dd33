"""Sequences as the kernels want them: checked, and many of them end to end."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..errors import FrameError, InvalidValueError
from ..recording import FloatArray, IntArray
from .kernels import has_infinity


def as_frames(frames: FloatArray, n_channels: int | None = None) -> FloatArray:
    """Return frames as a contiguous (T, D) array of floats.

    Raises:
        FrameError: They are not (T, D) with T >= 1, D differs from ``n_channels``, or a value is
            infinite (a missing measurement is NaN).
    """
    frames = np.ascontiguousarray(frames, dtype=np.float64)
    wanted = "D" if n_channels is None else str(n_channels)
    if frames.ndim != 2 or 0 in frames.shape or n_channels not in (None, frames.shape[1]):
        raise FrameError(f"frames must have shape (T, {wanted}), T >= 1, not {frames.shape}")
    if has_infinity(frames):
        raise FrameError("frames hold infinite values; a missing measurement is NaN")
    return frames


def as_weights(weights: FloatArray | None, n_frames: int) -> FloatArray:
    """Return the weight of each frame, shape (T,), ones where none are given.

    Raises:
        InvalidValueError: The shape is wrong, or a weight is negative, not finite, or all are 0.
    """
    if weights is None:
        return np.ones(n_frames)
    weights = np.ascontiguousarray(weights, dtype=np.float64)
    if weights.shape != (n_frames,):
        raise InvalidValueError(f"weights must have shape ({n_frames},), not {weights.shape}")
    if not (np.isfinite(weights).all() and (weights >= 0).all() and weights.any()):
        raise InvalidValueError("weights must be finite, at least 0, and not all 0")
    return weights


class SequenceBatch(NamedTuple):
    """Ragged sequences end to end.

    Attributes:
        frames: Shape (sum T, D).
        columns: The same transposed, shape (D, sum T).
        weights: Shape (sum T,).
        offsets: Sequence s is ``frames[offsets[s]:offsets[s + 1]]``, shape (S + 1,).

    Example:
        >>> import numpy as np
        >>> batch = SequenceBatch.of([np.zeros((40, 2)), np.ones((30, 2))])
        >>> batch.n_sequences, batch.n_channels, batch.offsets.tolist()
        (2, 2, [0, 40, 70])
    """

    frames: FloatArray
    columns: FloatArray
    weights: FloatArray
    offsets: IntArray

    @classmethod
    def of(
        cls, sequences: Sequence[FloatArray], weights: Sequence[FloatArray] | None = None
    ) -> SequenceBatch:
        """Check and pack sequences of shape (T_s, D), and their weights (T_s,).

        Raises:
            FrameError: There is none, or their widths differ.
            InvalidValueError: The weights do not fit the sequences.
        """
        if len(sequences) == 0:
            raise FrameError("at least one sequence is needed")
        if weights is not None and len(weights) != len(sequences):
            raise InvalidValueError(
                f"{len(sequences)} sequences need as many weights, not {len(weights)}"
            )
        frames = [as_frames(sequences[0])]
        frames += [as_frames(sequence, frames[0].shape[1]) for sequence in sequences[1:]]
        weighed = [
            as_weights(None if weights is None else weights[s], len(sequence))
            for s, sequence in enumerate(frames)
        ]
        offsets = np.zeros(len(frames) + 1, np.int64)
        np.cumsum([len(sequence) for sequence in frames], out=offsets[1:])
        joined = frames[0] if len(frames) == 1 else np.concatenate(frames)
        return cls(joined, np.ascontiguousarray(joined.T), np.concatenate(weighed), offsets)

    @property
    def n_sequences(self) -> int:
        """Number of sequences S."""
        return len(self.offsets) - 1

    @property
    def n_channels(self) -> int:
        """Number of channels D."""
        return int(self.frames.shape[1])

    @property
    def masses(self) -> FloatArray:
        """Sum of the weights of each sequence, shape (S,): its length where all are 1."""
        return np.add.reduceat(self.weights, self.offsets[:-1])
