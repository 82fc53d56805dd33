"""``mplearn episodes``: episodes as a Minari data set."""

from __future__ import annotations

import argparse
from pathlib import Path

from mplearn_agents.terminal.arguments import count, seed

HELP = "Play episodes and write them as a Minari data set, for offline reinforcement learning."
EXAMPLE = "mplearn episodes mplearn/goal-random-v0 --task goal --out out/data"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare what the command takes."""
    from mplearn_agents.policies import POLICIES

    parser.add_argument("dataset", help="id of the data set, like mplearn/goal-random-v0")
    parser.add_argument(
        "--out", type=Path, help="folder of the data sets (default: Minari's own, ~/.minari)"
    )
    parser.add_argument("--library", type=Path, help="library file (default: the built-in one)")
    parser.add_argument("--task", default="free", help="task (default: free)")
    parser.add_argument("--dynamics", choices=["simulated", "kinematic"], default="simulated")
    parser.add_argument("--policy", choices=POLICIES, default="random", help="who chooses")
    parser.add_argument("--episodes", type=count, default=10, help="how many (default: 10)")
    parser.add_argument("--seed", type=seed, default=0, help="of the episodes (default: 0)")


def run(args: argparse.Namespace) -> None:
    """Play, write, and say what was written."""
    import gymnasium

    import mplearn_envs  # noqa: F401  (registers the environment)
    from mplearn_agents.policies import POLICIES
    from mplearn_agents.rl.offline import export_episodes
    from mplearn_agents.terminal.console import open_console
    from mplearn_agents.terminal.progress import open_progress

    env = gymnasium.make(
        "mplearn/PrimitiveHumanoid-v0",
        library=None if args.library is None else str(args.library.absolute()),
        task=args.task,
        dynamics=args.dynamics,
        disable_env_checker=True,
    )
    with open_progress(open_console(stderr=True)) as bar:
        task = bar.add_task("playing", total=args.episodes)
        written, played = export_episodes(
            env,
            POLICIES[args.policy](env),
            args.episodes,
            args.dataset,
            args.out,
            args.seed,
            show=lambda done: bar.update(task, completed=done),
        )
    env.close()
    print(
        f"{args.dataset}: {len(played)} episodes, {written.total_steps} macro steps, "
        f"{sum(episode.duration_s for episode in played):.0f} s of the robot's time"
    )
