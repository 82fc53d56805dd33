"""A page server in a thread of the tests, without the processes that learn and perform."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import uvicorn

from mplearn_agents.page.hub import Hub
from mplearn_agents.page.serve import listen, page_config
from mplearn_agents.page.server import make_app
from mplearn_agents.page.watching import Watch


@dataclass
class Served:
    """A server: where it is, and how to do something in its event loop."""

    url: str
    hub: Hub
    loop: asyncio.AbstractEventLoop

    @property
    def port(self) -> int:
        return int(self.url.rsplit(":", 1)[1].strip("/"))

    def hear(self, header: dict[str, Any], blob: bytes = b"") -> None:
        """Let the hub hear a message, as of a process."""
        self.call(lambda: self.hub.hear(header, blob))

    def call(self, act: Callable[[], Any]) -> Any:
        async def run() -> Any:
            return act()

        return asyncio.run_coroutine_threadsafe(run(), self.loop).result(5)


@contextmanager
def served(token: str = "", port: int = 0) -> Iterator[Served]:
    ready: threading.Event = threading.Event()
    found: dict[str, Any] = {}

    async def run() -> None:
        hub = Hub(Watch("demonstrator"), robot=True)
        listening = listen("127.0.0.1", port)
        server = uvicorn.Server(uvicorn.Config(make_app(hub, token=token), **page_config()))
        found.update(hub=hub, loop=asyncio.get_running_loop(), server=server)
        found["port"] = listening.getsockname()[1]
        serving = asyncio.create_task(server.serve(sockets=[listening]))
        while not server.started:
            await asyncio.sleep(0.01)
        ready.set()
        await serving

    thread = threading.Thread(target=lambda: asyncio.run(run()), name="page-server")
    thread.start()
    try:
        assert ready.wait(20)
        yield Served(f"http://127.0.0.1:{found['port']}/", found["hub"], found["loop"])
    finally:
        found["server"].should_exit = True
        thread.join(20)
        assert not thread.is_alive()
