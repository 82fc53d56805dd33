"""``mplearn generate``: the motion of a path or walk, as it was learned."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mplearn.errors import InvalidValueError
from mplearn_agents.terminal.arguments import count, positive, primitive_key, seed

if TYPE_CHECKING:
    from mplearn.generation.trajectory import Trajectory
    from mplearn.library import PrimitiveLibrary

HELP = "Generate the motion of a path or walk in the library's own channels, as it was shown."
EXAMPLE = "mplearn generate my.mplearn 'bow down' 'bow up' --to bow.csv"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare what the command takes."""
    from mplearn.generation import STYLES

    parser.add_argument("library", type=Path, help="library file")
    add_path_arguments(parser)
    parser.add_argument("--style", choices=list(STYLES), default="deterministic")
    parser.add_argument("--rate", type=positive, metavar="HZ", help="(default: the library's)")
    parser.add_argument("--speed", type=positive, default=1.0, help="share of the person's")
    parser.add_argument(
        "--to",
        type=Path,
        required=True,
        metavar="FILE",
        help="FILE.csv, FILE.npz, or FILE.bvh of the humanoid on the spot, to write",
    )


def add_path_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare which primitives: a path, or a walk."""
    parser.add_argument("path", nargs="*", metavar="PRIMITIVE", help="ids or names, in their order")
    parser.add_argument(
        "--goal", metavar="PRIMITIVE", help="go on from the last on the best path to this one"
    )
    parser.add_argument("--walk", type=count, metavar="N", help="a random walk of N primitives")
    parser.add_argument("--seed", type=seed, default=0, help="of the walk (default: 0)")


def chosen_path(args: argparse.Namespace, library: PrimitiveLibrary) -> list[Any]:
    """Return the primitives that were asked for, by id.

    Raises:
        InvalidValueError: None was, or both a path and a walk.
    """
    import numpy as np

    path = [library[_key(library, each)].id for each in args.path]
    if args.walk is not None:
        if args.goal is not None or len(path) > 1:
            raise InvalidValueError("--walk begins at one primitive at most, and takes no --goal")
        rng = np.random.default_rng(args.seed)
        return list(library.walk(path[0] if path else None, args.walk, rng))
    if not path:
        raise InvalidValueError("name primitives in their order, or give --walk N")
    if args.goal is not None:
        path += library.path(path[-1], library[_key(library, args.goal)].id)[1:]
    return path


def run(args: argparse.Namespace) -> None:
    """Generate and write."""
    import numpy as np

    from mplearn.library import PrimitiveLibrary
    from mplearn.writing import written_whole

    suffix = args.to.suffix.lower()
    if suffix not in _WRITERS:
        raise InvalidValueError(
            f"--to must be FILE.csv, FILE.npz or FILE.bvh, not {str(args.to)!r}"
        )
    library = PrimitiveLibrary.load(args.library)
    path = chosen_path(args, library)
    motion = library.generate(
        path,
        style=args.style,
        rate_hz=args.rate,
        speed=args.speed,
        rng=np.random.default_rng(args.seed),
    )
    args.to.parent.mkdir(parents=True, exist_ok=True)
    with written_whole(args.to) as file:
        _WRITERS[suffix](file, motion, library)
    noun = "primitive" if len(path) == 1 else "primitives"
    print(
        f"{len(path)} {noun}, {len(motion.frames)} frames at {motion.rate_hz:g} Hz, "
        f"{len(motion.frames) / motion.rate_hz:.1f} s, written to {args.to}"
    )


def _key(library: PrimitiveLibrary, text: str) -> int | str:
    return text if text in library else primitive_key(text)


def _write_npz(path: Path, motion: Trajectory, library: PrimitiveLibrary) -> None:
    import numpy as np

    with path.open("wb") as file:  # to a name in capitals numpy appends its own
        np.savez(
            file,
            frames=motion.frames,
            rate_hz=motion.rate_hz,
            channels=np.array(motion.channels),
            primitive_ids=motion.primitive_ids,
            starts=motion.starts,
        )


def _write_csv(path: Path, motion: Trajectory, library: PrimitiveLibrary) -> None:
    import csv

    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(("time_s", *motion.channels))
        for k, row in enumerate(motion.frames.tolist()):
            writer.writerow((round(k / motion.rate_hz, 9), *row))


def _write_bvh(path: Path, motion: Trajectory, library: PrimitiveLibrary) -> None:
    from mplearn_envs.export import RobotModel, as_shown, format_of
    from mplearn_envs.robot import humanoid

    shown = as_shown(motion, dict(zip(library.ids, library.names, strict=True)))
    format_of("bvh").write(path, [shown], RobotModel.of(humanoid()))


_WRITERS = {".csv": _write_csv, ".npz": _write_npz, ".bvh": _write_bvh}
