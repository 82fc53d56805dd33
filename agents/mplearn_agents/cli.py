"""The ``mplearn`` command: one sub-command a module in `mplearn_agents.commands`."""

from __future__ import annotations

import argparse
import importlib
import os
import pkgutil
import sys
from collections.abc import Sequence
from importlib.metadata import version
from types import ModuleType

from mplearn.errors import MPLearnError

from . import commands
from .reading import printable

#: What `main` returns for bad input, as argparse does for a bad option.
BAD_INPUT = 2


def main(argv: Sequence[str] | None = None) -> int:
    """Run a sub-command and return the exit code: 0, or 2 with one line on standard error.

    Args:
        argv: The command line without the program's name; None takes ``sys.argv``.
    """
    args = _parser().parse_args(argv)
    try:
        args.run(args)
        sys.stdout.flush()
    except MPLearnError as error:
        return _refuse(str(error))
    except BrokenPipeError:  # the reader, say `head`, has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except OSError as error:
        return _refuse(f"{error.filename or 'input or output'}: {error.strerror or error}")
    except KeyboardInterrupt:
        return 130
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="mplearn",
        description="Learn motion primitives and their order by watching people, and perform them.",
    )
    parser.add_argument("--version", action="version", version=f"mplearn {version('mplearn')}")
    found = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    for name, module in _commands().items():
        command = found.add_parser(name, help=module.HELP, description=module.HELP)
        module.add_arguments(command)
        command.set_defaults(run=module.run)
    return parser


def _commands() -> dict[str, ModuleType]:
    """Return the modules of `commands` by name; each has HELP, ``add_arguments`` and ``run``."""
    names = sorted(module.name for module in pkgutil.iter_modules(commands.__path__))
    return {name: importlib.import_module(f"{commands.__name__}.{name}") for name in names}


def _refuse(message: str) -> int:
    print(f"mplearn: {printable(' '.join(message.split()))}", file=sys.stderr)
    return BAD_INPUT


if __name__ == "__main__":
    sys.exit(main())
