"""``mplearn demo``: the whole chain in a few minutes."""

from __future__ import annotations

import argparse
from pathlib import Path

HELP = "Learn from a synthetic demonstrator, let the robot walk, and write a report."


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare what the command takes."""
    parser.add_argument(
        "--out", type=Path, default=Path("out/demo"), help="folder to write to (default: out/demo)"
    )
    parser.add_argument(
        "--minutes", type=float, default=7.0, help="minutes of demonstration (default: 7)"
    )
    parser.add_argument(
        "--steps", type=int, default=20, help="primitives that the robot performs (default: 20)"
    )
    parser.add_argument("--seed", type=int, default=1, help="seed of everything (default: 1)")


def run(args: argparse.Namespace) -> None:
    """Run the demo."""
    from rich.console import Console

    from mplearn_agents.demo.run import run_demo

    run_demo(args.out, args.minutes, args.steps, args.seed, Console())
