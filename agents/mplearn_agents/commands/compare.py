"""``mplearn compare``: policies and trained agents, as a table."""

from __future__ import annotations

import argparse
from pathlib import Path

HELP = "Compare policies and trained agents on the environment's tasks."


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare what the command takes."""
    parser.add_argument(
        "--out", type=Path, default=Path("out/compare"), help="folder (default: out/compare)"
    )
    parser.add_argument("--library", type=Path, help="library file (default: the built-in one)")
    parser.add_argument("--tasks", nargs="+", default=["goal", "follow", "recite", "free"])
    parser.add_argument(
        "--dynamics",
        nargs="+",
        choices=["kinematic", "simulated"],
        default=["kinematic", "simulated"],
    )
    parser.add_argument("--policies", nargs="+", help="names of policies (default: all)")
    parser.add_argument("--algorithms", nargs="*", default=["maskable-ppo"])
    parser.add_argument("--priors", nargs="+", help="see `mplearn train` (default: by task)")
    parser.add_argument("--seeds", type=int, default=5, help="number of seeds (default: 5)")
    parser.add_argument("--first-seed", type=int, default=100, help="the first (default: 100)")
    parser.add_argument("--episodes", type=int, default=50, help="kinematic episodes a seed")
    parser.add_argument(
        "--simulated-episodes", type=int, default=4, help="simulated episodes a seed"
    )
    parser.add_argument("--steps", type=int, default=40_000, help="macro steps of a training")


def run(args: argparse.Namespace) -> None:
    """Train what is not trained yet, play, and print each table as it is done."""
    from rich.console import Console
    from rich.table import Table as Shown

    from mplearn_agents.compare import Comparison, compare
    from mplearn_agents.policies import POLICIES

    console = Console()
    comparison = Comparison(
        tasks=tuple(args.tasks),
        dynamics=tuple(args.dynamics),
        policies=tuple(args.policies or POLICIES),
        algorithms=tuple(args.algorithms),
        priors=tuple(args.priors) if args.priors else None,
        seeds=tuple(range(args.first_seed, args.first_seed + args.seeds)),
        episodes=args.episodes,
        simulated_episodes=args.simulated_episodes,
        steps=args.steps,
        library=None if args.library is None else str(args.library),
    )
    args.out.mkdir(parents=True, exist_ok=True)
    written = []
    for table in compare(comparison, args.out / "agents", console):
        shown = Shown(*table.columns, title=table.title, caption=table.note, caption_justify="left")
        for row in table.rows:
            shown.add_row(*row)
        console.print(shown)
        written.append(table.to_markdown())
    file = args.out / "compare.md"
    file.write_text("\n".join(written), encoding="utf-8")
    console.print(f"written to {file}")
