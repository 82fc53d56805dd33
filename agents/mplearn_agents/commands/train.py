"""``mplearn train``: reinforcement learning over a primitive graph."""

from __future__ import annotations

import argparse
from dataclasses import MISSING, fields
from pathlib import Path
from typing import TYPE_CHECKING, get_args

from mplearn.errors import InvalidValueError
from mplearn_agents.suited import suited
from mplearn_agents.terminal.arguments import count, positive, seed

if TYPE_CHECKING:
    from mplearn_agents.rl import TrainedPolicy, TrainingConfig

HELP = "Train an agent to choose primitives, with masks, the prior and macro steps."
EXAMPLE = "mplearn train --task goal --out agents/goal"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare what the command takes."""
    from mplearn_agents.rl.config import AlgorithmName, EnvVersion, PriorUse, TrainingConfig
    from mplearn_envs.varied.changes import CHANGES

    default = {f.name: f.default for f in fields(TrainingConfig) if f.default is not MISSING}
    parser.add_argument("--out", type=Path, required=True, help="folder for the agent and its log")
    parser.add_argument("--library", type=Path, help="library file (default: the built-in one)")
    parser.add_argument(
        "--env",
        choices=get_args(EnvVersion),
        default=default["env"],
        help="version of the environment (default: v0); v1 has 140 primitives of several people",
    )
    parser.add_argument(
        "--people", choices=["train", "test", "all"], help="of v1: with whom (default: train)"
    )
    parser.add_argument(
        "--changes",
        choices=CHANGES,
        help="of v1's task follow: what changes meanwhile (default: none)",
    )
    parser.add_argument(
        "--task",
        default="goal",
        help="task (default: goal); your own is file.py:Class or module:Class",
    )
    parser.add_argument(
        "--dynamics", choices=["kinematic", "simulated"], default=default["dynamics"]
    )
    parser.add_argument(
        "--algorithm", choices=get_args(AlgorithmName), default=default["algorithm"]
    )
    parser.add_argument(
        "--prior",
        choices=get_args(PriorUse),
        help="what the transition prior is to the policy (default: a feature in 'follow', initial "
        "logits elsewhere)",
    )
    parser.add_argument("--steps", type=count, help="macro steps to train for (default: by task)")
    for name, what in (
        ("round_steps", "macro steps between checkpoints"),
        ("episodes", "episodes of each evaluation"),
        ("seed", "seed of everything"),
    ):
        parser.add_argument(
            f"--{name.replace('_', '-')}",
            type=seed if name == "seed" else count,
            default=default[name],
            help=f"{what} (default: {default[name]})",
        )
    parser.add_argument(
        "--speeds",
        type=positive,
        nargs="+",
        default=default["speeds"],
        help="among which speeds it chooses, as shares of the usual one, which comes first "
        "(default: 1)",
    )
    parser.add_argument(
        "--discount",
        type=positive,
        help="what a reward in a second's time is worth (default: 0.95, in v1 0.98)",
    )
    parser.add_argument(
        "--learning-rate", type=positive, help="of the optimiser (default: by algorithm)"
    )
    parser.add_argument(
        "--network",
        type=count,
        nargs="+",
        metavar="WIDTH",
        default=default["network"],
        help="widths of the hidden layers (default: 128 128)",
    )
    parser.add_argument(
        "--envs",
        dest="n_envs",
        type=count,
        help="environments to learn from at once (default: 16; dqn has 1)",
    )
    parser.add_argument(
        "--resume", action="store_true", help="go on from the last checkpoint in the folder"
    )
    parser.add_argument(
        "--start",
        type=Path,
        metavar="FOLDER",
        help="an agent whose knowledge to start from; its library may have grown since",
    )


def run(args: argparse.Namespace) -> None:
    """Train, and say how good the agent is."""
    from mplearn_agents.rl import TrainingConfig
    from mplearn_agents.rl.train import train
    from mplearn_agents.terminal.console import open_console

    given = {f.name: getattr(args, f.name) for f in fields(TrainingConfig) if hasattr(args, f.name)}
    if ".py:" in args.task:
        given["task"] = str(Path(args.task).absolute())
    given["library"] = None if args.library is None else str(args.library)
    of_v1 = {"people": args.people, "changes": args.changes}
    given["environment"] = {name: value for name, value in of_v1.items() if value is not None}
    if given["environment"] and args.env != "v1":
        names = " and ".join(f"--{name}" for name in given["environment"])
        raise InvalidValueError(f"{names}: only of v1, add --env v1")
    usual = suited(args.task)
    given["prior"] = args.prior or usual.prior
    given["steps"] = usual.steps if args.steps is None else args.steps
    console = open_console()
    config = TrainingConfig(**given)
    start = None if args.start is None else _taken_along(args.start, config)
    train(config, args.out, resume=args.resume, start=start, console=console)
    lines = (args.out / "evaluation.csv").read_text(encoding="utf-8").splitlines()
    for name, value in zip(lines[0].split(","), lines[-1].split(","), strict=True):
        console.print(f"{name:>8s} {float(value):.4g}", highlight=False)
    console.print(f"agent written to {args.out}; see it with: mplearn perform --agent {args.out}")


def _taken_along(folder: Path, config: TrainingConfig) -> TrainedPolicy:
    """Return the agent of a folder, for the environment of a training."""
    from mplearn_agents.rl import TrainedPolicy
    from mplearn_agents.rl.train import make_environment

    agent = TrainedPolicy.load(folder)
    from mplearn_agents.rl.growing import grow

    env = make_environment(config)
    grown = grow(agent, env)
    env.close()
    return grown
