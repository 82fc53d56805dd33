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

    Example:
        >>> import numpy as np
        >>> from mplearn import LearnerConfig, MotionLearner
        >>> t = np.arange(400) / 100.0
        >>> swing = np.where(t % 2 < 1, np.sin(np.pi * t) ** 2, 0.0)[:, None]  # up, down, a rest
        >>> learner = MotionLearner(LearnerConfig(("elbow",), segmenter="zero-velocity"))
        >>> closed = [e for e in learner.learn_many(swing) if isinstance(e, SegmentClosed)]
        >>> [(e.segment.start, e.segment.end, e.placement is None) for e in closed[:3]]  # a rest
        [(0, 50, False), (50, 100, False), (100, 201, True)]
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

    Example:
        >>> import numpy as np
        >>> from mplearn import LearnerConfig, MotionLearner
        >>> t = np.arange(800) / 100.0
        >>> swing = np.where(t % 2 < 1, np.sin(np.pi * t) ** 2, 0.0)[:, None]  # up, down, a rest
        >>> learner = MotionLearner(LearnerConfig(("elbow",), segmenter="zero-velocity"))
        >>> events = learner.learn_many(swing)
        >>> [event.primitive for event in events if isinstance(event, PrimitiveBorn)]
        [1, 2]
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

    Example:
        >>> event = PrimitiveConfirmed(Segment(401, 450), primitive=1, exemplars=3)
        >>> f"primitive {event.primitive} is sure after {event.exemplars} demonstrations"
        'primitive 1 is sure after 3 demonstrations'
    """

    segment: Segment
    primitive: int
    exemplars: int


@dataclass(frozen=True)
class PrimitiveForgotten:
    """A primitive is gone: a provisional one that nothing confirmed, or one of parts of a motion.

    Attributes:
        segment: The segment whose arrival made it too old, or after which it was looked at.
        primitive: Id that it had.
        part: Whether it was born of parts of a motion.

    Example:
        >>> names = {1: "wave", 2: "stumble"}
        >>> event = PrimitiveForgotten(Segment(9000, 9080), primitive=2)
        >>> names.pop(event.primitive), names  # it will not be recognised again
        ('stumble', {1: 'wave'})
    """

    segment: Segment
    primitive: int
    part: bool = False


@dataclass(frozen=True)
class PrimitiveMerged:
    """Two primitives turned out to be one.

    Attributes:
        segment: The segment whose arrival showed it.
        primitive: Id that stays.
        absorbed: Id that is gone; its counts went to ``primitive``.

    Example:
        >>> counts = {1: 5, 4: 2}
        >>> event = PrimitiveMerged(Segment(9000, 9080), primitive=1, absorbed=4)
        >>> counts[event.primitive] += counts.pop(event.absorbed)
        >>> counts
        {1: 7}
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

    Example:
        >>> event = PrimitiveSplit(Segment(9000, 9080), primitive=4, into=(7, 8))
        >>> match event:
        ...     case PrimitiveSplit(primitive=general, into=special):
        ...         print(f"{general} was {len(special)} motions: {special}")
        4 was 2 motions: (7, 8)
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

    Example:
        >>> import numpy as np
        >>> from mplearn import LearnerConfig, MotionLearner
        >>> t = np.arange(800) / 100.0
        >>> swing = np.where(t % 2 < 1, np.sin(np.pi * t) ** 2, 0.0)[:, None]  # up, down, a rest
        >>> learner = MotionLearner(LearnerConfig(("elbow",), segmenter="zero-velocity"))
        >>> seen = [e for e in learner.learn_many(swing) if isinstance(e, TransitionSeen)]
        >>> {(event.previous, event.primitive) for event in seen} == {(1, 2), (2, 1)}
        True
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

    Example:
        >>> event = PersonChanged(frame=7200, person=1, new=True)
        >>> f"person {event.person} is {'new here' if event.new else 'back'}"
        'person 1 is new here'
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

    Example:
        >>> import numpy as np
        >>> from mplearn import LearnerConfig, MotionLearner
        >>> learner = MotionLearner(LearnerConfig(("elbow",)))
        >>> t = np.arange(400) / 100.0
        >>> stream = np.sin(t)[:, None]
        >>> stream[200:300] = 1e300  # the sender is broken
        >>> for event in learner.learn_many(stream):
        ...     if isinstance(event, FramesLost):
        ...         print(event.start, event.end)
        157 300
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

    Example:
        >>> event = AxesChanged(frame=12000, size=1000.0)  # metres became millimetres
        >>> f"from frame {event.frame} on lengths are divided by {event.size:g}"
        'from frame 12000 on lengths are divided by 1000'
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

    Example:
        >>> event = Anomaly(Segment(9000, 9080), kind="motion", score=4.2, p_value=0.008)
        >>> event.p_value <= 0.01  # so far out is one motion in a hundred, at most
        True
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
