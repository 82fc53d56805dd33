"""``python -m mplearn_envs.experiments``: long experiments, which go on where they were stopped.

soak FILE    random walks in bodies of each level; each episode is kept in FILE
falls FILES  what makes the robot fall, fitted to them; --write puts it into the package
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path

from mplearn_envs.execution.bodies import BODIES
from mplearn_envs.execution.risk import PATH, STRAINS

from .falls import falls_table, fit, fit_spread, of_levels
from .soak import read_soak, soak, table_of


def main(argv: Sequence[str] | None = None) -> int:
    """Perform an experiment, and print its table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    kinds = parser.add_subparsers(required=True)
    soaking = kinds.add_parser("soak", help="random walks in bodies of each level")
    soaking.add_argument("file", type=Path, help="where episodes are kept, one a line")
    soaking.add_argument("--steps", type=int, default=20_000, help="macro steps a level")
    soaking.add_argument("--levels", nargs="+", default=list(BODIES), choices=list(BODIES))
    soaking.add_argument("--env", choices=["v0", "v1"], default="v1")
    soaking.add_argument("--speeds", nargs="+", type=float, default=[1.0])
    soaking.add_argument("--seed", type=int, default=0)
    soaking.set_defaults(run=_soak)
    falling = kinds.add_parser("falls", help="what makes the robot fall")
    falling.add_argument("files", type=Path, nargs="+", help="what soak has kept")
    falling.add_argument("--write", action="store_true", help="write it into the package")
    falling.set_defaults(run=_falls)
    args = parser.parse_args(argv)
    args.run(args)
    return 0


def _soak(args: argparse.Namespace) -> None:
    options = {"env": args.env, "speeds": args.speeds}
    print(table_of(soak(args.steps, args.levels, args.seed, args.file, **options)).to_markdown())


def _falls(args: argparse.Namespace) -> None:
    of_level = of_levels(each for file in args.files for each in read_soak(file))
    print(falls_table(of_level).to_markdown())
    if args.write:
        spread = {level: round(fit_spread(of), 4) for level, of in of_level.items()}
        kept = {
            "strains": STRAINS,
            "weights": {
                level: fit(of, spread[level]).round(4).tolist() for level, of in of_level.items()
            },
            "spread": spread,
            "steps": {level: len(of.fallen) for level, of in of_level.items()},
            "falls": {level: int(of.fallen.sum()) for level, of in of_level.items()},
        }
        PATH.write_text(json.dumps(kept, indent=1) + "\n", "utf-8")


if __name__ == "__main__":
    sys.exit(main())
