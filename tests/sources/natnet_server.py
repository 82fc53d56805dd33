"""OptiTrack Motive as far as a client sees it, by unicast; NatNet 4.1."""

import socket
import struct
import threading
from collections.abc import Mapping, Sequence
from types import TracebackType
from typing import Self

from mplearn.recording import FloatArray

CONNECT, SERVER_INFO, REQUEST_MODELS, MODELS, FRAME, KEEP_ALIVE = 0, 1, 4, 5, 7, 10
VERSION = (4, 1, 0, 0)


def text(name: str) -> bytes:
    return name.encode() + b"\0"


def packet(kind: int, content: bytes) -> bytes:
    return struct.pack("<HH", kind, len(content)) + content


class NatNetServer:
    """Answers whoever asks, and sends frames to who asked last.

    Args:
        sets: Names of the markers of each marker set.
    """

    def __init__(self, sets: Mapping[str, Sequence[str]]) -> None:
        self.sets = dict(sets)
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind(("127.0.0.1", 0))
        self._socket.settimeout(0.05)
        self.name = f"natnet:127.0.0.1:{self._socket.getsockname()[1]}"
        self._client: tuple[str, int] | None = None
        self.asked = threading.Event()
        self._stop = threading.Event()
        self.silent = False
        self._thread = threading.Thread(target=self._serve)
        self._thread.start()

    def send(
        self, frame: Mapping[str, FloatArray], number: int, time_s: float, *, changed: bool = False
    ) -> None:
        """Send a frame: the places of the markers of each set, (M, 3) [m]."""
        if self._client is not None and not self.silent:
            self._socket.sendto(
                packet(FRAME, frame_content(frame, number, time_s, changed=changed)), self._client
            )

    def send_raw(self, data: bytes) -> None:
        """Send a packet as it is."""
        assert self._client is not None
        self._socket.sendto(data, self._client)

    def models(self) -> bytes:
        """Return the packet that says what is tracked."""
        return packet(MODELS, self._models())

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._stop.set()
        self._thread.join()
        self._socket.close()

    def _serve(self) -> None:
        while not self._stop.is_set():
            try:
                data, client = self._socket.recvfrom(4096)
            except TimeoutError:
                continue
            kind = struct.unpack_from("<H", data)[0]
            if self.silent:
                continue
            self._client = client
            if kind == CONNECT:
                content = b"Motive".ljust(256, b"\0") + bytes((3, 1, 0, 0)) + bytes(VERSION)
                content += struct.pack("<QHB4B", 10_000_000, 1511, 0, 0, 0, 0, 0)
                self._socket.sendto(packet(SERVER_INFO, content), client)
            elif kind == REQUEST_MODELS:
                self._socket.sendto(packet(MODELS, self._models()), client)
                self.asked.set()

    def _models(self) -> bytes:
        content = struct.pack("<I", len(self.sets) + 1)
        for name, markers in {**self.sets, "all": ["?"]}.items():
            one = text(name) + struct.pack("<I", len(markers)) + b"".join(map(text, markers))
            content += struct.pack("<II", 0, len(one)) + one
        return content


def frame_content(
    frame: Mapping[str, FloatArray], number: int, time_s: float, *, changed: bool = False
) -> bytes:
    """Return a frame of NatNet 4.1: marker sets, and nothing else."""
    sets = b""
    for name, places in {**frame, "all": next(iter(frame.values()))}.items():
        sets += text(name) + struct.pack("<I", len(places)) + places.astype("<f4").tobytes()
    content = struct.pack("<I", number) + struct.pack("<II", len(frame) + 1, len(sets)) + sets
    for _ in range(7):  # unlabelled markers, rigid bodies, skeletons, assets, markers, plates, ...
        content += struct.pack("<II", 0, 0)
    return content + struct.pack("<IIdQQQH", 0, 0, time_s, 0, 0, 0, 2 if changed else 0)
