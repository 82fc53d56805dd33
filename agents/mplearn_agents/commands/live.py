"""``mplearn live``: learn from live motion, and look on."""

from __future__ import annotations

import argparse
from pathlib import Path

from mplearn.extras import require
from mplearn_agents.terminal.arguments import pace, port
from mplearn_agents.terminal.inert import printable

HELP = "Learn from live motion, and show it all on a page in the browser."
EXAMPLE = "mplearn live demonstrator --port 8765"
_TOLD_S = 1.0  # of the stream, that were not learned


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare what the command takes."""
    parser.add_argument(
        "source",
        nargs="?",
        default="demonstrator",
        help="where motion comes from: demonstrator (default), recording:FILE, lsl:NAME, ...",
    )
    parser.add_argument(
        "--store",
        type=Path,
        metavar="FILE",
        help="keep all that is learned in this file, and go on from it the next time",
    )
    parser.add_argument("--speed", type=pace, help="times as fast, of a source that is played")
    parser.add_argument(
        "--observe",
        choices=["robot", "positions", "channels"],
        default="robot",
        help="what is learned, see `mplearn learn`",
    )
    parser.add_argument(
        "--host", default="127.0.0.1", help="address to be reached at (default: this machine only)"
    )
    parser.add_argument("--port", type=port, default=8765, help="port, 0 for any (default: 8765)")
    parser.add_argument(
        "--token", default="", help="what others must know to look on; made up where needed"
    )
    parser.add_argument("--no-robot", action="store_true", help="do not simulate the robot")


def run(args: argparse.Namespace) -> None:
    """Serve the page until it is interrupted."""
    for module in ("starlette", "uvicorn", "websockets"):
        require(module, "ui")
    from mplearn_agents.page.serve import serve
    from mplearn_agents.page.watching import Watch

    if args.store is not None:
        args.store.parent.mkdir(parents=True, exist_ok=True)

    def ready(url: str) -> None:
        print(f"open {printable(url)}   (Ctrl-C ends it)", flush=True)

    left_s = serve(
        Watch(args.source, args.observe, args.speed, str(args.store or "")),
        host=args.host,
        port=args.port,
        token=args.token,
        robot=not args.no_robot,
        ready=ready,
    )
    if left_s >= _TOLD_S:
        print(f"the last {left_s:.0f} s of the stream still waited, and were not learned")
