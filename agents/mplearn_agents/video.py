"""Writes mp4 videos that every browser plays (H.264, yuv420p)."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mplearn.errors import InvalidValueError
from mplearn.extras import require


def write_video(path: str | Path, frames: Iterable[NDArray[np.uint8]], rate_hz: float) -> int:
    """Write pictures as an mp4 file, one at a time, so that they need not be in memory together.

    Args:
        path: File to write; its folder is made.
        frames: Pictures of equal shape (H, W, 3), H and W even.
        rate_hz: Pictures per second [1/s].

    Returns:
        How many pictures were written.

    Raises:
        InvalidValueError: There is no picture, or a picture has another shape or type.
        MissingDependencyError: imageio-ffmpeg is not installed.
    """
    if not (np.isfinite(rate_hz) and rate_hz > 0):
        raise InvalidValueError(f"rate_hz must be positive and finite, not {rate_hz}")
    ffmpeg = require("imageio_ffmpeg", "report")
    path = Path(path)
    pictures = iter(frames)
    first = next(pictures, None)
    if first is None:
        raise InvalidValueError(f"no pictures to write to {path.name!r}")
    shape = first.shape
    _check(first, shape)
    path.parent.mkdir(parents=True, exist_ok=True)
    writer = ffmpeg.write_frames(
        str(path),
        (shape[1], shape[0]),
        fps=rate_hz,
        codec="libx264",
        pix_fmt_out="yuv420p",
        macro_block_size=2,
        quality=None,
        output_params=["-crf", "25", "-preset", "veryfast", "-movflags", "+faststart"],
    )
    writer.send(None)
    count = 0
    try:
        picture: NDArray[np.uint8] | None = first
        while picture is not None:
            _check(picture, shape)
            writer.send(np.ascontiguousarray(picture))
            count += 1
            picture = next(pictures, None)
    finally:
        writer.close()
    return count


def _check(picture: NDArray[np.uint8], shape: tuple[int, ...]) -> None:
    if picture.dtype != np.uint8 or picture.ndim != 3 or picture.shape[2] != 3:
        raise InvalidValueError(
            f"a picture is uint8 of shape (H, W, 3), not {picture.dtype} of {picture.shape}"
        )
    if picture.shape != shape:
        raise InvalidValueError(f"pictures must all have shape {shape}, not {picture.shape}")
    if picture.shape[0] % 2 or picture.shape[1] % 2:
        raise InvalidValueError(f"H.264 needs even height and width, not {picture.shape[:2]}")
