"""``mplearn store``: looks after the file that keeps a life of learning."""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mplearn.errors import StoreDamagedError
from mplearn_agents.terminal.arguments import whole
from mplearn_agents.terminal.exit_codes import NOT_IN_ORDER
from mplearn_agents.terminal.help_that_fits import HelpThatFits
from mplearn_agents.terminal.inert import printable

if TYPE_CHECKING:
    from mplearn.store import Command, Entry, Happening, LifelongLearner

HELP = "Look after a store: what it holds, its log, backups, checks, commands, undo and redo."
EXAMPLE = "mplearn store info life.db"
#: What follows in the example of an action.
_MORE = {
    "log": " --json",
    "history": " 'bow up'",
    "backup": " backups/monday.db",
    "merge": " P3 P7 --by Anna",
    "split": " 12 --by Anna",
    "delete": " P9",
    "freeze": " 'bow up'",
    "unfreeze": " 'bow up'",
    "note": " 'a new demonstrator from here on' --by Anna",
    "redo": " 14",
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare what the command takes."""
    actions = parser.add_subparsers(title="actions", metavar="ACTION", required=True)

    def add(name: str, help: str, do: Callable[[argparse.Namespace], int | None]) -> Any:
        action = actions.add_parser(
            name,
            help=help,
            description=help,
            epilog=f"example:\n  mplearn store {name} life.db{_MORE.get(name, '')}",
            formatter_class=HelpThatFits,
        )
        action.add_argument("store", type=Path, metavar="STORE", help="the store, as life.db")
        action.set_defaults(act=do)
        return action

    for name, help, do in (
        ("info", "what the store holds, and how large it is", _info),
        ("log", "the commands of people: number, when, by whom", _log),
    ):
        action = add(name, help, do)
        action.add_argument("--json", action="store_true", help="print JSON")
    action = add("history", "what happened to a primitive", _history)
    action.add_argument("primitive", help="its id or name")
    action.add_argument("--json", action="store_true", help="print JSON")
    action = add("backup", "write a copy, also while the store is written to", _backup)
    action.add_argument("copy", type=Path, help="the file to write; it must be new")
    action = add("check", "find what is damaged; exit code 1 if anything is", _check)
    action.add_argument(
        "--salvage",
        action="store_true",
        help="where something is, be content with what was learned before it",
    )

    for name, help in (
        ("merge", "say that two primitives are one"),
        ("split", "say that a primitive is two"),
        ("delete", "forget a primitive"),
        ("freeze", "let a primitive stay as it is"),
        ("unfreeze", "let it change again"),
    ):
        action = add(name, help, _command)
        action.add_argument("primitive", help="id or name")
        if name == "merge":
            action.add_argument("other", help="id or name of the other one")
        action.set_defaults(kind=name)
        action.add_argument("--by", default="", help="who asks, for the log")
    action = add("note", "write something down in the log", _command)
    action.add_argument("text", help="the note")
    action.add_argument("--primitive", help="id or name of the primitive that it is about")
    action.set_defaults(kind="note")
    action.add_argument("--by", default="", help="who asks, for the log")
    for name, help in (
        ("undo", "take a command back; what was learned since stays"),
        ("redo", "do a command again that was undone"),
    ):
        action = add(name, help, _toggle)
        action.add_argument(
            "number", type=whole(1), nargs="?", help="its number (default: the last)"
        )
        action.set_defaults(kind=name)
        action.add_argument("--by", default="", help="who asks, for the log")


def run(args: argparse.Namespace) -> int | None:
    """Do what is asked."""
    code: int | None = args.act(args)
    return code


def _info(args: argparse.Namespace) -> None:
    from mplearn.store import StoreReader, info

    found, life = info(args.store), StoreReader(args.store).life
    library = life.snapshot()
    content = {
        "store": str(found.path),
        "version": found.version,
        "bytes": found.file_bytes,
        "free_bytes": found.free_bytes,
        "primitives": len(library),
        "learned_s": life.n_frames / library.rate_hz,
        "commands": len(life.entries()),
        "paused": life.learner.paused,
        "records_since_checkpoint": found.records,
        "checkpoint_at": found.checkpoint_at,
        "library_version": library.version,
    }
    if args.json:
        print(json.dumps(content))
        return
    print(
        f"{printable(str(found.path))}: {len(library)} primitives from {_length(life)} of motion, "
        f"{len(life.entries())} commands; {found.file_bytes / 1e6:.1f} MB "
        f"({found.free_bytes / 1e6:.1f} MB of it free), version {found.version}"
    )
    if found.checkpoint_at is not None:
        print(f"last checkpoint {_date(found.checkpoint_at)}, {found.records} records in the log")
    if life.learner.paused:
        print("learning is paused")


def _log(args: argparse.Namespace) -> None:
    from mplearn.store import StoreReader

    entries = StoreReader(args.store).life.entries()
    if args.json:
        print(json.dumps([_entry(each) for each in entries]))
        return
    for each in entries:
        print(_line(each))
    if not entries:
        print("no commands yet")


def _history(args: argparse.Namespace) -> None:
    from mplearn.store import StoreReader

    life = StoreReader(args.store).life
    id = _id(life, args.primitive, alive=False)
    happenings = life.history(id)
    entries = {each.number: each for each in life.entries()}
    if args.json:
        print(json.dumps([vars(each) for each in happenings]))
        return
    for each in happenings:
        print(f"{_date(each.when)}  {_told(each, entries)}")
    if not happenings:
        print(f"nothing is known of primitive {id}")


def _backup(args: argparse.Namespace) -> None:
    from mplearn.store import backup, info

    path = backup(args.store, args.copy)
    print(f"{printable(str(path))} written, {info(path).file_bytes / 1e6:.1f} MB")


def _check(args: argparse.Namespace) -> int | None:
    from mplearn.store import LifelongLearner, check

    try:
        if args.salvage:
            with LifelongLearner.open(args.store, salvage=True) as life:
                print(f"{len(life.snapshot())} primitives from {_length(life)} of motion are kept")
        wrong = check(args.store)
    except StoreDamagedError as error:  # it cannot be opened at all
        print(_in_one_line(str(error)))
        return NOT_IN_ORDER
    if wrong:
        print(_in_one_line(f"{args.store} is damaged: {'; '.join(wrong)}"))
        return NOT_IN_ORDER
    print(f"{printable(str(args.store))} is sound")
    return None


def _in_one_line(text: str) -> str:
    """Return a text as one line: what SQLite finds is said in several."""
    return printable(" ".join(text.split()))


def _command(args: argparse.Namespace) -> None:
    from mplearn.store import Delete, Freeze, Merge, Note, Split, Unfreeze

    one = {"split": Split, "delete": Delete, "freeze": Freeze, "unfreeze": Unfreeze}
    with _open(args) as life:
        command: Command
        if args.kind == "merge":
            command = Merge(_id(life, args.primitive), _id(life, args.other))
        elif args.kind == "note":
            about = None if args.primitive is None else _id(life, args.primitive)
            command = Note(args.text, about)
        else:
            command = one[args.kind](_id(life, args.primitive))
        done = life.execute(command, by=args.by)
    print(_line(done))  # now that it is in the file


def _toggle(args: argparse.Namespace) -> None:
    with _open(args) as life:
        toggle = life.undo if args.kind == "undo" else life.redo
        done = toggle(by=args.by, number=args.number)
    print(_line(done))


def rename(path: Path, key: str, name: str) -> str:
    """Give a primitive of a store a name; return what was done.

    Raises:
        MPLearnError: It cannot be done.
    """
    from mplearn.store import LifelongLearner, Rename

    with LifelongLearner.open(path) as life:
        id = _id(life, key)
        before = life.snapshot()[id].name
        life.execute(Rename(id, name))
        return f"primitive {id}: {before} -> {name}"


def _open(args: argparse.Namespace) -> LifelongLearner:
    from mplearn.store import LifelongLearner

    return LifelongLearner.open(args.store)


def _id(life: LifelongLearner, key: str, *, alive: bool = True) -> int:
    """Return the id of a primitive by id or name."""
    library = life.snapshot()
    if key in library:
        return library[key].id
    if key.isdecimal() and len(key) < 16:
        return library[int(key)].id if alive else int(key)
    return library[key].id


def _entry(entry: Entry) -> dict[str, Any]:
    from mplearn.store.commands import to_record

    return {
        "number": entry.number,
        **to_record(entry.command),
        "by": entry.by,
        "when": entry.when,
        "frame": entry.frame,
        "undone": entry.undone,
    }


def _line(entry: Entry) -> str:
    return printable(f"{entry.number:4d}  {_date(entry.when)}  {_asked(entry)}")


def _asked(entry: Entry) -> str:
    """Return what was asked, and by whom."""
    from mplearn.store.commands import to_record

    record = to_record(entry.command)
    what = " ".join([record.pop("kind"), *(f"{k}={v}" for k, v in record.items() if v is not None)])
    by = f" by {entry.by}" if entry.by else ""
    return f"{what}{by}{' (undone)' if entry.undone else ''}"


def _told(happening: Happening, entries: dict[int, Entry]) -> str:
    """Return what happened to a primitive, in words."""
    if happening.entry is not None and happening.entry in entries:
        entry = entries[happening.entry]
        return printable(f"{happening.primitive} {_asked(entry)} (command {entry.number})")
    others = ", ".join(map(str, happening.others))
    shown = f" from {happening.exemplars} demonstrations" if happening.exemplars else ""
    words = {"merged": f"absorbed {others}", "split": f"split into {others}"}
    return f"{happening.primitive} {words.get(happening.what, happening.what)}{shown}"


def _date(when: float) -> str:
    try:
        return datetime.fromtimestamp(when).strftime("%Y-%m-%d %H:%M:%S")
    except (ValueError, OverflowError, OSError):
        return f"{when:g} s"


def _length(life: LifelongLearner) -> str:
    seconds = life.n_frames / life.learner.config.rate_hz
    return f"{seconds:.0f} s" if seconds < 120 else f"{seconds / 60:.1f} minutes"
