"""``mplearn recognise``: what of a library is in recordings."""

from __future__ import annotations

import argparse
import json
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from mplearn.errors import InvalidValueError, RecordingError
from mplearn_agents.recordings.reading import (
    add_corpus_arguments,
    add_reading_arguments,
    hints_of,
    say_bodies,
    say_left_out,
    say_takes,
    shown_reading,
)

if TYPE_CHECKING:
    from rich.console import Console

    from mplearn.library import PrimitiveLibrary
    from mplearn.recording import Recording

HELP = "Recognise a library's primitives in recordings: segments, primitives, distances, p-values."
EXAMPLE = "mplearn recognise my.mplearn session.c3d --to segments.csv"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare what the command takes."""
    parser.add_argument("library", type=Path, help="library file")
    parser.add_argument("data", type=Path, help="a recording, or a folder of them")
    parser.add_argument("--json", action="store_true", help="print a line of JSON for each segment")
    parser.add_argument(
        "--to",
        type=Path,
        metavar="FILE",
        help="write them as a table, too: FILE.csv, .parquet, .arrow, .boris (BORIS), .eaf (ELAN), "
        "or FILE_events.tsv (Motion-BIDS)",
    )
    add_corpus_arguments(parser, "recognise")
    add_reading_arguments(parser)


def run(args: argparse.Namespace) -> None:
    """Read, recognise, print and write."""
    from rich.text import Text

    from mplearn.library import PrimitiveLibrary
    from mplearn.tables import SegmentTable, format_of, recognise_recording, write_segments
    from mplearn_agents.terminal.console import new_table, open_console
    from mplearn_agents.terminal.inert import printable
    from mplearn_agents.terminal.progress import open_progress

    if args.to is not None:
        format_of(args.to)
    if args.jobs is not None or args.ray is not None:
        from mplearn_agents.learning.corpora import recognise_in_chunks

        recognise_in_chunks(args)
        return
    library = PrimitiveLibrary.load(args.library)
    if library.recogniser is None:
        raise InvalidValueError(
            f"{args.library} holds no recogniser: it can only be performed; `mplearn learn` writes "
            "libraries that recognise"
        )
    aside = open_console(stderr=True)
    recordings = _read(args, library, aside)
    found = []
    total = sum(len(recording.frames) for recording in recordings)
    with open_progress(aside) as bar:
        task = bar.add_task("recognising", total=total)
        for recording in recordings:
            for segment in recognise_recording(
                library, recording, lambda n: bar.update(task, advance=n)
            ):
                found.append(segment)
                if args.json:
                    print(json.dumps(segment.as_dict()), flush=True)
    if args.to is not None:
        write_segments(SegmentTable(found), args.to)
    if args.json:
        return
    right = ("from [s]", "to [s]", "distance", "p")
    table = new_table(
        "segments", "take", *right[:2], "primitive", "nearest", *right[2:], right=right
    )
    for each in found:
        table.add_row(
            Text(printable(each.take)),  # before it is laid out: it may get longer
            f"{each.start_s:.2f}",
            f"{each.end_s:.2f}",
            Text(printable(each.name)) if each.name else Text("unknown", "dim"),
            Text(printable(each.nearest)),
            f"{each.distance:.3g}",
            f"{each.p_value:.3g}",
        )
    console = open_console()
    console.print(table)
    known = sum(each.primitive is not None for each in found)
    takes = "1 take" if len(recordings) == 1 else f"{len(recordings)} takes"
    written = "" if args.to is None else f"; written to {printable(str(args.to))}"
    console.print(f"{known} of {len(found)} segments recognised in {takes}{written}", markup=False)


def _read(
    args: argparse.Namespace, library: PrimitiveLibrary, aside: Console
) -> tuple[Recording, ...]:
    """Return the takes as the library sees them: bodies, or its own channels, at its rate."""
    from mplearn.anatomy import as_bodies, read_map
    from mplearn.mocap import command_line, open_takes, resample
    from mplearn.recording import are_markers

    positions = bool(library.body) or are_markers(library.channels)
    with command_line():
        hints = hints_of(args, joint_axes=bool(library.body))
        with shown_reading(aside) as through:
            takes = open_takes(
                args.data, positions=positions, hints=hints, strict=args.strict, through=through
            )
    say_takes(aside, takes)
    recordings = takes.recordings
    if library.body:
        names = None if args.map is None else read_map(args.map)
        bodies = as_bodies(recordings, names=names, strict=args.strict)
        say_bodies(aside, bodies)
        for name, error in bodies.refused.items():
            say_left_out(aside, name, error)
        recordings = bodies.recordings
    else:
        fitting = tuple(r for r in recordings if set(library.channels) <= set(r.channels))
        for recording in recordings:
            lacks = sorted(set(library.channels) - set(recording.channels))
            if lacks:
                error = RecordingError(f"it lacks the library's channels {', '.join(lacks[:8])}")
                say_left_out(aside, recording.name, error)
        recordings = tuple(_only(recording, library.channels) for recording in fitting)
    if not recordings:
        raise RecordingError(f"nothing in {args.data} can be seen by the library {args.library}")
    return tuple(
        r if r.rate_hz == library.rate_hz else resample(r, library.rate_hz) for r in recordings
    )


def _only(recording: Recording, channels: tuple[str, ...]) -> Recording:
    columns = [recording.channels.index(channel) for channel in channels]
    return replace(recording, frames=recording.frames[:, columns], channels=channels)
