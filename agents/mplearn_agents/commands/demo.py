"""``mplearn demo``: the whole chain in a few minutes."""

from __future__ import annotations

import argparse
from pathlib import Path

from mplearn_agents.terminal.arguments import count, positive, seed

HELP = "Learn from a synthetic demonstrator, let the robot walk, and write a report."
EXAMPLE = "mplearn demo --minutes 7 --out out/demo"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare what the command takes."""
    parser.add_argument(
        "--out", type=Path, default=Path("out/demo"), help="folder to write to (default: out/demo)"
    )
    parser.add_argument(
        "--minutes", type=positive, default=7.0, help="minutes of demonstration (default: 7)"
    )
    parser.add_argument(
        "--steps", type=count, default=20, help="primitives that the robot performs (default: 20)"
    )
    parser.add_argument("--seed", type=seed, default=1, help="seed of everything (default: 1)")


def run(args: argparse.Namespace) -> None:
    """Run the demo."""
    from mplearn_agents.demo.run import run_demo
    from mplearn_agents.terminal.console import open_console

    run_demo(args.out, args.minutes, args.steps, args.seed, open_console())
