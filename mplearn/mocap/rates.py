"""The rate of a file that does not say it: from its name, or from a JSON file beside it."""

from __future__ import annotations

import json
import re
from pathlib import Path

from .files import head, stem
from .findings import Findings

_IN_NAME = re.compile(
    r"(?<![\d.])(?:(?:480|540|720|1080|1440|2160)[pi][ _-]?)?"  # lines of a video: 1080p60fps
    r"(?P<rate>\d{2,4}(?:[.p]\d{1,3})?)[ _-]?(?:hz|fps)(?![a-z])",
    re.I,
)
_OF_A_FILTER = re.compile(
    r"(?:low|high|band|lp|hp|bp|filt|filter|filtered|butter|butterworth|cut|cutoff|fc)"
    r"[ _-]?(?:pass)?[ _-]?$",
    re.I,
)
_KEYS = ("samplingfrequency", "samplingrate", "framerate", "fps", "ratehz", "rate", "frequency")
_MOST_BYTES = 1_000_000
_RATES_HZ = (1.0, 10_000.0)


def rate_beside(path: Path, findings: Findings) -> float | None:
    """Return the rate [1/s] that a file's name says, or the JSON file of the same name beside it.

    ``walk_120hz.csv``; ``walk.json`` with ``SamplingFrequency``, as Motion-BIDS has it,
    ``frame_rate``, ``fps``, ... at its top. The frequency of a filter, ``walk_lowpass_10hz.csv``,
    is no rate; a name with two rates says none.
    """
    named = _rates_in(stem(path))
    if len(named) == 1:
        findings.note(f"{named[0]:g} Hz, as the file's name says")
        return named[0]
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


def _rates_in(name: str) -> list[float]:
    """Return the rates that a name says [1/s], each once."""
    found = [
        float(match["rate"].lower().replace("p", "."))
        for match in _IN_NAME.finditer(name)
        if not _OF_A_FILTER.search(name[: match.start()])
    ]
    return list(dict.fromkeys(filter(_possible, found)))


def _possible(rate_hz: float) -> bool:
    low, high = _RATES_HZ
    return low <= rate_hz <= high
