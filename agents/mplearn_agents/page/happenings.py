"""What a learner says, as plain values: where the stream was cut, and what happened.

Primitives stand in texts as ``{id}``: the page puts the name there that they have by now.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import Any

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
    SegmentClosed,
)
from mplearn.recording import Segment
from mplearn.tree import Placement

from .messages import Header, mention

_FAR = 10.0  # farther than so many times what is allowed, it is not said how far


def tell(events: Iterable[Event], rate_hz: float) -> Iterator[Header]:
    """Yield messages about events, in their order.

    Args:
        events: What the learner said.
        rate_hz: Frames per second [1/s].
    """
    for event in events:
        if isinstance(event, SegmentClosed):
            yield _segment(event.segment, event.placement)
        frame = event.frame if isinstance(event, PersonChanged | AxesChanged) else _end(event)
        said = _said(event, rate_hz)
        if said is not None:
            what, text, primitive = said
            yield happening(what, text, frame / rate_hz, primitive)


def happening(what: str, text: str, time_s: float, primitive: int | None = None) -> Header:
    """Return the message that something happened."""
    return {
        "kind": "event",
        "what": what,
        "text": text,
        "time_s": round(time_s, 2),
        "primitive": primitive,
    }


def _end(event: Any) -> int:
    return event.end if isinstance(event, FramesLost) else event.segment.end


def _segment(segment: Segment, placement: Placement | None) -> Header:
    message: Header = {
        "kind": "segment",
        "start": segment.start,
        "end": segment.end,
        "state": "still",
        "primitive": None,
        "why": "",
    }
    if placement is None:
        return message
    if placement.refused:
        return message | {"state": "refused", "why": placement.refused}
    if placement.born:
        id = placement.node_id if placement.node_id in placement.born else None
        return message | {"state": "new", "primitive": id}
    if placement.recognised:
        return message | {"state": "known", "primitive": placement.node_id}
    return message | {"state": "unlike", "why": _why(placement)}


def _why(placement: Placement) -> str:
    """Return why a segment was not recognised."""
    if placement.nearest is None or not math.isfinite(placement.ratio):
        why = "nothing is known to compare it with"
    elif placement.ratio > 1.0:
        times = f"{max(placement.ratio, 1.01):.{2 if placement.ratio < 1.1 else 1}f}"
        if placement.ratio > _FAR:
            times = f"more than {_FAR:.0f}"
        why = f"nearest is {mention(placement.nearest)}, {times} times as far as allowed"
    else:
        why = f"it is near {mention(placement.nearest)}, but not surely of it"
    return why + ("; it came before, and waits" if placement.like is not None else "")


def _said(event: Event, rate_hz: float) -> tuple[str, str, int | None] | None:
    """Return what kind of happening an event is, its text, and which primitive it is about."""
    match event:
        case SegmentClosed(_, placement) if placement is not None and not placement.recognised:
            if placement.refused:
                return "rejected", f"not a motion: {placement.refused}", None
            if not placement.born:
                return "rejected", f"not recognised: {_why(placement)}", placement.nearest
        case PrimitiveBorn(_, id, n, provisional):
            sure = "" if provisional else ", and is sure"
            return "born", f"new: {mention(id)}, from {n} demonstrations{sure}", id
        case PrimitiveConfirmed(_, id, n):
            return "learned", f"learned: {mention(id)}, shown {n} times", id
        case PrimitiveForgotten(_, id, part):
            why = "was a part of a motion" if part else "never came again"
            return "gone", f"forgotten: {mention(id)} {why}", id
        case PrimitiveMerged(_, id, absorbed):
            return "merged", f"{mention(absorbed)} turned out to be {mention(id)}", id
        case PrimitiveSplit(_, id, into):
            parts = " and ".join(mention(each) for each in into)
            return "split", f"{mention(id)} turned out to be {parts}", into[0] if into else None
        case PersonChanged(_, person, new):
            return "person", f"person {person + 1} " + ("is new here" if new else "is back"), None
        case FramesLost(start, end, reason):
            return "lost", f"{(end - start) / rate_hz:.1f} s left out: {reason}", None
        case AxesChanged(_, size):
            unit = "" if abs(size - 1) < 0.01 else f", its unit by {size:.3g}"
            return "source", f"the stream's axes changed{unit}: undone from here on", None
        case Anomaly(_, "order", score, p_value):
            return "anomaly", f"an unusual order (p = {p_value:.2g}, {score:.1f} nat)", None
        case _:
            pass
    return None
