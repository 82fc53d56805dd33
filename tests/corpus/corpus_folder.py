"""Recordings as files that are cheap to learn."""

from pathlib import Path

import numpy as np
from store.streams import CHANNELS, RATE_HZ, stream


def write_take(path: Path, seconds: float, seed: int) -> None:
    frames = stream(seconds, seed)
    path.parent.mkdir(parents=True, exist_ok=True)
    times = np.arange(len(frames)) / RATE_HZ
    rows = (",".join(f"{value:.4f}" for value in row) for row in np.column_stack([times, frames]))
    path.write_text("\n".join([f"time_s,{','.join(CHANNELS)}", *rows, ""]), encoding="utf-8")
