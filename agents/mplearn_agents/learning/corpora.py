"""Whole corpora on the command line: learned by many processes, while one looks on."""

from __future__ import annotations

import argparse
import json
from collections import Counter
from collections.abc import Callable, Iterable
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from mplearn.errors import InvalidValueError, StoreError, StoreWriteError
from mplearn_agents.learning.keeping import keep, say_unkept
from mplearn_agents.recordings.reading import hints_of
from mplearn_agents.terminal.exit_codes import INTERRUPTED, NOT_KEPT
from mplearn_agents.terminal.inert import printable
from mplearn_agents.terminal.interrupts import asked_to_stop

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rich.console import Console
    from rich.table import Table

    from mplearn.corpus import Corpus, Executor, Progress, Reading
    from mplearn.learner import LearnerConfig

_NAMED = 3  # takes refused that the live table names
_LISTED = 100  # that are named at the end; all are in the shards' journals


@contextmanager
def chosen_executor(args: argparse.Namespace) -> Iterator[Executor]:
    """Return who does the work, as the options want it; let the workers go at the end."""
    from mplearn.corpus import Processes, RayTasks

    if args.jobs is not None and args.ray is not None:
        raise InvalidValueError("give --jobs or --ray, not both")
    executor = Processes(args.jobs) if args.ray is None else RayTasks(args.ray)
    try:
        yield executor
    finally:
        executor.close()


def reading_of(args: argparse.Namespace) -> Reading:
    """Return how takes are read, as the options want it."""
    from mplearn.anatomy import read_map
    from mplearn.corpus import Reading

    names = None if args.map is None else read_map(args.map)
    return Reading(getattr(args, "observe", "robot"), hints_of(args), names)


def learn_in_shards(
    args: argparse.Namespace, configure: Callable[[LearnerConfig], LearnerConfig]
) -> int:
    """Learn a folder as a corpus, save the library and print a summary; return the exit code."""
    from mplearn.corpus import learn_corpus
    from mplearn.mocap import command_line
    from mplearn.store import LifelongLearner, is_begun
    from mplearn_agents.terminal.console import open_console
    from mplearn_agents.terminal.tables import primitive_table

    if args.out is None and args.shards is None:
        raise InvalidValueError("give a library to write, --out, or a folder of stores, --shards")
    if args.store is not None and is_begun(args.store):
        raise InvalidValueError(
            f"--store {args.store} is begun already: a corpus is merged into a new one"
        )
    if args.strict:
        raise InvalidValueError("--strict is for takes learned one after the other, not --jobs")
    into = args.shards or args.out.with_name(args.out.name + ".shards")
    console = open_console()
    try:
        with (
            command_line(),
            asked_to_stop() as stop,
            chosen_executor(args) as executor,
            _live_table(console) as show,
        ):
            corpus = learn_corpus(
                args.data,
                into,
                reading=reading_of(args),
                rate_hz=args.rate_hz,
                configure=configure,
                executor=executor,
                people=args.person or (),
                show=show,
                stop=stop,
            )
    except StoreWriteError as error:
        say_unkept(
            f"{error}; what was learned until then is in {into}, and the same command goes on from "
            "there once there is room"
        )
        return NOT_KEPT
    _say_refused(console, corpus.refused.items())
    if corpus.learner is None:
        console.print(
            f"Stopped: what was learned until then is in {printable(str(into))}. The same command "
            "goes on from there.",
            markup=False,
        )
        return INTERRUPTED
    life = LifelongLearner(corpus.learner, done=corpus.keys)
    library = life.snapshot(shown_once=args.demonstrations == 1)
    if not len(library):
        library = life.snapshot(shown_once=True)
    kept = keep(life, library, out=args.out, store=None)
    written, problems = [*kept.paths, into], [kept.problem] if kept.problem else []
    if args.store is not None:
        try:
            args.store.parent.mkdir(parents=True, exist_ok=True)
            LifelongLearner.open(args.store, lambda: life).close()
            written.append(args.store)
        except StoreError as error:
            problems.append(str(error))
    console.print(primitive_table(library))
    console.print(_summary(corpus, written), markup=False)
    for problem in problems:
        say_unkept(f"{problem}; all is in {into}, from which the same command makes it again")
    return NOT_KEPT if problems else 0


