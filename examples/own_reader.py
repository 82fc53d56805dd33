"""Read a format of one's own: here a JSON file of marker positions.

python examples/own_reader.py
"""

import json
from pathlib import Path

import numpy as np

from mplearn import Recording, open_recording
from mplearn.mocap import Hints, Reader, bad_file, read_text, register_reader
from mplearn.mocap.files import stem
from mplearn.recording import marker_channels


class JSONMarkers(Reader):
    """``{"rate": 100, "markers": {"LFHD": [[x, y, z], ...], ...}}`` in metres, z up."""

    format = "JSON markers"
    suffixes = (".json",)

    def read(self, path: Path, hints: Hints, *, positions: bool) -> Recording:
        try:
            content = json.loads(read_text(path))
            markers = {name: np.array(xyz, dtype=float) for name, xyz in content["markers"].items()}
            rate_hz = hints.rate_hz or float(content["rate"])
            frames = np.concatenate(list(markers.values()), axis=1)
        except (ValueError, KeyError, TypeError, AttributeError) as error:
            raise bad_file(path, f"{type(error).__name__}: {error}", "markers by name") from error
        return Recording(frames, rate_hz, marker_channels(tuple(markers)), name=stem(path))


register_reader(JSONMarkers())  # from here on, open_recording and the readers of folders know it

path = Path("wave.json")
wave = [[0.1 * np.sin(t / 10), 0.0, 1.5] for t in range(50)]
path.write_text(json.dumps({"rate": 50, "markers": {"RWRA": wave, "RELB": wave}}))
recording = open_recording(path)
print(recording.channels, recording.frames.shape, f"{recording.rate_hz:g} Hz")
path.unlink()
