"""``mplearn perform``: the robot walks the graph of a library."""

from __future__ import annotations

import argparse
from pathlib import Path

from mplearn.errors import InvalidValueError, MissingDependencyError

HELP = "Let the robot walk the graph of a library."
_GOAL = "path"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare what the command takes."""
    from mplearn_agents.policies import POLICIES

    parser.add_argument(
        "library", type=Path, nargs="?", help="library file (default: the built-in one)"
    )
    parser.add_argument(
        "--policy", choices=[*POLICIES, _GOAL], default="random", help="who chooses what comes next"
    )
    parser.add_argument("--goal", help=f"id or name of the primitive that --policy {_GOAL} goes to")
    parser.add_argument("--steps", type=int, default=20, help="how many primitives (default: 20)")
    parser.add_argument("--seed", type=int, default=0, help="seed of the walk (default: 0)")
    parser.add_argument(
        "--speed", type=float, default=0.5, help="share of the human's speed (default: 0.5)"
    )
    parser.add_argument("--video", type=Path, metavar="FILE.mp4", help="write a film of it")


def run(args: argparse.Namespace) -> None:
    """Walk, print each step, and write the film where one is asked for."""
    from mplearn_agents.extras import require
    from mplearn_envs.graphics import choose_backend

    if (args.policy == _GOAL) != (args.goal is not None):
        raise InvalidValueError(f"--policy {_GOAL} and --goal need each other")
    if args.video:
        require("imageio_ffmpeg", "report")
        if not choose_backend():
            raise MissingDependencyError(
                "a film needs an off-screen renderer, and none works here; install libegl1 and "
                "libgl1-mesa-dri, or libosmesa6 (or leave --video out)"
            )
    import gymnasium

    import mplearn_envs  # noqa: F401  (registers the environment)
    from mplearn_agents.policies import POLICIES, PathToGoal
    from mplearn_agents.walk import walk

    env = gymnasium.make(
        "mplearn/PrimitiveHumanoid-v0",
        library=args.library,
        speed=args.speed,
        disable_env_checker=True,
    )
    if args.goal is None:
        policy = POLICIES[args.policy]()
    else:
        goal = int(args.goal) if args.goal.isdecimal() else args.goal
        policy = PathToGoal.for_env(env, goal)
    result = walk(env, policy, args.steps, args.seed, record=args.video is not None)
    for k, step in enumerate(result.steps, start=1):
        print(f"{k:4d}  {step.name:24s} {step.duration_s:6.2f} s{'  FELL' if step.fallen else ''}")
    print(
        f"{len(result.primitives)} primitives in {result.duration_s:.1f} s of the robot's time, "
        f"{result.falls} falls"
    )
    if args.video:
        from mplearn_agents.film import film, with_captions
        from mplearn_agents.video import write_video

        robot = env.unwrapped.robot  # type: ignore[attr-defined]
        names = [step.name for step in result.steps]
        pictures = with_captions(film(result, robot.xml), result, names)
        n_pictures = write_video(args.video, pictures, result.rate_hz)
        print(f"film of {n_pictures} pictures written to {args.video}")
    env.close()
