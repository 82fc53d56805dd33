"""Learning from a live source: events as they come, what was lost, and an orderly end."""

from __future__ import annotations

import argparse
import json
import math
import sys
import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from threading import Event as Flag
from typing import TYPE_CHECKING, Any

from mplearn.errors import RecordingError
from mplearn_agents.learning.keeping import keep, say_unkept
from mplearn_agents.learning.pauses import short_pauses
from mplearn_agents.recordings.reading import hints_of
from mplearn_agents.terminal.arguments import pace, positive
from mplearn_agents.terminal.exit_codes import INTERRUPTED, NOT_KEPT
from mplearn_agents.terminal.inert import printable
from mplearn_agents.terminal.interrupts import asked_to_stop

if TYPE_CHECKING:
    from mplearn.learner import Event, LearnerConfig, MotionLearner
    from mplearn.sources import Block, Source
    from mplearn.store import LifelongLearner

SOURCES = (  # `source_kinds` would tell, but takes a second to import
    "recording:FILE, demonstrator[:SEED], udp:[HOST:]PORT, ndjson:[HOST:]PORT, ndjson:-, lsl:NAME, "
    "qtm:HOST, natnet:HOST, vmc:[HOST:]PORT, xsens:[HOST:]PORT"
)
_WAIT_S = 0.2  # a wish to stop is heard so soon


