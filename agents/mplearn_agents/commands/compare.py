"""``mplearn compare``: policies and trained agents, as a table."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, get_args

from mplearn_agents.suited import SUITED
from mplearn_agents.terminal.arguments import count, positive, seed

if TYPE_CHECKING:
    from mplearn_agents.contests.contest import Contest

HELP = "Compare policies and trained agents on the environment's tasks."
EXAMPLE = "mplearn compare --tasks goal --policies random greedy --seeds 3"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare what the command takes."""
    parser.add_argument(
        "--out", type=Path, default=Path("out/compare"), help="folder (default: out/compare)"
    )
    parser.add_argument(
        "--env",
        choices=["v0", "v1", "online"],
        default="v0",
        help="version of the environment; online: a learner watches meanwhile (default: v0)",
    )
    parser.add_argument(
        "--people",
        nargs="+",
        default=["train", "test"],
        help="of v1: with whom to play; agents are trained with 'train'",
    )
    parser.add_argument(
        "--changes",
        nargs="+",
        default=["none"],
        help="of v1's task follow: what changes meanwhile: none, growing, habits, people, all "
        "(default: none)",
    )
    parser.add_argument(
        "--bodies",
        nargs="+",
        default=["nominal"],
        help="what the simulated body is like: nominal, randomised, harsh (default: nominal)",
    )
    parser.add_argument(
        "--speeds",
        type=positive,
        nargs="+",
        default=[1.0],
        help="among which speeds everyone chooses, as shares of the usual one, which comes first "
        "(default: 1)",
    )
    parser.add_argument("--library", type=Path, help="library file (default: the built-in one)")
    parser.add_argument("--tasks", nargs="+", default=list(SUITED))
    parser.add_argument(
        "--dynamics",
        nargs="+",
        choices=["kinematic", "simulated"],
        default=["kinematic", "simulated"],
    )
    parser.add_argument("--policies", nargs="+", help="names of policies (default: all)")
    parser.add_argument("--algorithms", nargs="*", default=["maskable-ppo"])
    parser.add_argument("--priors", nargs="+", help="see `mplearn train` (default: by task)")
    parser.add_argument(
        "--variants",
        action="store_true",
        help="compare on 'goal', too, the uses of the prior, and PPO and DQN without masks",
    )
    parser.add_argument("--seeds", type=count, default=5, help="number of seeds (default: 5)")
    parser.add_argument("--first-seed", type=seed, default=100, help="the first (default: 100)")
    parser.add_argument("--episodes", type=count, default=50, help="kinematic episodes a seed")
    parser.add_argument(
        "--simulated-episodes", type=count, default=4, metavar="N", help="simulated episodes a seed"
    )
    parser.add_argument("--steps", type=count, help="macro steps of a training (default: by task)")
    parser.add_argument("--jobs", type=count, help="processes (default: one a processor)")
    parser.add_argument("--json", action="store_true", help="print each table as a line of JSON")


def run(args: argparse.Namespace) -> None:
    """Train and play what was not before, and print and write each table as it is done."""
    from dataclasses import replace

    from mplearn_agents.contests.compare import compare
    from mplearn_agents.contests.comparison import Comparison
    from mplearn_agents.policies import POLICIES
    from mplearn_agents.rl.config import AlgorithmName, PriorUse
    from mplearn_agents.terminal.console import open_console
    from mplearn_agents.terminal.progress import open_progress
    from mplearn_agents.terminal.tables import show_table

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
        env=args.env,
        people=tuple(args.people),
        bodies=tuple(args.bodies),
        changes=tuple(args.changes),
        speeds=tuple(args.speeds),
    )
    comparisons = [comparison]
    if args.variants:
        alone = replace(comparison, tasks=("goal",), dynamics=("kinematic",), policies=())
        comparisons += [
            replace(alone, algorithms=("maskable-ppo",), priors=get_args(PriorUse)),
            replace(alone, algorithms=get_args(AlgorithmName), priors=None),
        ]
    console, file = open_console(stderr=args.json), args.out / "compare.md"
    args.out.mkdir(parents=True, exist_ok=True)
    written: list[str] = []
    total = sum(each.n_contests for each in comparisons)
    with open_progress(console) as progress:
        bar = progress.add_task("", total=total)

        def done(contest: Contest) -> None:
            what = f"{contest.name} on {contest.task}, seed {contest.seed}"
            progress.update(bar, advance=1, description=what)

        for each in comparisons:
            for tables in compare(each, args.out, args.jobs, done):
                for table in tables:
                    show_table(console, table, json=args.json)
                written.append(tables[0].to_markdown())  # time on the wall is another each time
                file.write_text("\n".join(written), encoding="utf-8")
    console.print(f"written to {file}")
