"""Live motion: how late events are, what a bad network costs, and an hour of it.

``python -m benchmarks.live --minutes 60`` measures how late events are for an hour at its own pace,
and the memory meanwhile; ``python -m benchmarks live`` for two minutes, and an hour as fast as it
is learned.
"""

import argparse
import resource
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

import numpy as np

from mplearn import LearnerConfig, MotionLearner
from mplearn.demonstrator import paper_session
from mplearn.evaluation import rate_learning
from mplearn.learner import SegmentClosed
from mplearn.recording import Recording, Segment
from mplearn.sources import Block, Change, Source, Stream, Wanted, open_source
from mplearn.sources.played import PlayedSource
from mplearn.sources.recognised import RecognisedSource
from mplearn.sources.sending import open_sender, send
from mplearn_agents.learning.pauses import short_pauses

from .bad_network import BadNetwork

BAD_S = 480.0
LIVE_S = 120.0
HOUR_S = 3600.0


def rows() -> list[tuple[str, str, str, str]]:
    session = paper_session(7).recording
    return [*_bad_network(session), *_delays(session, LIVE_S), *_hour(session)]


def _bad_network(session: Recording) -> list[tuple[str, str, str, str]]:
    """Hold what is learned through a bad network against what is learned through a good one."""
    session = session.sliced(0, round(BAD_S * session.rate_hz))
    part = len(session) // 8
    bad = BadNetwork(
        session,
        silences=((part, part + 100), (2 * part, 2 * part + 500)),
        jumps={3 * part: 3600.0, 4 * part: -7200.0},
        renamed=5 * part,
        shuffled=6 * part,
        second=7 * part,
        stranger=3 * part,
    )
    good = BadNetwork(session, loss=0.0, doubles=0.0, disorder=0)
    table = []
    for name, network in (("a good network", good), ("a bad one", bad)):
        source = RecognisedSource(network.received(), Wanted())
        segments, placements = _learned(source)
        rates = rate_learning(session.labels, segments, placements, session.rate_hz)
        table.append(
            (
                f"false positives, {name}",
                f"{100 * rates.false_positive:.1f} %",
                f"of {rates.n_found} segments, at most",
                "2 %",
            )
        )
        told = ", ".join(f"{n} {fault}" for fault, n in source.tally.faults().items())
        table.append(
            (
                f"recognised, {name}",
                f"{100 * rates.recognised:.1f} %",
                told or "nothing lost",
                f"{len(rates.extracted)} of {rates.n_classes}",
            )
        )
    return table


def _learned(source: Source) -> tuple[list[Segment], list[object]]:
    """Return the segments that are found in a source, in the places of its frames, and theirs."""
    learner: MotionLearner | None = None
    at = [(0, 0)]  # where stretches begin: frames of the learner, and of the source
    closed: list[SegmentClosed] = []
    for item in source:
        if isinstance(item, Change):
            continue
        if learner is None:
            learner = MotionLearner(LearnerConfig(item.channels, item.rate_hz))
        elif not item.joins:
            closed += [e for e in learner.end_stream() if isinstance(e, SegmentClosed)]
        if not item.joins:
            at.append((learner.n_frames, round(item.times_s[0] * item.rate_hz)))
        closed += [e for e in learner.learn_many(item.frames) if isinstance(e, SegmentClosed)]
    assert learner is not None
    closed += [e for e in learner.end_stream() if isinstance(e, SegmentClosed)]
    segments = []
    for event in closed:
        ours, theirs = max(pair for pair in at if pair[0] <= event.segment.start)
        shift = theirs - ours
        segments.append(
            Segment(
                event.segment.start + shift, event.segment.end + shift, still=event.segment.still
            )
        )
    return segments, [event.placement for event in closed]


