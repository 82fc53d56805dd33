"""The ``mplearn`` command: one sub-command a module in `mplearn_agents.commands`.

Exit codes, of all commands: 0 done; 1 what was checked is not in order (``doctor``, ``export
--check``, ``store check``); 2 bad input, with one line on standard error; 3 what ``learn`` learned
is not all where it was to be, for that could not be written (where the library is instead is said);
130 interrupted, 143 by SIGTERM (``learn`` writes what it has learned first, and says 130 of either;
who looks at a live source ends it by either, which is no interruption).
"""

from __future__ import annotations

import argparse
import importlib
import os
import pkgutil
import re
import sys
from collections.abc import Sequence
from types import ModuleType
from typing import Any, NoReturn

from mplearn.errors import InvalidValueError, MPLearnError
from mplearn_agents.terminal.exit_codes import BAD_INPUT, INTERRUPTED, SIGNALLED
from mplearn_agents.terminal.help_that_fits import HelpThatFits
from mplearn_agents.terminal.inert import inert_output
from mplearn_agents.terminal.interrupts import interrupted
from mplearn_agents.terminal.plain_warnings import plain_warnings

from . import commands

_OF_AN_OPTION = re.compile(r"argument (?P<option>--[\w-]+): (?P<problem>must .*)", re.DOTALL)
_CODES = (
    "exit codes: 0 done; 1 what was checked is not in order; 2 bad input; 3 not all that "
    "was learned could be written where it was to be; 130 interrupted (143 by SIGTERM)"
)


class _Version(argparse.Action):
    """Prints which version this is."""

    def __init__(self, option_strings: Sequence[str], dest: str) -> None:
        super().__init__(option_strings, dest, nargs=0, help="print the version, and end")

    def __call__(self, parser: argparse.ArgumentParser, *_: Any) -> NoReturn:
        from importlib.metadata import version

        print(f"mplearn {version('mplearn')}")
        parser.exit()


class _Parser(argparse.ArgumentParser):
    """A parser that refuses bad values in one line, and takes ``--up -y`` as ``--up=-y``."""

    def parse_known_args(  # type: ignore[override]
        self, args: Sequence[str] | None = None, namespace: argparse.Namespace | None = None
    ) -> tuple[argparse.Namespace, list[str]]:
        words: list[str] = []
        for word in sys.argv[1:] if args is None else args:
            if words and words[-1] == "--up" and re.fullmatch("-[xyz]", word):
                words[-1] = f"--up={word}"
            else:
                words.append(word)
        return super().parse_known_args(words, namespace)

    def error(self, message: str) -> NoReturn:
        value = _OF_AN_OPTION.match(message)
        if value is not None:
            raise InvalidValueError(f"{value['option']} {value['problem']}")
        self.exit(BAD_INPUT, f"{self.prog}: {' '.join(message.split())}\n")


def main(argv: Sequence[str] | None = None) -> int:
    """Run a sub-command and return the exit code, see this module.

    Args:
        argv: The command line without the program's name; None takes ``sys.argv``.
    """
    came: list[int] = []
    with inert_output(), plain_warnings():
        try:
            with interrupted() as came:
                code = _run(argv)
        except KeyboardInterrupt:
            pass
        except BaseException:  # a library that is interrupted on the way in raises what it likes
            if not came:
                raise
        else:
            if not came:
                return code
        print("mplearn: interrupted", file=sys.stderr)
        return SIGNALLED + came[0] if came else INTERRUPTED


def _run(argv: Sequence[str] | None) -> int:
    try:
        words = sys.argv[1:] if argv is None else list(argv)
        args = build_parser(words).parse_args(words)
        code = args.run(args)
        sys.stdout.flush()
    except MPLearnError as error:
        return _refuse(str(error))
    except BrokenPipeError:  # the reader, say `head`, has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except OSError as error:
        return _refuse(f"{error.filename or 'input or output'}: {error.strerror or error}")
    return 0 if code is None else int(code)


def build_parser(words: Sequence[str] | None = None) -> argparse.ArgumentParser:
    """Return the parser of all commands.

    Args:
        words: What will be parsed: of other commands than the one in it only the names are there,
            for to learn what they take costs seconds. None for all that all take.
    """
    known, named = _names(), None
    if words is not None:
        named = next((word for word in words if not word.startswith("-")), "")
    parser = _Parser(
        prog="mplearn",
        description="Learn motion primitives and their order by watching people, and perform them.",
        epilog=_CODES,
    )
    parser.add_argument("--version", action=_Version)
    found = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    for name in known:
        if named in known and name != named:
            found.add_parser(name)
            continue
        module = _module(name)
        command = found.add_parser(
            name,
            help=module.HELP,
            description=module.HELP,
            epilog=f"example:\n  {module.EXAMPLE}\n\n{_CODES}",
            formatter_class=HelpThatFits,
        )
        if named in (None, name):
            module.add_arguments(command)
            command.set_defaults(run=module.run, build_parser=build_parser)
    return parser


def command_modules() -> dict[str, ModuleType]:
    """Return the modules of `commands` by name, see there."""
    return {name: _module(name) for name in _names()}


def _names() -> list[str]:
    return sorted(module.name for module in pkgutil.iter_modules(commands.__path__))


def _module(name: str) -> ModuleType:
    return importlib.import_module(f"{commands.__name__}.{name}")


def _refuse(message: str) -> int:
    print(f"mplearn: {' '.join(message.split())}", file=sys.stderr)
    return BAD_INPUT


if __name__ == "__main__":
    sys.exit(main())
