"""``mplearn evaluate``: the paper's experiments, and those beyond, as tables."""

from __future__ import annotations

import argparse
from pathlib import Path

from mplearn.errors import InvalidValueError, MPLearnError
from mplearn_agents.recordings.reading import say_left_out
from mplearn_agents.terminal.arguments import count, seed

HELP = "Measure segmentation, learning and performing, on synthetic sessions or on recordings."
EXAMPLE = "mplearn evaluate paper-session --only learning prediction"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare what the command takes."""
    from ..evaluations import BUILT_IN

    parser.add_argument(
        "data",
        help=f"{' or '.join(repr(name) for name in BUILT_IN)}; a recording or folder whose labels "
        "are repetitions of movements, primitives, or activities, or whose names tell contents",
    )
    parser.add_argument("--out", type=Path, help="folder to write the tables to, as Markdown")
    parser.add_argument("--only", nargs="+", metavar="NAME", help="run these experiments only")
    parser.add_argument("--json", action="store_true", help="print each table as a line of JSON")
    parser.add_argument("--list", action="store_true", help="name the experiments, run none")
    parser.add_argument(
        "--orders", type=count, default=5, help="orders of presentation a person (default: 5)"
    )
    parser.add_argument(
        "--seeds",
        type=seed,
        nargs="+",
        default=[101, 102, 103],
        help="seeds of synthetic sessions and of walks (default: 101 102 103)",
    )
    parser.add_argument(
        "--wrong",
        type=Path,
        help="takes of the movements performed wrongly on purpose (default: DATA_incorrect)",
    )


def run(args: argparse.Namespace) -> None:
    """Run the experiments; print each table as it is done."""
    from mplearn_agents.terminal.console import open_console
    from mplearn_agents.terminal.progress import open_progress
    from mplearn_agents.terminal.tables import show_table

    from ..evaluations import BUILT_IN, Setting, evaluations_for

    console = open_console(stderr=args.json)
    setting = Setting(args.data, tuple(args.seeds), args.orders, _wrong(args))
    found = evaluations_for(setting)
    if args.list:
        for name, evaluation in found.items():
            console.print(f"{name}: {evaluation.__doc__}")
        return
    names = list(found) if args.only is None else args.only
    unknown = [name for name in names if name not in found]
    if unknown:
        raise InvalidValueError(f"experiments on {args.data} are {list(found)}, not {unknown}")
    if args.data not in BUILT_IN and setting.left_out:
        console.print(f"left out: {', '.join(setting.left_out)}")
    said: set[str] = set()
    written: list[str] = []
    failed: list[str] = []
    with open_progress(console, "{task.completed:.0f} of {task.total:.0f} experiments") as bar:
        task = bar.add_task("", total=len(names))
        for name in names:
            bar.update(task, description=name)
            n_before = len(written)
            try:
                for table in found[name](setting):
                    for take, refused in setting.refused.items():
                        if take not in said:
                            said.add(take)
                            say_left_out(console, take, refused)
                    show_table(console, table, json=args.json)
                    written.append(table.to_markdown())
                    if args.out is not None:  # after each: a run that is stopped leaves what it has
                        args.out.mkdir(parents=True, exist_ok=True)
                        file = args.out / f"{Path(args.data).name}.md"
                        file.write_text("\n".join(written), encoding="utf-8")
            except MPLearnError as error:  # the others can be measured nevertheless
                failed.append(name)
                console.print(f"{name}: {error}")
            else:
                if len(written) == n_before:
                    console.print(f"{name}: nothing to measure in {args.data}")
            bar.advance(task)
    if args.out is not None and written:
        console.print(f"written to {args.out / Path(args.data).name}.md")
    if failed:
        raise InvalidValueError(f"could not be measured on {args.data}: {', '.join(failed)}")


def _wrong(args: argparse.Namespace) -> Path | None:
    beside = Path(f"{args.data.rstrip('/')}_incorrect")
    return args.wrong or (beside if beside.is_dir() else None)
