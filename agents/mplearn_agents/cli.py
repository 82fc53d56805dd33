"""The ``mplearn`` command: one sub-command a module in `mplearn_agents.commands`.

Exit codes, of all commands: 0 done; 1 what was checked is not in order (``doctor``, ``export
--check``); 2 bad input, with one line on standard error; 130 interrupted.
"""

from __future__ import annotations

import argparse
import importlib
import os
import pkgutil
import re
import sys
from collections.abc import Sequence
from importlib.metadata import version
from types import ModuleType
from typing import NoReturn

from mplearn.errors import InvalidValueError, MPLearnError

from . import commands
from .console import inert_output

#: What `main` returns where something that was checked is not in order.
NOT_IN_ORDER = 1
#: What `main` returns for bad input, as argparse does for a bad option.
BAD_INPUT = 2
#: What `main` returns where a person interrupted it.
INTERRUPTED = 130

_OF_AN_OPTION = re.compile(r"argument (?P<option>--[\w-]+): (?P<problem>must .*)", re.DOTALL)
_CODES = """exit codes: 0 done; 1 what was checked is not in order; 2 bad input; 130 interrupted"""


class _Parser(argparse.ArgumentParser):
    """A parser that refuses bad values in one line."""

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
    with inert_output():
        try:
            return _run(argv)
        except KeyboardInterrupt:
            print("mplearn: interrupted", file=sys.stderr)
            return INTERRUPTED


def _run(argv: Sequence[str] | None) -> int:
    try:
        args = build_parser().parse_args(argv)
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


def build_parser() -> argparse.ArgumentParser:
    """Return the parser of all commands."""
    parser = _Parser(
        prog="mplearn",
        description="Learn motion primitives and their order by watching people, and perform them.",
        epilog=_CODES,
    )
    parser.add_argument("--version", action="version", version=f"mplearn {version('mplearn')}")
    found = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    for name, module in command_modules().items():
        command = found.add_parser(
            name,
            help=module.HELP,
            description=module.HELP,
            epilog=f"example:\n  {module.EXAMPLE}\n\n{_CODES}",
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        module.add_arguments(command)
        command.set_defaults(run=module.run)
    return parser


def command_modules() -> dict[str, ModuleType]:
    """Return the modules of `commands` by name, see there."""
    names = sorted(module.name for module in pkgutil.iter_modules(commands.__path__))
    return {name: importlib.import_module(f"{commands.__name__}.{name}") for name in names}


def _refuse(message: str) -> int:
    print(f"mplearn: {' '.join(message.split())}", file=sys.stderr)
    return BAD_INPUT


if __name__ == "__main__":
    sys.exit(main())
