"""``mplearn live``, from its options to its end."""

from __future__ import annotations

import asyncio
import secrets
import socket
from collections.abc import Callable
from contextlib import nullcontext, suppress
from typing import Any

from mplearn.errors import InvalidValueError
from mplearn.extras import require
from mplearn_agents.terminal.interrupts import asked_in_loop

from .hub import Hub
from .messages import LONGEST_REQUEST
from .server import is_loopback, make_app
from .watching import Watch


def serve(
    settings: Watch,
    *,
    host: str = "127.0.0.1",
    port: int = 8765,
    token: str = "",
    robot: bool = True,
    ready: Callable[[str], None] = lambda url: None,
) -> float:
    """Serve the page until it is interrupted; return how much of the stream was left unlearned [s].

    Args:
        settings: What is watched.
        host: Address to be reached at; beyond loopback a token is needed, and made up where none is
            given.
        port: Port; 0 takes one that is free.
        token: Needed to look on; where empty, loopback is open to who is on this machine.
        robot: Whether a robot performs.
        ready: Called with the page's address when it can be opened, and the source is open.

    Raises:
        InvalidValueError: Host or port cannot be had.
        MPLearnError: The source cannot be opened.
    """
    if not is_loopback(host) and not token:
        token = secrets.token_urlsafe(24)
    listening = listen(host, port)
    url = _address(host, listening.getsockname()[1], token)
    left_s: list[float] = []
    with listening, suppress(KeyboardInterrupt):
        asyncio.run(_serve(settings, listening, token, robot, lambda: ready(url), left_s))
    return sum(left_s)


async def _serve(
    settings: Watch,
    listening: socket.socket,
    token: str,
    robot: bool,
    ready: Callable[[], None],
    left_s: list[float],
) -> None:
    uvicorn = require("uvicorn", "ui")
    hub = Hub(settings, robot=robot)
    server = uvicorn.Server(uvicorn.Config(make_app(hub, token=token), **page_config()))
    server.capture_signals = nullcontext  # they come here
    with asked_in_loop() as asked:
        hub.start()
        serving = asyncio.create_task(server.serve(sockets=[listening]))
        ends = (serving, hub.failed, asked)
        try:
            await asyncio.wait((*ends, hub.begun), return_when=asyncio.FIRST_COMPLETED)
            if not any(end.done() for end in ends):
                ready()
                await asyncio.wait(ends, return_when=asyncio.FIRST_COMPLETED)
            if hub.failed.done():
                raise InvalidValueError(hub.failed.result())
        finally:
            server.should_exit = True
            await hub.close()
            left_s.append(hub.behind_s)
            await serving


def page_config() -> dict[str, Any]:
    """Return how the server runs: quiet, with small messages in, and none compressed."""
    return {
        "log_level": "error",
        "access_log": False,
        "lifespan": "off",
        "proxy_headers": False,
        "server_header": False,
        "ws": "websockets-sansio",
        "ws_max_size": 2 * LONGEST_REQUEST,
        "ws_per_message_deflate": False,
        "timeout_graceful_shutdown": 2,
    }


def listen(host: str, port: int) -> socket.socket:
    """Return a socket that listens there.

    Raises:
        InvalidValueError: It cannot be had.
    """
    if not 0 <= port <= 65_535:
        raise InvalidValueError(f"a port lies in [0, 65535], not {port}")
    listening = None
    try:
        kind, _, _, _, address = socket.getaddrinfo(
            host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
        )[0]
        listening = socket.socket(kind, socket.SOCK_STREAM)
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listening.bind(address)
        listening.listen(128)
    except OSError as error:
        if listening is not None:
            listening.close()
        raise InvalidValueError(f"cannot listen at {host} port {port}: {error.strerror}") from error
    return listening


def _address(host: str, port: int, token: str) -> str:
    """Return what to open in a browser."""
    name = {"0.0.0.0": socket.gethostname(), "::": socket.gethostname()}.get(host, host)
    shown = f"[{name}]" if ":" in name else name
    return f"http://{shown}:{port}/" + (f"?token={token}" if token else "")
