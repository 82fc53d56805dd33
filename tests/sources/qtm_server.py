"""Qualisys Track Manager as far as a client sees it: settings and frames of markers."""

import socket
import struct
import threading
from collections.abc import Sequence
from contextlib import suppress
from types import TracebackType
from typing import Self

import numpy as np

from mplearn.recording import FloatArray

COMMAND, XML, DATA, EVENT = 1, 2, 3, 6


class QTMServer:
    """Answers one client at a time.

    Args:
        names: Labels of the markers.
        rate_hz: Frames per second that the settings say.
        up: The vertical axis that they say.
    """

    def __init__(self, names: Sequence[str], rate_hz: float = 100.0, up: str = "+Z") -> None:
        self.names, self.rate_hz, self.up = list(names), rate_hz, up
        self._listening = socket.create_server(("127.0.0.1", 0))
        self._listening.settimeout(0.05)
        self.name = f"qtm:127.0.0.1:{self._listening.getsockname()[1]}"
        self._client: socket.socket | None = None
        self.streaming = threading.Event()
        self.deaf = False
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._serve)
        self._thread.start()

    def send(self, frame: FloatArray, number: int, time_s: float, more: int = 0) -> None:
        """Send a frame, shape (M, 3) [mm], which says that it has more markers than it has."""
        self._send(DATA, frame_content(frame, number, time_s, more))

    def send_raw(self, data: bytes) -> None:
        """Send bytes as they are, if somebody listens."""
        if (client := self._client) is not None:
            with suppress(OSError):  # who has left
                client.sendall(data)

    def relabel(self, names: Sequence[str]) -> None:
        """Change the labels, and say that the settings changed."""
        self.names = list(names)
        self._send(EVENT, bytes([11]))

    def drop(self) -> None:
        """Close the connection."""
        self.streaming.clear()
        client, self._client = self._client, None
        if client is not None:
            with suppress(OSError):  # the other end may be gone
                client.shutdown(socket.SHUT_RDWR)
            client.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._stop.set()
        self.drop()
        self._thread.join()
        self._listening.close()

    def _send(self, kind: int, content: bytes) -> None:
        if self._client is not None:
            self._client.sendall(packet(kind, content))

    def _serve(self) -> None:
        while not self._stop.is_set():
            try:
                client, _ = self._listening.accept()
            except TimeoutError:
                continue
            client.settimeout(0.05)
            self.streaming.clear()
            self._client = client
            self._send(COMMAND, b"QTM RT Interface connected\0")
            self._answer(client)
            client.close()

    def _answer(self, client: socket.socket) -> None:
        data = b""
        while not self._stop.is_set() and self._client is client:
            try:
                more = client.recv(4096)
            except TimeoutError:
                continue
            except OSError:
                return
            if not more:
                return
            data += more
            while len(data) >= 8 and len(data) >= struct.unpack_from("<I", data)[0]:
                size = struct.unpack_from("<I", data)[0]
                command, data = data[8:size].rstrip(b"\0").decode(), data[size:]
                if not self.deaf:
                    self._do(command)

    def _do(self, command: str) -> None:
        if command.startswith("version"):
            self._send(COMMAND, f"Version set to {command[8:]}\0".encode())
        elif command == "getparameters general 3d":
            labels = "".join(f"<Label><Name>{name}</Name></Label>" for name in self.names)
            xml = (
                f"<QTM_Parameters_Ver_1.25><General><Frequency>{self.rate_hz}</Frequency></General>"
                f"<The_3D><AxisUpwards>{self.up}</AxisUpwards><Labels>{len(self.names)}</Labels>"
                f"{labels}</The_3D></QTM_Parameters_Ver_1.25>"
            )
            self._send(XML, xml.encode() + b"\0")
        elif command == "streamframes allframes 3d":
            self.streaming.set()
        else:
            raise AssertionError(command)


def frame_content(frame: FloatArray, number: int, time_s: float, more: int = 0) -> bytes:
    """Return a frame as the protocol has it, which says that it has more markers than it has."""
    component = struct.pack("<Ihh", len(frame) + more, 0, 0) + frame.astype("<f4").tobytes()
    component = struct.pack("<II", len(component) + 8, 1) + component
    return struct.pack("<qII", round(time_s * 1e6), number, 1) + component


def packet(kind: int, content: bytes) -> bytes:
    """Return a packet of a kind."""
    return struct.pack("<II", len(content) + 8, kind) + content


def as_sent(markers: FloatArray) -> FloatArray:
    """Return what a file of the same frames holds, shape (T, 3 M) [m]."""
    sent = (markers * 1000.0).astype("<f4").astype(np.float64)
    return (sent * 0.001).reshape(len(markers), -1)
