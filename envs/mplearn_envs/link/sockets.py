"""The sockets of the link: UDP over IPv4 or IPv6, never waiting."""

from __future__ import annotations

import socket
from typing import Any

from mplearn.errors import InvalidValueError, MPLearnError

HOST, PORT = "127.0.0.1", 47810


class LinkError(MPLearnError, OSError):
    """The link's socket cannot be opened."""


def open_socket(host: str, port: int, *, listen: bool = False) -> tuple[socket.socket, Any]:
    """Return a UDP socket that never waits, and the address of a host as it takes it.

    Args:
        host: A name, or an address of IPv4 or IPv6.
        port: A port, 1 to 65535; to listen also 0, any free one.
        listen: Whether the address is this machine's, to be listened at.

    Raises:
        InvalidValueError: There is no such port.
        LinkError: There is no such host, nobody can listen there, or no way leads there.
    """
    least = 0 if listen else 1
    if not least <= port <= 65535:
        raise InvalidValueError(f"a UDP port is {least} to 65535, not {port}")
    what = f"cannot {'listen at' if listen else 'send to'} {host!r}, port {port}"
    try:
        family, _, _, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_DGRAM)[0]
    except (OSError, ValueError) as error:  # UnicodeError: a name that no host can have
        raise LinkError(f"{what}: there is no such host ({error})") from error
    found = socket.socket(family, socket.SOCK_DGRAM)
    found.setblocking(False)
    try:
        if listen:
            found.bind(address)
        else:
            with socket.socket(family, socket.SOCK_DGRAM) as probe:
                probe.connect(address)  # sends nothing, and fails where no way leads there
    except OSError as error:
        found.close()
        raise LinkError(f"{what}: {error}") from error
    return found, address
