"""``mplearn completion``: a script that lets a shell complete commands and options."""

from __future__ import annotations

import argparse

HELP = "Print a script that lets a shell complete commands, options and files."
EXAMPLE = "mplearn completion bash > ~/.local/share/bash-completion/completions/mplearn"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare what the command takes."""
    parser.add_argument("shell", choices=["bash", "zsh", "tcsh"])


def run(args: argparse.Namespace) -> None:
    """Print the script."""
    from pathlib import Path

    import shtab

    parser = args.build_parser()
    for each in _parsers(parser):
        for action in each._actions:
            if action.type is Path:
                action.complete = shtab.FILE  # type: ignore[attr-defined]
    print(shtab.complete(parser, args.shell))


def _parsers(parser: argparse.ArgumentParser) -> list[argparse.ArgumentParser]:
    found = [parser]
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for each in action.choices.values():
                found += _parsers(each)
    return found
