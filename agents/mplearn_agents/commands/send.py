"""``mplearn send``: a recording, or any source, over a network."""

from __future__ import annotations

import argparse

from mplearn.errors import InvalidValueError
from mplearn_agents.terminal.arguments import pace

HELP = "Send a recording over a network, at its own pace, for another program to learn live."
EXAMPLE = "mplearn send session.c3d --to udp:127.0.0.1:5005"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare what the command takes."""
    parser.add_argument("data", help="a recording; or demonstrator, or another source")
    parser.add_argument(
        "--to",
        required=True,
        metavar="WHERE",
        help="udp:HOST:PORT, ndjson:HOST:PORT (TCP), ndjson:- (standard output) or lsl:NAME",
    )
    parser.add_argument("--speed", type=pace, help="times as fast as it was recorded (default: 1)")
    parser.add_argument("--take", help="which take of a folder")
    parser.add_argument(
        "--observe",
        choices=["positions", "channels"],
        default="positions",
        help="what is sent: where markers and joints are (default), or the file's own channels",
    )


def run(args: argparse.Namespace) -> None:
    """Send it all."""
    from mplearn.mocap import Hints
    from mplearn.sources import Wanted, connect, source_kinds
    from mplearn.sources.sending import open_sender, send
    from mplearn_agents.terminal.interrupts import asked_to_stop

    kind = args.data.partition(":")[0]
    name = args.data if kind in source_kinds() else f"recording:{args.data}"
    options = {"speed": args.speed, "take": args.take}
    given = {key: value for key, value in options.items() if value is not None}
    wanted = Wanted("robot" if args.observe == "positions" else "channels", Hints())
    with (
        asked_to_stop() as stop,
        connect(name, wanted, **given) as source,
        open_sender(args.to) as sender,
    ):
        try:
            n = send(source, sender, stop)
        except (BrokenPipeError, ConnectionResetError):
            raise InvalidValueError(f"{args.to} was closed by whoever listens") from None
    if args.to != "ndjson:-":
        print(f"{n} frames sent to {args.to}")