def _delays(session: Recording, seconds: float) -> list[tuple[str, str, str, str]]:
    """Return how long after a packet came what it causes is there, with 16 minutes learned."""
    learner = MotionLearner(LearnerConfig(session.channels, session.rate_hz))
    learner.learn_many(session.frames)
    learner.end_stream()
    frames, events, work, sizes = [], [], [], []
    n = round(seconds * 100)
    with (
        short_pauses(),
        tempfile.TemporaryDirectory() as folder,
        open_source("udp:0") as source,
        subprocess.Popen(_sender(session, Path(folder), source.name)) as sender,
    ):
        until = time.monotonic() + seconds + 60.0
        while learner.n_frames < len(session) + n and time.monotonic() < until:
            if learner.n_frames - len(session) >= n // 4 * (len(sizes) + 1):
                sizes.append(_resident_mb())
            for item in source.read(0.1):
                if isinstance(item, Change):
                    continue
                for row, arrived_s in zip(item.frames, item.arrived_s, strict=True):
                    begin_s = time.thread_time()
                    said = learner.learn_many(row[None])
                    work_s = time.thread_time() - begin_s
                    delay_s = time.monotonic() - arrived_s
                    if item.times_s[0] > 2.0:  # a body is looked for at first
                        frames.append(delay_s)
                        events += [delay_s] if said else []
                        work += [work_s] if said else []
        sender.terminate()
    at = (50, 99)
    frame, event, busy = (1e3 * np.nanpercentile(each, at) for each in (frames, events, work))
    lost = source.tally.faults()
    return [
        (
            "a packet to what it changes",
            f"p99 {frame[1]:.1f} ms",
            f"median {frame[0]:.2f} ms, {seconds:.0f} s at 100 Hz by UDP",
            ", ".join(f"{n} {fault}" for fault, n in lost.items()) or "nothing lost",
        ),
        (
            "a packet to its event",
            f"p99 {event[1]:.1f} ms",
            f"median {event[0]:.1f} ms, of {len(events)}, at most",
            "5 ms",
        ),
        (
            "of it, processor time to learn the segment",
            f"p99 {busy[1]:.1f} ms",
            f"median {busy[0]:.1f} ms",
            "the rest is waiting",
        ),
        (
            "memory after each quarter of that",
            " ".join(f"{size:.0f}" for size in [*sizes, _resident_mb()]) + " MB",
            f"{len(learner.tree.leaves)} primitives",
            "16 minutes learned before",
        ),
    ]


def _sender(session: Recording, folder: Path, to: str) -> list[str]:
    """Return the command that sends a session again and again from a process of its own."""
    path = folder / "session.npy"
    np.save(path, session.frames)
    names = ",".join(session.marker_names)
    code = (
        "import itertools, sys, numpy as np; from mplearn.recording import marker_channels; "
        "from mplearn.sources import Stream; from mplearn.sources.played import PlayedSource; "
        "from mplearn.sources.sending import open_sender, send; "
        "channels = marker_channels(tuple(sys.argv[2].split(','))); "
        "stream = Stream(channels, 100.0, unit_m=1.0, up='z'); "
        "played = PlayedSource(stream, itertools.repeat(np.load(sys.argv[1]))); "
        "s = open_sender(sys.argv[3]); send(played, s.__enter__())"
    )
    return [sys.executable, "-c", code, str(path), names, to]


def _hour(session: Recording) -> list[tuple[str, str, str, str]]:
    """Return what an hour holds in memory; over TCP, as fast as it is learned."""
    n = round(HOUR_S * session.rate_hz)
    stream = Stream(session.channels, session.rate_hz, unit_m=1.0, up="z")
    pieces = (session.frames for _ in range(1 + n // len(session)))
    learner: MotionLearner | None = None
    sizes, quarter = [], n // 4
    begin = time.monotonic()
    with open_source("ndjson:0") as source, open_sender(source.name) as sender:
        played = PlayedSource(stream, pieces, float("inf"))
        stop = threading.Event()
        thread = threading.Thread(target=send, args=(played, sender, stop))
        thread.start()
        while learner is None or learner.n_frames < n:
            for item in source.read(0.5):
                if isinstance(item, Block):
                    if learner is None:
                        learner = MotionLearner(LearnerConfig(item.channels, item.rate_hz))
                    learner.learn_many(item.frames)
            if learner is not None and learner.n_frames >= quarter * (len(sizes) + 1):
                sizes.append(_resident_mb())
        stop.set()
        while thread.is_alive():
            source.read(0.1)
    took_s = time.monotonic() - begin
    faults = source.tally.faults()
    return [
        (
            "an hour at 100 Hz, by TCP",
            f"{took_s:.0f} s",
            "real time",
            f"{HOUR_S / took_s:.0f} x, "
            + (", ".join(f"{n} {fault}" for fault, n in faults.items()) or "nothing lost"),
        ),
        (
            "memory after 15, 30, 45, 60 min",
            " ".join(f"{size:.0f}" for size in sizes) + " MB",
            "after 15 min",
            f"{sizes[-1] / sizes[0]:.2f} x",
        ),
    ]


def _resident_mb() -> float:
    try:
        pages = int(Path("/proc/self/statm").read_text().split()[1])
    except OSError:
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return pages * resource.getpagesize() / 1e6


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.live", description=__doc__)
    parser.add_argument("--minutes", type=float, default=60.0, help="at their own pace")
    args = parser.parse_args()
    for row in _delays(paper_session(7).recording, 60.0 * args.minutes):
        print("; ".join(row), flush=True)


if __name__ == "__main__":
    main()
