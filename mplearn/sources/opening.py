"""The door: the name of a source to the motion of a body, live."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from ..arguments import path_of
from ..mocap import Hints
from .played import play_demonstrator, play_recording
from .protocols.lsl import open_lsl
from .protocols.natnet import open_natnet
from .protocols.own import open_ndjson, open_udp
from .protocols.qtm import open_qtm
from .protocols.vmc import open_vmc
from .protocols.xsens import open_xsens
from .rate import ResampledSource
from .recognised import RecognisedSource
from .recorded import RecordedSource
from .registry import Observe, Wanted, connect, register_source
from .source import Source

register_source("recording", play_recording)
register_source("demonstrator", play_demonstrator)
register_source("lsl", open_lsl)
register_source("qtm", open_qtm)
register_source("natnet", open_natnet)
register_source("vmc", open_vmc)
register_source("xsens", open_xsens)
register_source("ndjson", open_ndjson)
register_source("udp", open_udp)


def open_source(
    name: str,
    *,
    observe: Observe = "robot",
    hints: Hints | None = None,
    names: Mapping[str, str] | None = None,
    at_hz: float | Callable[[float], float] | None = None,
    record: str | os.PathLike[str] | None = None,
    **options: Any,
) -> Source:
    """Open a live source: what it yields can be learned as it comes.

    Args:
        name: What, as ``"recording:walk.bvh"`` or ``"demonstrator"``; `source_kinds` lists all.
        observe: ``"robot"``: a body is recognised in markers or joints, as in files; or
            ``"positions"`` of markers and joints, or the stream's own ``"channels"``.
        hints: What the stream does not say about itself: its unit, its vertical axis, whether its
            axes are left-handed.
        names: Place of the body by marker or joint, for what is known better.
        at_hz: Frames per second of what is yielded [1/s], or what gives it for the stream's own
            rate, as `mplearn.learner.learnable_rate`; the stream's own where None.
        record: XDF file to write what comes to, as it comes.
        options: Of the source, as ``speed=2.0`` for a recording.

    Returns:
        A source whose blocks all have the same channels and rate: with
        ``LearnerConfig(block.channels, block.rate_hz)`` a learner takes them.

    Raises:
        InvalidValueError: There is no such source, or an option is not allowed.
        MissingDependencyError: The source needs an extra that is not installed.
        MPLearnError: It cannot be opened, with the reason.

    Example:
        >>> from mplearn import LearnerConfig, MotionLearner
        >>> from mplearn.sources import Block
        >>> learner = None
        >>> with open_source("demonstrator:7", speed=float("inf")) as source:
        ...     for item in source:
        ...         if not isinstance(item, Block):
        ...             continue
        ...         if learner is None:
        ...             learner = MotionLearner(LearnerConfig(item.channels, item.rate_hz))
        ...         events = learner.learn_many(item.frames)
        ...         if learner.n_frames >= 500:
        ...             break
        >>> learner.config.channels[0], learner.config.rate_hz
        ('LFHD.x', 100.0)
    """
    wanted = Wanted(observe, hints or Hints(), names)
    path = None if record is None else path_of("record", record)
    raw = connect(name, wanted, **options)
    if path is not None:
        raw = _recorded(raw, path)
    source = RecognisedSource(raw, wanted)
    return source if at_hz is None else ResampledSource(source, at_hz)


def _recorded(source: Source, path: Path) -> Source:
    try:
        return RecordedSource(source, path)
    except BaseException:
        source.close()
        raise
