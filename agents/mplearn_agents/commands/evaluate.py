"""``mplearn evaluate``: the paper's experiments, as tables."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator

    from mplearn.evaluation import Table

HELP = "Measure segmentation, learning and performing, on synthetic sessions or on recordings."
_SYNTHETIC = "paper-session"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare what the command takes."""
    parser.add_argument(
        "data",
        help=f"{_SYNTHETIC!r}, or a recording or folder whose labels are repetitions of movements",
    )
    parser.add_argument("--out", type=Path, help="folder to write the tables to, as Markdown")
    parser.add_argument(
        "--orders", type=int, default=5, help="orders of presentation a person (default: 5)"
    )
    parser.add_argument(
        "--seeds",
        type=int,
        nargs="+",
        default=[101, 102, 103],
        help=f"seeds of {_SYNTHETIC} and of the walks (default: 101 102 103)",
    )


def run(args: argparse.Namespace) -> None:
    """Run the experiments; print each table as it is done."""
    from rich.console import Console
    from rich.table import Table as Shown

    console = Console()
    written = []
    for table in _tables(args):
        shown = Shown(*table.columns, title=table.title, caption=table.note, caption_justify="left")
        for row in table.rows:
            shown.add_row(*row)
        console.print(shown)
        written.append(table.to_markdown())
    if args.out is not None:
        args.out.mkdir(parents=True, exist_ok=True)
        file = args.out / f"{Path(args.data).name}.md"
        file.write_text("\n".join(written), encoding="utf-8")
        console.print(f"written to {file}")


def _tables(args: argparse.Namespace) -> Iterator[Table]:
    from mplearn.evaluation.experiments import (
        boundary_table,
        learn_paper_sessions,
        learn_people,
        learning_table,
    )
    from mplearn_agents.walk_table import walk_table

    if args.data == _SYNTHETIC:
        outcomes = list(learn_paper_sessions(args.seeds))
        yield learning_table("Sessions like the paper's, of the synthetic demonstrator", outcomes)
        yield walk_table([(name, each.learner.snapshot()) for name, each in outcomes], args.seeds)
        return
    from mplearn.learner import LearnerConfig, MotionLearner
    from mplearn.mocap import open_recordings

    takes = open_recordings(args.data)
    yield boundary_table(takes)
    outcomes = list(learn_people(takes, args.orders))
    yield learning_table("Sessions made of each person's takes", outcomes)
    learner = MotionLearner(LearnerConfig(takes[0].channels, takes[0].rate_hz))
    for take in takes:
        for _ in learner.learn_recording(take):
            pass
    walked = [("all takes", learner.snapshot())]
    walked += [(name, each.learner.snapshot()) for name, each in outcomes[:: args.orders]]
    yield walk_table(walked, args.seeds)
