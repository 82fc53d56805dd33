"""``mplearn perform``: the robot walks the graph of a library, or does a task."""

from __future__ import annotations

import argparse
import json
import math
import sys
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mplearn.errors import InvalidValueError, MissingDependencyError
from mplearn_agents.terminal.arguments import count, positive, primitive_key, seed, whole

if TYPE_CHECKING:
    import gymnasium

    from mplearn_agents.policies import Policy
    from mplearn_agents.walk import WalkResult
    from mplearn_envs.robot import Robot
    from mplearn_envs.skills.repertoire import Repertoire

HELP = "Let the robot walk the graph of a library, do a task, or show primitives, pushed or not."
EXAMPLE = "mplearn perform my.mplearn --steps 20 --video walk.mp4"
_GOAL = "path"
_CUT_OFF = {"overshoot": math.inf, "slowest": 0.05}  # what is shown where not all can be
_OF_WALKS: dict[str, Any] = {  # what --show does not take, and its defaults
    "task": None,
    "dynamics": "simulated",
    "steps": 20,
    "episodes": None,
    "seed": 0,
    "upper_body": False,
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare what the command takes."""
    from mplearn_agents.policies import POLICIES
    from mplearn_agents.showing import STAND
    from mplearn_envs.experiments.survival import DIRECTIONS
    from mplearn_envs.robot import ROBOTS

    parser.add_argument(
        "library", type=Path, nargs="?", help="library file (default: the built-in one)"
    )
    who = parser.add_mutually_exclusive_group()
    who.add_argument(
        "--policy",
        choices=[*POLICIES, _GOAL],
        default="random",
        metavar="WHO",
        help="who chooses what comes next",
    )
    who.add_argument("--agent", type=Path, metavar="PATH", help="an agent of `mplearn train`")
    who.add_argument(
        "--show",
        nargs="+",
        metavar="NAME",
        help="perform these primitives (ids or names), one after another, whatever the graph says; "
        f"{STAND!r} is to stand",
    )
    parser.add_argument("--goal", help=f"id or name of the primitive that --policy {_GOAL} goes to")
    parser.add_argument(
        "--push",
        type=positive,
        metavar="NS",
        help="with --show: push the robot at the chest amid each, by so many N s; it takes steps",
    )
    parser.add_argument(
        "--towards",
        choices=[direction.replace(" ", "-") for direction in DIRECTIONS],
        help=f"with --push: where to, as it looks at the start (default: {DIRECTIONS[0]})",
    )
    parser.add_argument("--task", help="task (default: the agent's, or free)")
    parser.add_argument(
        "--dynamics",
        choices=["simulated", "kinematic"],
        help=f"how it moves (default: {_OF_WALKS['dynamics']})",
    )
    parser.add_argument(
        "--steps",
        type=whole(1, noun="step"),
        help=f"how many primitives (default: {_OF_WALKS['steps']})",
    )
    parser.add_argument("--episodes", type=count, help="how many episodes, instead of --steps")
    parser.add_argument("--seed", type=seed, help=f"of the walk (default: {_OF_WALKS['seed']})")
    parser.add_argument(
        "--speed", type=positive, default=0.5, help="share of the human's speed (default: 0.5)"
    )
    parser.add_argument(
        "--upper-body",
        action="store_true",
        help="show only arms, head and the trunk's turn, standing: the default where the robot can "
        "perform none of the motions whole",
    )
    parser.set_defaults(**_OF_WALKS)
    parser.add_argument(
        "--robot",
        metavar="ROBOT",
        help=f"one of {', '.join(ROBOTS)}, or FILE.toml that describes one (default: the agent's, "
        "or humanoid)",
    )
    parser.add_argument("--video", type=Path, metavar="FILE.mp4", help="write a film of it")
    parser.add_argument(
        "--balance",
        action="store_true",
        help="draw support polygon, centre of gravity and zero-moment point in the film",
    )
    parser.add_argument("--json", action="store_true", help="print the steps as JSON")


def run(args: argparse.Namespace) -> None:
    """Walk, print each step, and write the film where one is asked for."""
    from mplearn.extras import require
    from mplearn_envs.rendering.backend import choose_backend

    if (args.policy == _GOAL) != (args.goal is not None):
        raise InvalidValueError(f"--policy {_GOAL} and --goal need each other")
    if args.balance and not args.video:
        raise InvalidValueError("--balance is drawn in a film: give --video, too")
    if args.video:
        require("imageio_ffmpeg", "report")
        if not choose_backend():
            raise MissingDependencyError(
                "a film needs an off-screen renderer, and none works here; install libegl1 and "
                "libgl1-mesa-dri, or libosmesa6 (or leave --video out)"
            )
    if args.push is not None and args.show is None:
        raise InvalidValueError("--push pushes what is performed by --show")
    if args.towards is not None and args.push is None:
        raise InvalidValueError("--towards says where --push pushes: give --push, too")
    if args.show is not None:
        walks = [name for name, usual in _OF_WALKS.items() if getattr(args, name) != usual]
        if walks:
            options = ", ".join(f"--{name.replace('_', '-')}" for name in walks)
            raise InvalidValueError(
                f"--show performs each primitive once, whole, in simulation; it takes no {options}"
            )
    result, robot = _walked(args) if args.show is None else _shown(args)
    if args.json:
        print(json.dumps(_plain(result)), flush=True)
    else:
        _say(result)
    if args.video:
        from mplearn_agents.film import film, with_captions
        from mplearn_agents.terminal.console import open_console
        from mplearn_agents.terminal.progress import tracked
        from mplearn_agents.video import write_video

        names = [step.name for step in result.steps]
        pictures = with_captions(film(result, robot.xml, balance=args.balance), result, names)
        n_pictures = write_video(
            args.video,
            tracked(pictures, len(result.postures), "filming", open_console(stderr=True)),
            result.rate_hz,
        )
        _aside(args, f"film of {n_pictures} pictures written to {args.video}")


def _say(result: WalkResult) -> None:
    for k, step in enumerate(result.steps, start=1):
        print(f"{k:4d}  {step.name:24s} {step.duration_s:6.2f} s{'  FELL' if step.fallen else ''}")
    print(
        f"{_counted(len(result.primitives), 'primitive')} in {result.duration_s:.1f} s of the "
        f"robot's time, {_counted(result.falls, 'fall')}"
    )
    if result.successes is not None and result.episodes:
        print(f"{result.successes} of {result.episodes} episodes succeeded")


def _plain(result: WalkResult) -> dict[str, Any]:
    """Return a walk as values that JSON has: what was not measured is None."""
    return {
        "steps": [
            {name: None if value != value else value for name, value in asdict(step).items()}
            for step in result.steps
        ],
        "duration_s": result.duration_s,
        "falls": result.falls,
        "episodes": result.episodes,
        "successes": result.successes,
    }


def _aside(args: argparse.Namespace, text: str) -> None:
    """Say what is no step: beside what is read as JSON, where that is asked for."""
    print(text, file=sys.stderr if args.json else sys.stdout)


def _counted(n: int, noun: str) -> str:
    return f"{n} {noun}" if n == 1 else f"{n} {noun}s"


def _walked(args: argparse.Namespace) -> tuple[WalkResult, Robot]:
    """Let the robot walk; return what came of it, and the robot."""
    import gymnasium

    import mplearn_envs  # noqa: F401  (registers the environment)
    from mplearn_agents.rl import TrainingConfig
    from mplearn_agents.rl.trained import CONFIG
    from mplearn_agents.terminal.console import open_console
    from mplearn_agents.terminal.progress import open_progress
    from mplearn_agents.walk import walk
    from mplearn_envs.robot import make_robot

    trained = TrainingConfig(task="free")
    if args.agent is not None:
        trained, *_ = TrainingConfig.load(args.agent / CONFIG)
    options = trained.options | {
        "task": args.task or trained.task,
        "dynamics": args.dynamics,
        "disable_env_checker": True,
    }
    if args.robot is not None:
        options["robot"] = make_robot(args.robot)
    if args.library is not None:
        if trained.env == "v1":
            raise InvalidValueError("the agent was trained on v1, which has its own library")
        options["library"] = args.library
    name = f"mplearn/PrimitiveHumanoid-{trained.env}"
    whole: dict[str, Any] = options.pop("motion", {}) | {"speed": args.speed}
    standing = whole | {"upper_body": True, "feasibility": _CUT_OFF}
    env = gymnasium.make(name, motion=standing if args.upper_body else whole, **options)
    repertoire = env.unwrapped.repertoire  # type: ignore[attr-defined]
    if not args.upper_body and not repertoire.any_feasible:
        problem = repertoire.skills.feasibility(repertoire.ids[0]).problems[0]
        _aside(
            args,
            f"the robot can perform none of the {len(repertoire.ids)} motions whole ({problem}): "
            "it stands, and shows arms, head and the trunk's turn",
        )
        env = gymnasium.make(name, motion=standing, **options)
    policy = _policy(args, env)
    record = args.video is not None
    with open_progress(open_console(stderr=True)) as bar:
        task = bar.add_task("performing", total=args.episodes or args.steps)
        result = walk(
            env,
            policy,
            args.steps,
            args.seed,
            episodes=args.episodes,
            record=record,
            show=lambda done: bar.update(task, completed=done),
        )
    for name, problem in _left_out(env.unwrapped.repertoire, result):  # type: ignore[attr-defined]
        _aside(args, f"{name} would have come, but the robot cannot perform it: {problem}")
    robot: Robot = env.unwrapped.robot  # type: ignore[attr-defined]
    env.close()
    return result, robot


def _left_out(repertoire: Repertoire, result: WalkResult) -> list[tuple[str, str]]:
    """Return what follows what was performed, and cannot be: names, and the first reason each."""
    refused: dict[int, str] = {}
    for performed in sorted(set(result.primitives)):
        for slot, problems in repertoire.after(performed).refused.items():
            id = repertoire.primitive(slot)
            if id is not None:
                refused[id] = problems[0]
    return [(repertoire.library[id].name, problem) for id, problem in sorted(refused.items())]


def _shown(args: argparse.Namespace) -> tuple[WalkResult, Robot]:
    """Let the robot show primitives; return what came of it, and the robot."""
    from mplearn_agents.showing import Push, show
    from mplearn_envs.data.library_source import LibrarySource
    from mplearn_envs.robot import make_robot

    robot, library = make_robot(args.robot or "humanoid"), LibrarySource(args.library).now()
    towards = {} if args.towards is None else {"direction": args.towards.replace("-", " ")}
    push = None if args.push is None else Push(args.push, **towards)
    wanted = [primitive_key(name) for name in args.show]
    return show(library, robot, wanted, speed=args.speed, push=push), robot


def _policy(args: argparse.Namespace, env: gymnasium.Env[Any, Any]) -> Policy:
    from mplearn_agents.policies import POLICIES, PathToGoal

    if args.agent is not None:
        from mplearn_agents.rl import TrainedPolicy

        agent = TrainedPolicy.load(args.agent)
        agent.require_fit(env)
        return agent
    if args.goal is None:
        return POLICIES[args.policy](env)
    goal = primitive_key(args.goal)
    return PathToGoal.for_env(env, goal)
