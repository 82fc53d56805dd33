"""Pulls a stream of the lab streaming layer in a process of its own, for liblsl may end a process.

``python lsl_process.py PROPERTY VALUE`` looks for the first stream of which that property has that
value, and writes to its standard output what comes of it: messages of a head, `HEAD`, and a body.
With a third word, ``attended``, it ends where its standard input does, wherever liblsl is then.
It is run as a file and imports nothing of mplearn, so that it is there at once.
"""

from __future__ import annotations

import os
import signal
import struct
import sys
import threading
import time
from typing import Any

HEAD = struct.Struct("<cI")  # kind, length of the body
DESCRIBED, SAMPLES, ALIVE, FAILED = b"D", b"S", b"A", b"F"  # what stream; frames; nothing; why
CHUNK = struct.Struct("<dI")  # when samples came, how many; then their times, then their values
SEARCH_S, WAKE_S, BUFFER_S = 1.0, 0.1, 60
AT_ONCE = 256  # samples


def main() -> None:
    """Pull until the stream is lost, or nobody reads any more."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # who reads is asked to stop, and ends this
    if not sys.flags.safe_path:
        del sys.path[0]  # the folder of this file, whose names are not those of modules
    if sys.argv[3:] == ["attended"]:
        threading.Thread(target=_attend, daemon=True).start()
    try:
        _pull(*sys.argv[1:3])
    except Exception as error:  # a client of others may raise anything
        _say(FAILED, (str(error) or repr(error)).encode("utf-8", "replace"))


def _pull(what: str, value: str) -> None:
    import numpy as np
    import pylsl

    found: list[Any] = []
    while not found:
        _say(ALIVE)
        found = pylsl.resolve_byprop(what, value, minimum=1, timeout=SEARCH_S)
    inlet = pylsl.StreamInlet(found[0], max_buflen=BUFFER_S, recover=False)
    try:
        _say(DESCRIBED, inlet.info(timeout=5.0).as_xml().encode("utf-8", "surrogateescape"))
        while True:
            chunk, stamps = inlet.pull_chunk(
                timeout=WAKE_S, max_samples=AT_ONCE, min_samples=1, as_numpy=True
            )
            arrived_s = time.monotonic()  # the same clock in all processes
            if not len(stamps):
                _say(ALIVE)
                continue
            numbers = np.concatenate(
                [np.asarray(stamps, "<f8"), np.asarray(chunk, "<f8").ravel()]
            ).tobytes()
            _say(SAMPLES, CHUNK.pack(arrived_s, len(stamps)) + numbers)
    finally:
        inlet.close_stream()


def _attend() -> None:
    """End this process when the one that started it ends, though liblsl may never return."""
    while os.read(0, 1 << 12):  # sys.stdin would be locked when Python ends, which aborts it
        pass
    os._exit(0)


def _say(kind: bytes, body: bytes = b"") -> None:
    try:
        sys.stdout.buffer.write(HEAD.pack(kind, len(body)) + body)
        sys.stdout.buffer.flush()
    except OSError:  # nobody reads any more; which error that is depends on the system
        os._exit(0)


if __name__ == "__main__":
    main()
