"""What a learner says: every event is a value, returned by `MotionLearner.learn_one`.

Times are frames since the learner's first frame; where a stream ends and another starts, counting
goes on.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, is_dataclass
from typing import Any, Literal, TypeAlias

import numpy as np

from ..recording import Segment
from ..tree import Placement


@dataclass(frozen=True)
class SegmentClosed:
    """The segmenter closed a segment.

    Attributes:
        segment: Where it lies, and how sure its end is.
        placement: All that the tree said of it; None for a pause, which the tree does not see.
    """

    segment: Segment
    placement: Placement | None = None


@dataclass(frozen=True)
class Recognised:
    """A segment was placed in a primitive that is already known.

    Attributes:
        segment: The segment.
        primitive: Id of the primitive.
        distance: Symmetric likelihood distance to it [nats a frame] ([Kulic2012] eq. 5).

    Example:
        >>> event = Recognised(Segment(100, 180), primitive=3, distance=0.8)
        >>> match event:
        ...     case Recognised(segment, primitive):
        ...         print(f"primitive {primitive} until frame {segment.end}")
        primitive 3 until frame 180
    """

    segment: Segment
    primitive: int
    distance: float


@dataclass(frozen=True)
class PrimitiveBorn:
    """The tree formed a new primitive.

    Attributes:
        segment: The segment whose arrival formed it.
        primitive: Its id, for life.
        exemplars: How many demonstrations it was formed from.
        provisional: Whether it is yet to be confirmed by more (`TreeConfig.confirmed`); it is
            recognised all the same.
    """

    segment: Segment
    primitive: int
    exemplars: int
    provisional: bool = False


@dataclass(frozen=True)
class PrimitiveConfirmed:
    """A provisional primitive has been shown often enough to be sure.

    Attributes:
        segment: The segment that confirmed it.
        primitive: Its id.
        exemplars: How many demonstrations it has by now.
    """

    segment: Segment
    primitive: int
    exemplars: int


@dataclass(frozen=True)
class PrimitiveForgotten:
    """A provisional primitive was never confirmed, and is gone.

    Attributes:
        segment: The segment whose arrival made it too old.
        primitive: Id that it had.
    """

    segment: Segment
    primitive: int


@dataclass(frozen=True)
class PrimitiveMerged:
    """Two primitives turned out to be one.

    Attributes:
        segment: The segment whose arrival showed it.
        primitive: Id that stays.
        absorbed: Id that is gone; its counts went to ``primitive``.
    """

    segment: Segment
    primitive: int
    absorbed: int


@dataclass(frozen=True)
class PrimitiveSplit:
    """A primitive turned out to be several.

    Attributes:
        segment: The segment whose arrival showed it.
        primitive: Id of the node that was split; it stays in the tree as a more general motion.
        into: Ids of the new primitives.
    """

    segment: Segment
    primitive: int
    into: tuple[int, ...]


@dataclass(frozen=True)
class TransitionSeen:
    """Two recognised primitives followed each other.

    Attributes:
        segment: The later segment.
        previous: Id of the earlier primitive.
        primitive: Id of the later one.
        count: How often this pair has been seen by now.
    """

    segment: Segment
    previous: int
    primitive: int
    count: int


@dataclass(frozen=True)
class PersonChanged:
    """Somebody else stands there than before; what comes next does not follow what came.

    Attributes:
        frame: First frame of that person.
        person: Number of the person, 0, 1, ... in the order of their coming.
        new: Whether he or she was never seen before.
    """

    frame: int
    person: int
    new: bool


@dataclass(frozen=True)
class FramesLost:
    """Nothing was learned from a stretch of the stream, for it shows what cannot be.

    A short stretch is bridged: the motion goes on through it. Where it lasts longer, the motion
    that was going on counts as lost too, and what comes next does not follow what came.

    Attributes:
        start: First frame.
        end: One past the last.
        reason: What is wrong with it.
    """

    start: int
    end: int
    reason: str


@dataclass(frozen=True)
class AxesChanged:
    """The stream's origin, axes or unit changed, and nobody moved: it is undone from here on.

    Attributes:
        frame: First frame that was found so.
        size: Size of its unit, relative to the stream's at its start.
    """

    frame: int
    size: float


@dataclass(frozen=True)
class Anomaly:
    """Something out of the ordinary.

    Attributes:
        segment: Where.
        kind: ``"motion"``: unlike every known primitive; ``"order"``: known motions, but in an
            unusual order.
        score: How far out: the distance to the nearest primitive over what is usual there
            (`mplearn.library.MotionNovelty`), or the surprise of the transition [nat].
        p_value: Share of what was learned that is at least as far out, in (0, 1].
    """

    segment: Segment
    kind: Literal["motion", "order"]
    score: float
    p_value: float


Event: TypeAlias = (
    SegmentClosed
    | Recognised
    | PrimitiveBorn
    | PrimitiveConfirmed
    | PrimitiveForgotten
    | PrimitiveMerged
    | PrimitiveSplit
    | TransitionSeen
    | Anomaly
    | PersonChanged
    | FramesLost
    | AxesChanged
)


def plain_event(event: Event, rate_hz: float) -> dict[str, Any]:
    """Return an event as plain values, which JSON can hold.

    Args:
        event: What a learner said.
        rate_hz: Frames per second of its stream [1/s].

    Returns:
        ``"event"``, its kind; ``"time_s"``, when it was said to be, since the learner's first frame
        [s]; and its fields by name. What is not finite, as the distance where nothing is known, is
        None.

    Example:
        >>> plain_event(Recognised(Segment(0, 80, cause="rest"), 3, 0.25), 100.0)["time_s"]
        0.8
    """
    if isinstance(event, PersonChanged | AxesChanged):
        frame = event.frame
    else:
        frame = event.end if isinstance(event, FramesLost) else event.segment.end
    plain = {each.name: _plain(getattr(event, each.name)) for each in fields(event)}
    return {"event": type(event).__name__, "time_s": frame / rate_hz, **plain}


def _plain(value: Any) -> Any:
    if is_dataclass(value) and not isinstance(value, type):
        return {each.name: _plain(getattr(value, each.name)) for each in fields(value)}
    if isinstance(value, tuple):
        named = getattr(value, "_asdict", None)
        if named is not None:
            return {name: _plain(each) for name, each in named().items()}
        return [_plain(each) for each in value]
    if isinstance(value, np.generic):
        value = value.item()
    return None if isinstance(value, float) and not math.isfinite(value) else value
