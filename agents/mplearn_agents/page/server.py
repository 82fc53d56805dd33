"""The page server: files of the page, and a socket for each page that looks on.

Nothing is loaded from elsewhere, nothing runs but the page's own modules (content security policy).
Who may look on: at loopback addresses who reaches them by a loopback name; elsewhere who has the
token, which the first visit turns into a cookie. A socket is opened by pages of this server only.
"""

from __future__ import annotations

import asyncio
import hmac
from collections.abc import Awaitable, Callable
from contextlib import suppress
from importlib.resources import files
from ipaddress import ip_address
from urllib.parse import urlsplit

from starlette.applications import Starlette
from starlette.middleware import Middleware
from starlette.requests import HTTPConnection, Request
from starlette.responses import PlainTextResponse, RedirectResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from starlette.websockets import WebSocket, WebSocketDisconnect

from .hub import TICK_S, Client, Hub

_BETWEEN_REQUESTS_S = 0.02
_MOST_CLIENTS = 200
_TYPES = {
    "html": "text/html; charset=utf-8",
    "css": "text/css; charset=utf-8",
    "js": "text/javascript; charset=utf-8",
    "svg": "image/svg+xml",
}
_HEADERS = {
    "Content-Security-Policy": (
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; "
        "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    ),
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cache-Control": "no-cache",
}
_REFUSED = 4403  # code with which a socket is closed


def make_app(hub: Hub, *, token: str = "") -> Starlette:
    """Return the application.

    Args:
        hub: What the page shows.
        token: Needed to look on; where empty, loopback names are needed.
    """
    guard = Guard(token)
    folder = files(__package__).joinpath("static")
    pages = {path.name: path.read_bytes() for path in folder.iterdir()}

    def page(request: Request) -> Response:
        name = request.path_params.get("name", "index.html")
        if name not in pages:
            return PlainTextResponse("there is no such page", 404)
        if not guard.allows(request):
            return _admitted(request, guard)
        return Response(pages[name], media_type=_TYPES[name.rpartition(".")[2]])

    async def socket(websocket: WebSocket) -> None:
        if not guard.allows(websocket) or not _same_origin(websocket):
            await websocket.close(_REFUSED)
            return
        if len(hub.clients) >= _MOST_CLIENTS:
            await websocket.close(1013)
            return
        await websocket.accept()
        client = hub.enter()
        sending = asyncio.create_task(_send(websocket, hub, client))
        try:
            while (text := await _asked(websocket)) is not None:
                hub.ask(client, text)
                await asyncio.sleep(_BETWEEN_REQUESTS_S)
        finally:
            hub.leave(client)
            sending.cancel()
            with suppress(asyncio.CancelledError):
                await sending

    return Starlette(
        routes=[
            Route("/", page),
            WebSocketRoute("/socket", socket),
            Route("/{name}", page),
        ],
        middleware=[Middleware(_SafeHeaders)],
    )


async def _asked(websocket: WebSocket) -> str | None:
    """Return the next request; None where the page is gone, or sent what no page of ours does."""
    try:
        return await websocket.receive_text()
    except (WebSocketDisconnect, RuntimeError, KeyError):  # RuntimeError: who sends has found out
        return None  # KeyError: it sent bytes


async def _send(websocket: WebSocket, hub: Hub, client: Client) -> None:
    """Send what there is, at most so often as a page can draw it, as fast as it reads."""
    loop = asyncio.get_running_loop()
    try:
        while True:
            began = loop.time()
            client.changed.clear()
            for message in client.take():
                if isinstance(message, str):
                    await websocket.send_text(message)
                else:
                    await websocket.send_bytes(message)
            await websocket.send_bytes(hub.tick(client))
            await asyncio.sleep(max(0.0, began + TICK_S - loop.time()))
            await client.changed.wait()
    except (WebSocketDisconnect, RuntimeError):  # it is gone
        return


class Guard:
    """Says who may look on.

    Args:
        token: What they must know; where empty, they must come by a loopback name.
    """

    def __init__(self, token: str) -> None:
        self.token = token

    def allows(self, connection: HTTPConnection) -> bool:
        """Whether a request, or a socket, is of somebody who may look on."""
        if not self.token:
            return is_loopback(_host(connection))
        return self.knows(connection.cookies.get(cookie_name(connection), ""))

    def knows(self, token: str) -> bool:
        """Whether this is the token."""
        return hmac.compare_digest(token.encode(), self.token.encode())


def _admitted(request: Request, guard: Guard) -> Response:
    """Return what somebody gets who has no cookie yet."""
    given = request.query_params.get("token", "")
    if guard.token and guard.knows(given):
        response = RedirectResponse("/", 303)
        name = cookie_name(request)
        response.set_cookie(name, given, httponly=True, samesite="strict", path="/")
        return response
    return PlainTextResponse(
        "This page needs the token that was printed when it was started."
        if guard.token
        else "This page answers to loopback names only, such as localhost.",
        403,
    )


def cookie_name(connection: HTTPConnection) -> str:
    """Return the name of the cookie: servers at other ports have others."""
    return f"mplearn-{connection.url.port or 80}"


def is_loopback(host: str) -> bool:
    """Whether a name or address is one of this machine's own, without asking anybody.

    >>> is_loopback("localhost"), is_loopback("127.0.0.1"), is_loopback("::1"), is_loopback("a.b")
    (True, True, True, False)
    """
    if host.lower().rstrip(".") == "localhost":
        return True
    try:
        return ip_address(host).is_loopback
    except ValueError:
        return False


def _host(connection: HTTPConnection) -> str:
    """Return the name by which the server was reached."""
    try:
        return urlsplit(f"//{connection.headers.get('host', '')}").hostname or ""
    except ValueError:
        return ""


def _same_origin(websocket: WebSocket) -> bool:
    """Whether a socket is opened by a page of this server."""
    origin, host = websocket.headers.get("origin", ""), websocket.headers.get("host", "")
    try:
        parts = urlsplit(origin)
    except ValueError:
        return False
    return parts.scheme in ("http", "https") and bool(host) and parts.netloc == host


class _SafeHeaders:
    """Adds the headers that keep a page to itself."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        async def safe(message: Message) -> None:
            if message["type"] == "http.response.start":
                own = [(k.lower().encode(), v.encode()) for k, v in _HEADERS.items()]
                message["headers"] = [*message["headers"], *own]
            await send(message)

        call: Callable[[Message], Awaitable[None]] = safe
        await self._app(scope, receive, call if scope["type"] == "http" else send)
