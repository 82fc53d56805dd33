"""The part of a BVH file from ``MOTION`` on: the rate and a row of numbers for each frame."""

from __future__ import annotations

import re
import warnings
from pathlib import Path

import numpy as np

from ....option_names import option
from ....recording import FloatArray, IntArray
from ...files import bad_file
from ...findings import Findings
from .numbers import missing_or_number, split_glued

_HEADER = re.compile(r"\s*(frame\s*time|frames?)\s*:?\s*(?![a-z])(.*)", re.IGNORECASE)
_STEP = re.compile(r"\s*([-+]?[\d.,]+(?:[edED][-+]?\d+)?)\s*(ms|msec|milliseconds)?", re.I)
_BEGUN = re.compile(r"(?<=\s)[-+]?(?:\.|\d+\.?\d*[eE][-+]?)?\Z")  # of a number that is cut off
_STEP_S = (1e-5, 1.0)
_COMMON_HZ = (24, 25, 30, 50, 60, 72, 75, 90, 100, 120, 144, 150, 200, 240)
_USUAL_HZ = (24, 25, 30, 48, 50, 60, 72, 75, 90, 100, 120, 125, 144, 150, 200, 240, 250, 300, 360,
             400, 480, 500, 600, 1000)  # fmt: skip


def parse_motion(
    path: Path,
    text: str,
    first_line: int,
    width: int,
    rate_hz: float | None,
    findings: Findings,
) -> tuple[FloatArray, float]:
    """Return the frames and their rate.

    Args:
        path: The file, for messages.
        text: What follows ``MOTION``.
        first_line: Number of its first line in the file, for messages.
        width: How many numbers a frame has.
        rate_hz: The rate that is known otherwise [1/s].
        findings: Where to tell what contradicts itself.

    Returns:
        Shape (T, width), NaN where a cell is missing; and frames per second [1/s].

    Raises:
        RecordingError: There are no frames, they have another width, or the rate is not known.
    """
    said: dict[str, str] = {}
    at = 0
    while at < len(text):
        end = text.find("\n", at)
        end = len(text) if end < 0 else end
        match = _HEADER.match(text, at, end)
        if match is not None:
            said["Frame Time" if "t" in match[1].lower() else "Frames"] = match[2].strip()
        elif text[at:end].strip():
            break
        at = end + 1
        first_line += 1
    rate_hz = rate_hz or _rate(path, said.get("Frame Time", ""), findings)
    flat, counts, lines = _flat(path, _BEGUN.sub("", text[at:]), first_line, findings)
    flat, counts = _without_extra(flat, counts, width, findings)
    said_frames = said.get("Frames", "")[:12]
    n_said = int(said_frames) if said_frames.isdecimal() else None
    n_frames = _frames_in(path, counts, lines, width, n_said, findings)
    if n_said != n_frames and n_frames * width == len(flat):
        findings.warn(
            f"{n_frames} frames are there and read; 'Frames:' says {said_frames or 'nothing'}"
        )
    values = flat[: n_frames * width].reshape(n_frames, width)
    n_missing = int(np.isnan(values).sum())
    if n_missing:
        findings.warn(f"{n_missing} cells are not numbers: taken as missing")
    return values, rate_hz


def _rate(path: Path, text: str, findings: Findings) -> float:
    """Return the rate of a frame time, a usual one where the digits that are written allow it.

    Where frames a second or milliseconds are written, one of which is usual, that is taken.
    """
    match = _STEP.match(text)
    plain, in_ms = (match[1].replace(",", "."), bool(match[2])) if match else (text, False)
    step_s = missing_or_number(plain) if plain else None
    if step_s is not None and in_ms:
        step_s, plain = 1e-3 * step_s, ""
    low, high = _STEP_S
    if step_s is None or not low < step_s <= high:
        meant = [(step_s, "frames a second"), (1000.0 / step_s, "milliseconds")] if step_s else []
        usual = [(rate, what) for rate, what in meant if _is_usual(rate)]
        if len(usual) == 1:
            (rate_hz, what), said = usual[0], option("rate_hz", f"{step_s:.6g}")
            findings.warn(f"Frame Time: {text[:40]} is taken as {what} ({said} sets the rate)")
            return float(min(_USUAL_HZ, key=lambda rate: abs(rate - rate_hz)))
        rates = [1.0 / step_s, 1000.0 / step_s, step_s] if step_s and step_s > 0 else []
        fitting = [f"{rate:.4g}" for rate in rates if 20.0 <= rate <= 1000.0]
        raise bad_file(
            path,
            f"Frame Time: {text[:40]}" if text else "no 'Frame Time:'",
            f"seconds between frames, as 0.00833; {option('rate_hz', (fitting or ['...'])[0])} "
            "says what is right",
        )
    digits = plain.partition(".")[2]
    decimals = len(digits) if digits.isdecimal() else 15
    near = min(_USUAL_HZ, key=lambda rate: abs(1.0 / rate - step_s))
    off = abs(1.0 / near - step_s)
    return float(near) if off <= 1.001 * 10.0**-decimals and off < 0.02 * step_s else 1.0 / step_s