def add_live_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare what learning from a live source takes."""
    group = parser.add_argument_group("live motion, instead of recordings")
    group.add_argument("--live", metavar="SOURCE", help=f"what to learn from: {SOURCES}")
    group.add_argument(
        "--speed",
        type=pace,
        help="times as fast as in time, for a recording and the demonstrator; inf: as fast as "
        "it is learned",
    )
    group.add_argument(
        "--record",
        type=Path,
        metavar="XDF",
        help="also write what comes to this file",
    )
    group.add_argument("--seconds", type=positive, help="stop after so much of the stream [s]")
    group.add_argument(
        "--json",
        action="store_true",
        help="print each event as a line of JSON, and the summary as the last one",
    )


@dataclass
class LiveLog:
    """What came of a stream: numbers only, for it may be endless.

    Attributes:
        life: Who learned; None where no frame could be learned.
        watched_s: Length of what was learned from [s].
        segments: Motions, pauses left out.
        lost_s: Length of what nothing could be learned from, though it came or was filled in [s].
        delay_s: From a frame's arrival to the event that it caused: the longest [s].
    """

    life: LifelongLearner | None = None
    watched_s: float = 0.0
    segments: int = 0
    lost_s: float = 0.0
    delay_s: float = 0.0

    @property
    def learner(self) -> MotionLearner | None:
        """What it learned with; None where no frame could be learned."""
        return None if self.life is None else self.life.learner


def learn_from_source(
    args: argparse.Namespace, configure: Callable[[LearnerConfig], LearnerConfig]
) -> int:
    """Learn from a live source until it ends or somebody stops it; save the library.

    Returns 3 where not all that was learned is kept, 130 where it was stopped before anything came,
    as `mplearn_agents.cli` says, 0 otherwise.

    Args:
        args: The options of ``mplearn learn``.
        configure: What they make of a learner's configuration.
    """
    from mplearn.anatomy import read_map
    from mplearn.learner import learnable_rate
    from mplearn.mocap import command_line
    from mplearn.sources import open_source
    from mplearn.store import LifelongLearner, is_begun
    from mplearn_agents.terminal.console import open_console

    console = open_console(stderr=args.json)
    has_begun = args.store is not None and is_begun(args.store)
    wanted = " and ".join(str(path) for path in (args.out, args.store) if path is not None)
    with command_line(), asked_to_stop() as stop, ExitStack() as stack:
        life = stack.enter_context(LifelongLearner.open(args.store)) if has_begun else None
        source = open_source(
            args.live,
            observe=args.observe,
            hints=hints_of(args),
            names=None if args.map is None else read_map(args.map),
            at_hz=args.rate_hz or (learnable_rate if life is None else _rate_of(life)),
            record=args.record,
            **({} if args.speed is None else {"speed": args.speed}),
        )
        with source, _waiting(source, args) as read:
            console.print(
                f"learning from {printable(source.name)}; Ctrl-C ends it, and writes "
                f"{printable(wanted)}",
                markup=False,
                highlight=False,
            )
            log = LiveLog()
            try:
                with short_pauses():
                    learn_live(
                        read,
                        stop,
                        _say(),
                        config=configure,
                        as_json=args.json,
                        seconds=args.seconds,
                        life=life,
                        store=args.store,
                        log=log,
                    )
            except Exception as error:  # of a source of somebody else, or where lines are told
                if log.life is not None:
                    kept = keep(log.life, log.life.snapshot(), out=args.out, store=args.store)
                    if kept.paths:
                        told = f"what was learned before is written to {printable(str(kept))}"
                        console.print(told, markup=False)
                    if kept.problem:
                        say_unkept(str(error))
                        say_unkept(kept.problem)
                        return NOT_KEPT
                raise
            finally:
                if log.life is not None:
                    stack.push(log.life)
        return _report(console, args, source, log, stopped=stop.is_set())


def learn_live(
    source: Source,
    stop: Flag,
    say: Callable[[str], object],
    *,
    config: Callable[[LearnerConfig], LearnerConfig] = lambda config: config,
    as_json: bool = False,
    seconds: float | None = None,
    life: LifelongLearner | None = None,
    store: Path | None = None,
    log: LiveLog | None = None,
) -> LiveLog:
    """Learn from a source until it ends, or until it is asked to stop.

    Args:
        source: What to learn from; it is left open.
        stop: Set to stop.
        say: Takes a line on each event, as it comes.
        config: Changes the learner's configuration.
        as_json: Whether lines are JSON.
        seconds: How much of the stream to learn [s]; all of it where None.
        life: Who has learned before, and goes on.
        store: Where one who is new keeps what it learns; None for nowhere.
        log: What is filled in and returned; a new one where None.
    """
    from mplearn.learner import FramesLost, LearnerConfig, MotionLearner, SegmentClosed
    from mplearn.sources import Change
    from mplearn.store import LifelongLearner
    from mplearn_agents.terminal.event_lines import change_json, change_text, event_json, event_text

    log = LiveLog() if log is None else log
    log.life = life

    def tell(events: list[Event], arrived_s: float, rate_hz: float) -> None:
        for event in events:
            if isinstance(event, SegmentClosed) and not event.segment.still:
                log.segments += 1
            elif isinstance(event, FramesLost):
                log.lost_s += (event.end - event.start) / rate_hz
            line = event_json(event, rate_hz) if as_json else event_text(event, rate_hz)
            if line is not None:
                say(line)
        if events:
            log.delay_s = max(log.delay_s, time.monotonic() - arrived_s)

    def new_life(config: LearnerConfig) -> LifelongLearner:
        if store is None:
            return LifelongLearner(MotionLearner(config))
        store.parent.mkdir(parents=True, exist_ok=True)
        return LifelongLearner.open(store, lambda: MotionLearner(config))

    def take(block: Block) -> None:
        if log.life is None:
            log.life = new_life(config(LearnerConfig(block.channels, block.rate_hz)))
        elif not log.watched_s:
            tell(log.life.begin_stream(block.channels), _newest(block), block.rate_hz)
        elif not block.joins:
            tell(log.life.end_stream(), _newest(block), block.rate_hz)
        tell(log.life.learn_many(block.frames), _newest(block), block.rate_hz)
        log.watched_s += len(block) / block.rate_hz

    while not (source.ended or stop.is_set() or (seconds and log.watched_s >= seconds)):
        for item in source.read(_WAIT_S):
            if isinstance(item, Change):
                say(change_json(item) if as_json else change_text(item))
            else:
                take(item)
    if log.life is not None and log.watched_s:
        tell(log.life.end_stream(), time.monotonic(), log.life.learner.config.rate_hz)
    return log


def _waiting(source: Source, args: argparse.Namespace) -> Source:
    """Return the source to read; what comes as fast as it is learned waits by itself."""
    from mplearn_agents.learning.waiting import waiting_for_learner

    if args.speed == math.inf:
        return source
    return waiting_for_learner(source, speed=args.speed, beside=args.store or args.out)


def _rate_of(life: LifelongLearner) -> float:
    return life.learner.config.rate_hz


def _newest(block: Block) -> float:
    """Return when the last frame of a block came that came at all."""
    came = block.arrived_s[~block.gaps]
    return float(came[-1]) if len(came) else time.monotonic()


def _say() -> Callable[[str], object]:
    def say(line: str) -> None:
        print(line, flush=True)

    return say


def _report(
    console: Any, args: argparse.Namespace, source: Source, log: LiveLog, *, stopped: bool
) -> int:
    """Write the library, close the store, and say what came of it all; return the exit code."""
    from mplearn_agents.learning.watched import why_nothing
    from mplearn_agents.terminal.tables import primitive_table

    faults = source.tally.faults()
    if log.life is None or log.learner is None or not (log.watched_s or stopped):
        told = ", ".join(f"{n} {name}" for name, n in faults.items()) or "nothing came"
        told = f"nothing could be learned from {source.name}: {told}"
        if not stopped:
            raise RecordingError(told)
        print(f"mplearn: interrupted; {told}", file=sys.stderr)
        return INTERRUPTED
    unread = faults.pop("unread", 0)
    library = log.life.snapshot()
    kept = keep(log.life, library, out=args.out, store=args.store)
    if kept.problem:
        say_unkept(kept.problem)
    if args.json:
        summary = {
            "event": "Summary",
            "primitives": len(library),
            "segments": log.segments,
            "watched_s": log.watched_s,
            "lost_s": log.lost_s,
            "longest_delay_s": log.delay_s,
            "stopped": stopped,
            "library": str(args.out) if args.out in kept.paths else None,
            "store": None if args.store is None else str(args.store),
            "unkept": kept.problem or None,
            **vars(source.tally),
        }
        print(json.dumps(summary), flush=True)
        return NOT_KEPT if kept.problem else 0
    console.print(primitive_table(library))
    console.print(
        f"{len(library)} primitives from {log.watched_s / 60:.1f} minutes of motion in "
        f"{log.segments} segments"
        + ("; stopped" if stopped else "")
        + (f"{',' if stopped else ';'} written to {printable(str(kept))}" if kept.paths else ""),
        markup=False,
    )
    if not len(library):
        console.print(why_nothing(log.learner, log.segments, log.watched_s))
    if faults:
        told = ", ".join(f"{n} {name}" for name, n in faults.items())
        console.print(f"frames and packets that were not as they should be: {told}", markup=False)
    if unread:
        console.print(f"{unread} frames that had come were not learned when it ended")
    if log.lost_s:
        console.print(f"nothing was learned from {log.lost_s:.1f} s", markup=False)
    return NOT_KEPT if kept.problem else 0