@contextmanager
def _live_table(console: Console) -> Iterator[Callable[[Progress], None]]:
    """Show how far a corpus is while this lasts; yields what takes that."""
    from rich.live import Live

    try:
        with Live(console=console, refresh_per_second=4) as live:
            yield lambda progress: live.update(progress_table(progress))
    finally:
        if not console.is_terminal:  # in a file the table has no last line break
            console.line()


def recognise_in_chunks(args: argparse.Namespace) -> None:
    """Recognise a folder as a corpus, write the table and print how often what was recognised."""
    from mplearn.corpus import recognise_corpus
    from mplearn.mocap import command_line
    from mplearn.tables import write_segments
    from mplearn_agents.terminal.console import new_table, open_console
    from mplearn_agents.terminal.progress import open_progress

    if args.to is None and not args.json:
        raise InvalidValueError("give a table to write, --to FILE, or --json")
    if args.strict:
        raise InvalidValueError("--strict is for takes recognised one after the other")
    console, aside = open_console(), open_console(stderr=True)
    with (
        command_line(),
        chosen_executor(args) as executor,
        open_progress(aside) as bar,
    ):
        task = bar.add_task("recognising", total=None)
        found = recognise_corpus(
            args.library,
            args.data,
            reading=reading_of(args),
            executor=executor,
            show=lambda done, of: bar.update(task, completed=done, total=of),
        )
    _say_refused(aside, found.refused.items())
    if args.to is not None:
        write_segments(found.table, args.to)
    if args.json:
        for segment in found.table:
            print(json.dumps(segment.as_dict()))
        return
    names = Counter(segment.name for segment in found.table)
    table = new_table("segments", "primitive", "times", right=("times",))
    for name, times in names.most_common():
        table.add_row(printable(name) if name else "unknown", str(times))
    console.print(table)
    known = len(found.table) - names[""]
    takes = "1 take" if found.n_takes == 1 else f"{found.n_takes} takes"
    console.print(
        f"{known} of {len(found.table)} segments recognised in {takes}; written to "
        f"{printable(str(args.to))}",
        markup=False,
    )


def _summary(corpus: Corpus, written: Iterable[Path]) -> str:
    progress, learner = corpus.progress, corpus.learner
    assert learner is not None
    people = len({shard.person for shard in corpus.shards if shard.person})
    memory = max(report.memory_bytes for report in corpus.reports)
    who = _counted(people, "person", "people") if people else "unnamed people"
    return (
        f"{_counted(len(learner.tree.leaves), 'primitive', 'primitives')} from "
        f"{_counted(progress.learned, 'take', 'takes')} of {who} in "
        f"{_counted(progress.shards, 'shard', 'shards')}, {progress.watched_s / 60:.1f} "
        f"minutes of motion; merging took {corpus.merging_s:.1f} s, a worker had "
        f"{memory / 2**20:.0f} MB at most; written to "
        f"{printable(' and '.join(str(path) for path in written))}"
    )


def _counted(n: int, one: str, several: str) -> str:
    return f"{n} {one if n == 1 else several}"


def _say_refused(console: Console, refused: Iterable[tuple[str, str]]) -> None:
    named = list(refused)
    for name, why in named[:_LISTED]:
        text = printable(f"left out: {name}: {why}")
        console.print(text, markup=False, highlight=False, style="yellow")
    if len(named) > _LISTED:
        console.print(f"left out: {len(named) - _LISTED} more, named in the shards' journals")


def progress_table(progress: Progress) -> Table:
    """Return how far the learning of a corpus is."""
    from mplearn_agents.terminal.console import new_table
    from mplearn_agents.terminal.progress import duration

    table = new_table("learning a corpus", "what", "how far")
    left = "" if progress.left_s is None else f", {duration(progress.left_s)} left"
    done = progress.learned + len(progress.refused)
    table.add_row("takes", f"{done} of {progress.takes}, {progress.rate:.2f} a second{left}")
    table.add_row("motion", f"{duration(progress.watched_s)} learned")
    table.add_row("shards", f"{progress.done} of {progress.shards}, {progress.merged} merged")
    known = f"{progress.primitives}, each shard's by themselves"
    table.add_row("primitives known", known)
    last = ", ".join(list(progress.refused)[-_NAMED:])
    table.add_row("left out", printable(f"{len(progress.refused)}{': ... ' if last else ''}{last}"))
    if progress.deaths:
        table.add_row("workers died", f"{progress.deaths}; what they did is taken up again")
    return table
