"""``mplearn learn``: recordings in, a library out."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

from mplearn.errors import RecordingError

HELP = "Learn primitives and their order from recordings."


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare what the command takes."""
    parser.add_argument("data", type=Path, help="a recording, or a folder of them")
    parser.add_argument("--out", type=Path, required=True, help="library file to write")
    parser.add_argument("--rate-hz", type=float, help="resample to this rate [1/s]")
    parser.add_argument(
        "--observe",
        choices=["robot", "positions", "channels"],
        default="robot",
        help="what is learned: the robot's features of the person in the recording (default), "
        "positions of markers and joints, or the file's own channels (a skeleton's joint angles)",
    )
    parser.add_argument("--segmenter", help="how the stream is cut (default: the learner's own)")
    parser.add_argument(
        "--person", action="append", help="learn from this person's takes only; may be repeated"
    )


def run(args: argparse.Namespace) -> None:
    """Learn, save the library and print a summary."""
    from rich.console import Console

    from mplearn.anatomy import as_bodies
    from mplearn.learner import LearnerConfig, MotionLearner
    from mplearn.mocap import Hints, open_recordings
    from mplearn_agents.learning import learn
    from mplearn_agents.tables import primitive_table

    console = Console()
    recordings = open_recordings(
        args.data,
        rate_hz=args.rate_hz,
        positions=args.observe != "channels",
        hints=Hints(joint_axes=args.observe == "robot"),
    )
    if args.person:
        persons = sorted({recording.person for recording in recordings})
        recordings = tuple(r for r in recordings if r.person in args.person)
        if not recordings:
            raise RecordingError(
                f"no take of {' or '.join(args.person)} in {args.data}; there are takes of "
                f"{', '.join(person or 'a person unnamed' for person in persons)}"
            )
    if args.observe == "robot" and any(recording.is_markers for recording in recordings):
        bodies = as_bodies(recordings)
        for name, error in bodies.refused.items():
            console.print(f"[yellow]left out: {name}: {error}")
        recordings = bodies.recordings
    first = recordings[0]
    config = LearnerConfig(
        channels=first.channels,
        rate_hz=first.rate_hz,
        observe="robot" if args.observe == "robot" else "markers",
    )
    if args.segmenter:
        config = replace(config, segmenter=args.segmenter)
    learner = MotionLearner(config)
    log = learn(learner, recordings, console)
    if log.n_lost == learner.n_frames:
        raise RecordingError(f"nothing can be learned from {args.data}: {log.reasons}")
    library = learner.snapshot()
    args.out.parent.mkdir(parents=True, exist_ok=True)
    library.save(args.out)
    console.print(primitive_table(library))
    console.print(
        f"{len(library)} primitives from {len(recordings)} takes, {log.watched_s / 60:.1f} minutes "
        f"of motion in {len(log.moving)} segments, {log.times_real_time:.0f} x real time; "
        f"written to {args.out}"
    )
    if log.lost:
        console.print(
            f"{log.n_lost / first.rate_hz:.1f} s in {len(log.lost)} stretches were left out: "
            f"{log.reasons}"
        )
