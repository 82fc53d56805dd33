"""The rate of a file that does not say it: from its name, or from a JSON file beside it."""

from __future__ import annotations

import json
import re
from pathlib import Path

from .files import head, stem
from .findings import Findings

_IN_NAME = re.compile(r"(?<![\d.])(\d{2,4}(?:[.p]\d{1,3})?)[ _-]?(?:hz|fps)(?![a-z])", re.I)
_KEYS = ("samplingfrequency", "samplingrate", "framerate", "fps", "ratehz", "rate", "frequency")
_MOST_BYTES = 1_000_000
_RATES_HZ = (1.0, 10_000.0)


def rate_beside(path: Path, findings: Findings) -> float | None:
    """Return the rate [1/s] that a file's name says, or the JSON file of the same name beside it.

    ``walk_120hz.csv``; ``walk.json`` with ``SamplingFrequency``, as Motion-BIDS has it,
    ``frame_rate``, ``fps``, ... at its top.
    """
    match = _IN_NAME.search(stem(path))
    if match is not None:
        rate_hz = float(match[1].lower().replace("p", "."))
        if _possible(rate_hz):
            findings.note(f"{rate_hz:g} Hz, as the file's name says")
            return rate_hz
    sidecar = path.with_name(f"{stem(path)}.json")
    try:
        content = json.loads(head(sidecar, _MOST_BYTES) or b"null")
    except (ValueError, RecursionError):
        return None
    if not isinstance(content, dict):
        return None
    said = {re.sub(r"[^a-z]", "", str(key).lower()): value for key, value in content.items()}
    for key in _KEYS:
        rate = said.get(key)
        if isinstance(rate, int | float) and not isinstance(rate, bool) and _possible(rate):
            findings.note(f"{rate:g} Hz, as {sidecar.name} says")
            return float(rate)
    return None


def _possible(rate_hz: float) -> bool:
    low, high = _RATES_HZ
    return low <= rate_hz <= high