def _is_usual(rate_hz: float) -> bool:
    return any(abs(rate_hz / usual - 1.0) < 0.02 for usual in _COMMON_HZ)


def _flat(
    path: Path, text: str, first_line: int, findings: Findings
) -> tuple[FloatArray, IntArray, IntArray]:
    """Return all numbers, how many each line with any has, and which line of the file it is."""
    if ";" in text:
        text = text.replace(";", " ")
    if "," in text:
        text = text.replace(",", " " if "." in text else ".")
    with warnings.catch_warnings():
        warnings.simplefilter("error", DeprecationWarning)  # by which numpy says: no number
        try:
            flat: FloatArray = np.fromstring(text, sep=" ")
        except (DeprecationWarning, ValueError):
            return _flat_by_line(path, text, first_line, findings)
    if np.isinf(flat).any():
        return _flat_by_line(path, text, first_line, findings)
    codes = np.frombuffer(text.encode(), np.uint8)
    blank = codes <= ord(" ")
    starts = ~blank
    starts[1:] &= blank[:-1]
    breaks = np.append(np.flatnonzero(codes == ord("\n")), len(codes))
    counts = np.diff(np.searchsorted(np.flatnonzero(starts), breaks), prepend=0)
    used = np.flatnonzero(counts)
    return flat, counts[used], used + first_line


def _flat_by_line(
    path: Path, text: str, first_line: int, findings: Findings
) -> tuple[FloatArray, IntArray, IntArray]:
    """Do the same where some cell is no plain number."""
    parts: list[FloatArray] = []
    places: list[int] = []
    behind: list[int] = []  # lines of text, which nothing but text may follow
    for place, line in enumerate(text.split("\n"), start=first_line):
        cells = line.split()
        if not cells:
            continue
        values: list[float] = []
        for column, cell in enumerate(cells, start=1):
            split = [missing_or_number(part) for part in split_glued(cell)]
            known = [value for value in split if value is not None]
            if len(known) < len(split) and column == 1:
                behind.append(place)
                break
            where = f"line {place}, column {column}"
            if len(known) < len(split):
                raise bad_file(path, f"{where} holds {cell[:40]!r}", "a number")
            if np.isinf(known).any():
                raise bad_file(path, f"{where} is too large", "a number")
            values += known
        else:
            if behind:
                raise bad_file(path, f"line {behind[0]} holds text", "a number for each channel")
            parts.append(np.array(values))
            places.append(place)
    if behind:
        findings.warn(f"text behind the frames, from line {behind[0]} on, is left out")
    counts = np.array([len(part) for part in parts], dtype=np.int64)
    return np.concatenate(parts) if parts else np.zeros(0), counts, np.array(places, dtype=np.int64)


def _without_extra(
    flat: FloatArray, counts: IntArray, width: int, findings: Findings
) -> tuple[FloatArray, IntArray]:
    """Leave out a value more in each line if it is plainly no channel: it counts, or is 0."""
    if len(counts) < 2 or not (counts == width + 1).all():
        return flat, counts
    table = flat.reshape(-1, width + 1)
    first, last = table[:, 0], table[:, -1]
    if (np.diff(first) > 0).all() and np.ptp(np.diff(first)) < 1e-3 * np.diff(first)[0]:
        findings.warn("each line begins with a number of its frame, or its time: left out")
        return table[:, 1:].ravel(), counts - 1
    if not last.any():
        findings.warn("each line ends with a 0 that is no channel: left out")
        return table[:, :-1].ravel(), counts - 1
    return flat, counts


def _frames_in(
    path: Path,
    counts: IntArray,
    lines: IntArray,
    width: int,
    n_said: int | None,
    findings: Findings,
) -> int:
    """Return how many frames the lines make: one each, or wrapped so that each starts a line."""
    total = int(counts.sum())
    if not total or not width:
        raise bad_file(path, f"no frames of {width} channels", "at least one")
    n_frames, rest = divmod(total, width)
    ends = np.cumsum(counts)
    wanted = width * np.arange(1, n_frames + 1)
    begun = np.isin(wanted, ends)
    one_line = len(counts) == 1 and n_frames == n_said
    wrapped = len(counts) > n_frames + bool(rest) and n_said == len(counts)
    wrong = np.flatnonzero(counts != width)
    if not (begun.all() or one_line) or wrapped or (rest and not n_frames):
        bad = int(wrong[0]) if len(wrong) else 0
        raise bad_file(
            path, f"line {lines[bad]} has {counts[bad]} columns", f"{width}, one a channel"
        )
    if rest:
        findings.warn(f"the last frame is cut off after {rest} of {width} numbers: left out")
    return n_frames
