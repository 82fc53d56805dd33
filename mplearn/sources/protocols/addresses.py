"""Addresses of sources: ``9750``, ``0.0.0.0:9750``, ``[::1]:9750``, ``qtm.lab``."""

from __future__ import annotations

import socket

from ...errors import InvalidValueError

LOOPBACK = "127.0.0.1"


def host_and_port(text: str, port: int, *, host: str = "") -> tuple[str, int]:
    """Return the host and the port that an address names.

    Args:
        text: ``HOST``, ``HOST:PORT``, ``[HOST]:PORT``, or ``PORT`` where a host is given; empty
            for what is usual.
        port: The usual port.
        host: The usual host; where there is none, an address must name one.

    Raises:
        InvalidValueError: It is no address.
    """
    name, given = text, ""
    if text.startswith("["):
        name, _, given = text[1:].partition("]")
        given = given.removeprefix(":")
    elif text.count(":") == 1:
        name, given = text.split(":")
    elif text.isdecimal() and host:
        name, given = "", text
    if given:
        if not given.isdecimal() or not given.isascii() or len(given) > 5 or int(given) > 65535:
            raise InvalidValueError(f"a port is a number up to 65535, not {given!r:.40}")
        port = int(given)
    name = name or host
    if not name:
        raise InvalidValueError(f"the address {text!r} must name a host, as in 192.168.0.2:{port}")
    return name, port


def bound(kind: socket.SocketKind, address: tuple[str, int]) -> socket.socket:
    """Return a socket that is bound to an address of this machine.

    Raises:
        InvalidValueError: The address is taken, or none of this machine.
    """
    try:
        family = socket.getaddrinfo(*address, type=kind)[0][0]
        bound = socket.socket(family, kind)
    except (OSError, UnicodeError) as error:
        raise InvalidValueError(f"{shown(address)} is no address: {error}") from None
    try:
        if kind is socket.SOCK_STREAM:
            bound.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        bound.bind(address)
    except OSError as error:
        bound.close()
        raise InvalidValueError(f"cannot listen at {shown(address)}: {error.strerror}") from None
    return bound


def shown(address: tuple[str, int]) -> str:
    """Return an address as text."""
    host, port = address[:2]
    return f"[{host}]:{port}" if ":" in host else f"{host}:{port}"
