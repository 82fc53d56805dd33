"""Events of a learner and of a source, a line each: for people, or as JSON."""

from __future__ import annotations

import json
from dataclasses import fields

from mplearn.learner import (
    Anomaly,
    AxesChanged,
    Event,
    FramesLost,
    PersonChanged,
    PrimitiveBorn,
    PrimitiveConfirmed,
    PrimitiveForgotten,
    PrimitiveMerged,
    PrimitiveSplit,
    Recognised,
    SegmentClosed,
    TransitionSeen,
    plain_event,
)
from mplearn.recording import Segment
from mplearn.sources import Change
from mplearn_agents.terminal.inert import printable


def event_text(event: Event, rate_hz: float) -> str | None:
    """Return a line on an event; None for one that only repeats what another one says.

    Args:
        event: What a learner said.
        rate_hz: Frames per second of its stream [1/s].
    """
    match event:
        case SegmentClosed(segment, placement):
            if segment.still or (placement is not None and placement.recognised):
                return None
            return _line(segment.end, rate_hz, f"a motion of {_length(segment, rate_hz)}, new")
        case Recognised(segment, primitive, distance):
            text = f"primitive {primitive}, {_length(segment, rate_hz)} (distance {distance:.2f})"
            return _line(segment.end, rate_hz, text)
        case PrimitiveBorn(segment, primitive, exemplars, provisional):
            kind = "provisional: " if provisional else ""
            text = f"learned primitive {primitive} ({kind}{exemplars} demonstrations)"
            return _line(segment.end, rate_hz, text)
        case PrimitiveConfirmed(segment, primitive, exemplars):
            text = f"confirmed primitive {primitive} ({exemplars} demonstrations)"
            return _line(segment.end, rate_hz, text)
        case PrimitiveForgotten(segment, primitive, part):
            why = "a part of a motion" if part else "never confirmed"
            return _line(segment.end, rate_hz, f"forgot primitive {primitive}: {why}")
        case PrimitiveMerged(segment, primitive, absorbed):
            return _line(segment.end, rate_hz, f"primitive {absorbed} is {primitive}: merged")
        case PrimitiveSplit(segment, primitive, into):
            text = f"primitive {primitive} is several: {', '.join(map(str, into))}"
            return _line(segment.end, rate_hz, text)
        case TransitionSeen(segment, previous, primitive, count):
            if count > 1:
                return None
            return _line(
                segment.end, rate_hz, f"{primitive} followed {previous} for the first time"
            )
        case Anomaly(segment, kind, score, p_value):
            what = "unlike every primitive" if kind == "motion" else "in an unusual order"
            text = f"anomaly: {what} (score {score:.2f}, p {p_value:.3g})"
            return _line(segment.end, rate_hz, text)
        case PersonChanged(frame, person, new):
            who = "somebody new" if new else "known"
            return _line(frame, rate_hz, f"person {person} moves now ({who})")
        case FramesLost(start, end, reason):
            text = f"nothing learned from {(end - start) / rate_hz:.2f} s: {reason}"
            return _line(end, rate_hz, text)
        case AxesChanged(frame, size):
            return _line(frame, rate_hz, f"the axes changed, or the unit (by {size:.4g}): undone")


def change_text(change: Change) -> str:
    """Return a line on what happened to a source."""
    return f"{change.time_s:9.2f} s  {change.kind}: {printable(change.text)}"


def event_json(event: Event, rate_hz: float) -> str:
    """Return an event as a JSON object: its name, its time [s], and its fields as they are."""
    return json.dumps(plain_event(event, rate_hz))


def change_json(change: Change) -> str:
    """Return what happened to a source as a JSON object."""
    plain = {field.name: getattr(change, field.name) for field in fields(change)}
    return json.dumps({"event": "Change", **plain})


def _line(frame: int, rate_hz: float, text: str) -> str:
    return f"{frame / rate_hz:9.2f} s  {text}"


def _length(segment: Segment, rate_hz: float) -> str:
    return f"{segment.length_frames / rate_hz:.2f} s"
