"""Two processes perform a path of primitives: ``python -m mplearn_envs.link both``.

``lower`` is the lower body's process, with the simulated robot; start it first. ``upper`` generates
the path, tracks the upper body and sends. ``both`` starts both on this machine. All numbers of the
link are printed at the end. ``attacks`` lets the simulated robot stand under all that a mad or
hostile upper body may send, and prints a table.

Exit codes: 0 done, 2 bad input, 130 interrupted; ``attacks``: 1 where the robot fell.
"""

from __future__ import annotations

import argparse
import math
import subprocess
import sys
from functools import partial
from pathlib import Path

from mplearn.errors import InvalidValueError, MPLearnError
from mplearn_envs.robot import ROBOTS, make_robot

from .attacks import ATTACKS, report_line, under_attack
from .datagram import read_key
from .disturbance import Disturbance
from .run import PATH, run_lower, run_upper
from .sockets import HOST, PORT

_READY = "listening"


def main(arguments: list[str] | None = None) -> int:
    """Run one of the processes, or both; returns the exit status."""
    parser = argparse.ArgumentParser(
        prog="python -m mplearn_envs.link", description=__doc__, formatter_class=_Formatter
    )
    parser.add_argument("role", choices=("upper", "lower", "both", "attacks"))
    parser.add_argument("--host", default=HOST, help="the lower body's address, IPv4 or IPv6")
    parser.add_argument("--port", type=int, default=PORT, help="its UDP port")
    parser.add_argument("--key", type=Path, metavar="FILE", help="a secret that both ends share")
    parser.add_argument("--robot", choices=tuple(ROBOTS), default="humanoid")
    parser.add_argument("--path", nargs="+", default=PATH, help="primitives, by name")
    parser.add_argument("--speed", type=float, default=0.5, help="share of the human's")
    parser.add_argument(
        "--seconds",
        type=float,
        default=None,
        help="when lower, or each attack, stops at the latest",
    )
    for name in vars(Disturbance()):
        parser.add_argument(f"--{name}", type=float, default=0.0, help="share of the datagrams")
    parser.add_argument("--seed", type=int, default=0, help="of the disturbance or attacks")
    options = parser.parse_args(arguments)
    try:
        return _run(options, sys.argv[1:] if arguments is None else arguments)
    except MPLearnError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        return 130


def _run(options: argparse.Namespace, arguments: list[str]) -> int:
    if options.seed < 0:
        raise InvalidValueError(f"a seed is 0 or more, not {options.seed}")
    key = None if options.key is None else read_key(options.key)
    if options.role == "lower":
        ready = partial(print, _READY, flush=True)
        report = run_lower(
            options.robot, options.host, options.port, options.seconds, ready, key=key
        )
        print(report.table())
        return 0
    if options.role == "upper":
        disturbance = Disturbance(**{name: getattr(options, name) for name in vars(Disturbance())})
        run_upper(
            options.robot,
            options.path,
            options.host,
            options.port,
            options.speed,
            disturbance,
            options.seed,
            key,
        )
        return 0
    if options.role == "both":
        return _both(arguments)
    seconds = 8.0 if options.seconds is None else options.seconds
    if not 0 < seconds < math.inf:
        raise InvalidValueError(f"--seconds must be positive, not {seconds}")
    robot, fell = make_robot(options.robot), False
    print(report_line("attack"))
    for name, attack in ATTACKS.items():
        stood = under_attack(robot, attack, seconds, options.seed)
        print(report_line(name, stood), flush=True)
        fell = fell or stood.fallen
    return int(fell)


def _both(arguments: list[str]) -> int:
    command = [sys.executable, "-m", "mplearn_envs.link"]
    rest = [word for word in arguments if word != "both"]
    with subprocess.Popen([*command, "lower", *rest], stdout=subprocess.PIPE, text=True) as lower:
        assert lower.stdout is not None
        line = lower.stdout.readline()
        if line.strip() != _READY:  # it could not begin, and has said why
            return lower.wait() or 1
        upper = subprocess.run([*command, "upper", *rest], check=False)
        if upper.returncode:
            lower.terminate()
            return upper.returncode
        print(lower.stdout.read(), end="")
    return lower.returncode


class _Formatter(argparse.ArgumentDefaultsHelpFormatter, argparse.RawDescriptionHelpFormatter):
    """Keep the text's lines, and show defaults."""


if __name__ == "__main__":
    sys.exit(main())
