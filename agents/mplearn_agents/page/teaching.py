"""What teachers ask of the learner: requests of the page as commands, and commands in words."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from mplearn.errors import InvalidValueError
from mplearn.store import (
    Command,
    Delete,
    Freeze,
    LifelongLearner,
    Merge,
    Note,
    Pause,
    Redo,
    Rename,
    Resume,
    Split,
    Undo,
    Unfreeze,
)

from .messages import Header, brief, literal, mention

LONGEST_NAME, LONGEST_NOTE = 80, 1000


def do(lifelong: LifelongLearner, asked: Mapping[str, Any], by: str) -> tuple[str, int]:
    """Do what a teacher asks, and return what was done, in words, and the command's number.

    Args:
        lifelong: Who learns.
        asked: The request: ``do`` says what, see `COMMANDS`; or undo and redo, of the command
            ``entry`` where that is given.
        by: Who asks.

    Raises:
        MPLearnError: It cannot be done; nothing has changed then.
    """
    what = asked["do"]
    if what in ("undo", "redo"):
        number = _id(asked, "entry", "a command") if "entry" in asked else None
        entry = (lifelong.undo if what == "undo" else lifelong.redo)(by, number)
        return in_words(entry.command, lifelong), entry.number
    if what not in COMMANDS:
        raise InvalidValueError(f"a request is one of {', '.join(COMMANDS)}, not {what[:40]!r}")
    command = COMMANDS[what](asked)
    text = in_words(command, lifelong)  # before names change
    return text, lifelong.execute(command, by=by).number


def in_words(command: Command, lifelong: LifelongLearner) -> str:
    """Return what a command does, in a few words."""
    library = lifelong.snapshot()

    def name(id: int) -> str:
        return literal(brief(library[id].name)) if id in library else f"P{id}"

    match command:
        case Rename(id, new):
            is_so = id in library and library[id].name == new
            return f"{f'P{id}' if is_so else name(id)} is called {literal(brief(new))} now"
        case Merge(first, second):
            return f"{name(first)} and {name(second)} are one"
        case Split(id):
            return f"{name(id)} is two"
        case Delete(id):
            return f"{name(id)} is forgotten"
        case Freeze(id):
            return f"{name(id)} stays as it is"
        case Unfreeze(id):
            return f"{name(id)} may change again"
        case Note(text, None):
            return f"note: {literal(text)}"
        case Note(text, int(id)):
            return f"note on {name(id)}: {literal(text)}"
        case Pause():
            return "learning is paused"
        case Resume():
            return "learning goes on"
        case Undo(number) | Redo(number):
            done = {entry.number: entry.command for entry in lifelong.entries(number - 1)}
            what = "undone" if isinstance(command, Undo) else "done again"
            return f"{what}: {in_words(done[number], lifelong)}" if number in done else what
        case _:
            return command.kind


def history(lifelong: LifelongLearner, asked: Mapping[str, Any]) -> list[Header]:
    """Return what happened to a primitive: when [s since 1970], and what, the oldest first."""
    entries = {entry.number: entry for entry in lifelong.entries()}
    lines: list[Header] = []
    for each in lifelong.history(_id(asked)):
        entry = None if each.entry is None else entries.get(each.entry)
        others = " and ".join(mention(id) for id in each.others)
        match each.what:
            case "command" if entry is not None:
                undone = " (undone)" if entry.undone else ""
                text = f"{entry.by}: {in_words(entry.command, lifelong)}{undone}"
            case "born":
                text = f"formed from {each.exemplars} demonstrations"
            case "confirmed":
                text = f"learned, after {each.exemplars} demonstrations"
            case "merged":
                text = f"one with {others}"
            case "split":
                text = f"parted into {others}"
            case other:
                text = other
        lines.append({"when": each.when, "text": text})
    return lines


def _id(asked: Mapping[str, Any], key: str = "id", of: str = "a primitive") -> int:
    value = asked.get(key)
    if type(value) is not int or not 0 <= value < 2**53:
        raise InvalidValueError(f"{key} must be the number of {of}, not {value!r:.40}")
    return value


def _text(asked: Mapping[str, Any], key: str, longest: int) -> str:
    value = asked.get(key)
    if not isinstance(value, str) or len(value) > longest:
        raise InvalidValueError(f"{key} must be a text of at most {longest} characters")
    return value.strip()


#: The commands by the names that requests give them.
COMMANDS: dict[str, Callable[[Mapping[str, Any]], Command]] = {
    "rename": lambda asked: Rename(_id(asked), _text(asked, "name", LONGEST_NAME)),
    "merge": lambda asked: Merge(_id(asked), _id(asked, "other")),
    "split": lambda asked: Split(_id(asked)),
    "forget": lambda asked: Delete(_id(asked)),
    "freeze": lambda asked: Freeze(_id(asked)),
    "unfreeze": lambda asked: Unfreeze(_id(asked)),
    "note": lambda asked: Note(_text(asked, "text", LONGEST_NOTE), _id(asked)),
    "pause": lambda asked: Pause(),
    "resume": lambda asked: Resume(),
}
