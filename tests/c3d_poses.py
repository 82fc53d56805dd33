"""C3D files of poses alone, as Theia writes them, written here and not by what is tested."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np


def write_c3d_poses(
    path: Path, poses: np.ndarray, labels: list[str], *, rate_hz: float, ratio: int = 1
) -> Path:
    """Poses of segments, shape (T, S, 4, 4) [mm], without points, as Theia writes them."""
    n_frames = len(poses) // ratio
    length = max(map(len, labels), default=1)
    texts = b"".join(label.encode().ljust(length) for label in labels)

    def record(name: str, number: int, content: bytes) -> bytes:
        head = struct.pack("<bb", len(name), number) + name.encode()
        return head + struct.pack("<h", 2 + len(content)) + content

    def value(name: str, number: int, kind: int, raw: bytes, sizes: tuple[int, ...] = ()) -> bytes:
        return record(
            name, number, struct.pack("<bB", kind, len(sizes)) + bytes(sizes) + raw + b"\0"
        )

    def parameters(n_blocks: int) -> bytes:
        start, number = struct.pack("<h", 2 + n_blocks), struct.pack
        records = (
            record("POINT", -1, b"\0") + value("USED", 1, 2, number("<h", 0))
            + value("FRAMES", 1, 2, number("<h", n_frames)) + value("UNITS", 1, -1, b"mm", (2,))
            + value("RATE", 1, 4, number("<f", rate_hz / ratio)) + value("DATA_START", 1, 2, start)
            + value("SCALE", 1, 4, number("<f", -1.0)) + record("ROTATION", -2, b"\0")
            + value("USED", 2, 2, number("<h", poses.shape[1])) + value("DATA_START", 2, 2, start)
            + value("RATIO", 2, 2, number("<h", ratio)) + value("RATE", 2, 4, number("<f", rate_hz))
            + value("LABELS", 2, -1, texts, (length, len(labels))) + record("ANALOG", -3, b"\0")
            + value("USED", 3, 2, number("<h", 0))
        )  # fmt: skip
        return bytes([1, 0x50, n_blocks, 84]) + records

    n_blocks = -(-len(parameters(0)) // 512)
    counts = (2, 0x50, 0, 0, 1, n_frames, 0, -1.0, 2 + n_blocks, 0, rate_hz / ratio)
    data = struct.pack("<BB5HfHHf", *counts).ljust(512, b"\0")
    data += parameters(n_blocks).ljust(512 * n_blocks, b"\0")
    rows = np.zeros((*poses.shape[:2], 17), dtype="<f4")
    rows[..., :16] = poses.swapaxes(-1, -2).reshape(*poses.shape[:2], 16)
    data += rows.tobytes()
    path.write_bytes(data + b"\0" * (-len(data) % 512))
    return path
