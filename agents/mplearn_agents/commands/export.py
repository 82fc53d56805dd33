"""``mplearn export``: what a robot performs, in other tools' files; and checks of such files."""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import TYPE_CHECKING

from mplearn.errors import InvalidValueError
from mplearn_agents.terminal.arguments import count, positive, primitive_key, seed
from mplearn_agents.terminal.exit_codes import NOT_IN_ORDER

if TYPE_CHECKING:
    from mplearn_envs.export import Verdict
    from mplearn_envs.robot import Robot

HELP = "Export what a robot performs of a library, a path or a walk; or check such a file."
EXAMPLE = "mplearn export my.mplearn 'bow down' 'bow up' --robot unitree_g1 --to mjlab"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare what the command takes."""
    from mplearn_envs.export import formats

    parser.add_argument(
        "library", type=Path, nargs="?", help="library file (default: the built-in one)"
    )
    parser.add_argument(
        "path",
        nargs="*",
        metavar="PRIMITIVE",
        help="ids or names, in their order; with none, each primitive is a motion of its own",
    )
    parser.add_argument("--walk", type=count, metavar="N", help="a random walk of N primitives")
    parser.add_argument("--clips", type=count, default=1, help="how many walks (default: 1)")
    parser.add_argument("--seed", type=seed, default=0, help="of the first walk (default: 0)")
    parser.add_argument(
        "--to",
        metavar="FORMAT",
        help="; ".join(f"{format.name}: {format.about}" for format in formats().values()),
    )
    parser.add_argument(
        "--out", type=Path, help="file or folder to write (default: named after the motion)"
    )
    parser.add_argument(
        "--robot",
        default="humanoid",
        metavar="ROBOT",
        help="humanoid (default), unitree_g1 (or g1) or another by its name, FILE.toml that "
        "describes a robot; to check, its MJCF will do: FILE.xml",
    )
    parser.add_argument("--rate", type=positive, metavar="HZ", help="(default: the format's)")
    parser.add_argument(
        "--speed", type=positive, default=0.5, help="share of the human's speed (default: 0.5)"
    )
    parser.add_argument(
        "--upper-body",
        action="store_true",
        help="only arms, head and the trunk's turn, standing: where it cannot follow the legs",
    )
    parser.add_argument(
        "--simulate",
        action="store_true",
        help="what the robot does in simulation instead of what it is to do; motions in which it "
        "falls are left out",
    )
    parser.add_argument(
        "--check",
        type=Path,
        metavar="FILE",
        help="do forward kinematics again on this file and say what is wrong with it; exit code 1 "
        "where something is",
    )
    parser.add_argument("--format", metavar="FORMAT", help="of the file to check, if not found")
    parser.add_argument("--json", action="store_true", help="print the verdict as JSON")


def run(args: argparse.Namespace) -> int | None:
    """Export, or check."""
    if args.check is not None:
        if args.to is not None or args.library is not None:
            raise InvalidValueError("--check looks at a file: it takes no library and no --to")
        return _check(args)
    if args.to is None:
        raise InvalidValueError("give --to FORMAT, or --check FILE")
    _export(args)
    return None


def _export(args: argparse.Namespace) -> None:
    from mplearn_agents.terminal.console import open_console
    from mplearn_agents.terminal.progress import open_progress
    from mplearn_envs.export import RobotModel, export, format_of, perform
    from mplearn_envs.export.exporting import check_place

    format = format_of(args.to)
    if args.out is not None and args.clips > 1:  # before it takes its time
        check_place(format, args.out, args.clips)
    robot = _robot(args.robot)
    with open_progress(open_console(stderr=True)) as bar:
        task = bar.add_task("performing", total=None)
        done = perform(
            args.library,
            robot,
            [primitive_key(text) for text in args.path],
            walk=args.walk,
            clips=args.clips,
            seed=args.seed,
            speed=args.speed,
            simulated=args.simulate,
            upper_body=args.upper_body,
            show=lambda done, of: bar.update(task, completed=done, total=of),
        )
    for name, reason in done.left_out.items():
        print(f"left out {name}: {reason}")
    out = args.out or _place(args.library, done.motions[0].name, len(done.motions), format.suffix)
    written = export(done.motions, RobotModel.of(robot), format, out, rate_hz=args.rate)
    rate_hz = args.rate or format.rate_hz
    seconds = sum(motion.duration_s for motion in done.motions)
    noun = "motion" if len(done.motions) == 1 else "motions"
    print(
        f"{len(done.motions)} {noun} of {robot.name}, {seconds:.1f} s at {rate_hz:g} Hz, "
        f"written to {written[0] if len(written) == 1 else out}"
    )


def _place(library: Path | None, motion: str, n: int, suffix: str) -> Path:
    """Return what to write, where nobody says so."""
    from mplearn_envs.export.exporting import file_name

    stem = "builtin" if library is None else library.stem
    return Path(f"{file_name(motion)}{suffix}" if n == 1 else f"{stem}_motions")


def _check(args: argparse.Namespace) -> int:
    import json

    from mplearn_envs.export import RobotModel, check, format_of, robot_model

    format = None if args.format is None else format_of(args.format)
    if args.robot.lower().endswith(".xml"):
        model = robot_model(Path(args.robot))
    else:
        model = RobotModel.of(_robot(args.robot))
    verdicts = check(args.check, model, format)
    if args.json:
        print(json.dumps([verdict.plain() for verdict in verdicts], indent=2))
    else:
        for verdict in verdicts:
            _print(args.check, model.name, verdict)
    return 0 if all(verdict.in_order for verdict in verdicts) else NOT_IN_ORDER


def _print(path: Path, robot: str, verdict: Verdict) -> None:
    misfit = verdict.misfit
    of = "" if verdict.name.startswith(path.name) else f", {verdict.name}"
    print(
        f"{path.name}{of}: {verdict.format}, robot {robot}, {verdict.n_frames} frames "
        f"at {verdict.rate_hz:g} Hz"
    )
    if misfit.compared:
        degrees = math.degrees(misfit.angle_rad)
        print(
            f"  off by {_metres(misfit.position_m)} and {degrees:.3g} degrees at most, against "
            f"{' and '.join(misfit.compared)}"
            + (f" ({misfit.body}, frame {misfit.frame})" if not verdict.in_order else "")
        )
    for fault in verdict.faults:
        print(f"  wrong: {fault.problem}")
    if verdict.faults and misfit.compared:
        print(
            f"  without that, off by {_metres(verdict.left.position_m)} and "
            f"{math.degrees(verdict.left.angle_rad):.3g} degrees"
        )
    for problem in verdict.problems:
        print(f"  wrong: {problem}{', for no reason that is known' if verdict.faults else ''}")
    for note in verdict.notes:
        print(f"  note: {note}")
    if verdict.in_order:
        print("  in order")


def _metres(value: float) -> str:
    return f"{value:.2e} m" if value < 1e-4 else f"{value:.4g} m"


def _robot(name: str) -> Robot:
    from mplearn_envs.robot import make_robot

    return make_robot({"g1": "unitree_g1"}.get(name, name))
