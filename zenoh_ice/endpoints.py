"""Endpoints, such as `tcp/127.0.0.1:7447`: what they are made of, and whom they let in."""

from __future__ import annotations

import ipaddress
import re
from typing import Final, NamedTuple

__all__ = ["PROTOCOLS", "Protocol", "check_endpoint", "host_and_port", "is_loopback", "protocol"]


class Protocol(NamedTuple):
    """A way in which two sessions are linked."""

    name: str
    by_network: bool = True
    """Whether the address is a host and a port, rather than a file."""
    uses_tls: bool = False
    """Whether both sides can know each other, and nobody else reads what they say."""


PROTOCOLS: Final = {
    known.name: known
    for known in (
        Protocol("tcp"),
        Protocol("tls", uses_tls=True),
        Protocol("udp"),
        Protocol("quic", uses_tls=True),
        Protocol("ws"),
        Protocol("unixsock-stream", by_network=False),
    )
}

_HOST_AND_PORT: Final = re.compile(r"(\[[0-9A-Fa-f:.%]+\]|[A-Za-z0-9_.\-]+):([0-9]{1,5})")
_LONGEST_SOCKET_PATH: Final = 107  # bytes, in Linux


def protocol(endpoint: str) -> Protocol:
    """Return the protocol of an endpoint that was checked."""
    return PROTOCOLS[endpoint.partition("/")[0]]


def host_and_port(endpoint: str) -> tuple[str, int] | None:
    """Return where an endpoint that was checked leads to; None for a file."""
    match = _HOST_AND_PORT.fullmatch(_address(endpoint))
    if match is None or not protocol(endpoint).by_network:
        return None
    return match[1].strip("[]"), int(match[2])


def is_loopback(endpoint: str) -> bool:
    """Return whether an endpoint that was checked is reached from its own machine alone."""
    place = host_and_port(endpoint)
    if place is None:
        return True
    host = place[0]
    try:
        return ipaddress.ip_address(host.partition("%")[0]).is_loopback
    except ValueError:
        return host.lower() == "localhost"


def check_endpoint(endpoint: object, *, any_port: bool) -> str:
    """Return an endpoint; raises ValueError, with what to do, for what is none."""
    if not isinstance(endpoint, str):
        raise ValueError("write endpoints as text, such as tcp/127.0.0.1:7447")
    name, slash, _ = endpoint.partition("/")
    address = _address(endpoint)
    if not slash or name not in PROTOCOLS:
        raise ValueError(
            f"{endpoint!r} is no endpoint: write PROTOCOL/ADDRESS, such as tcp/127.0.0.1:7447, with one of "
            f"{', '.join(PROTOCOLS)}"
        )
    if not PROTOCOLS[name].by_network:
        if not address:
            raise ValueError(f"{endpoint!r} has no path: write {name}/PATH")
        if len(address.encode()) > _LONGEST_SOCKET_PATH:
            raise ValueError(
                f"the path of {endpoint!r} is longer than the {_LONGEST_SOCKET_PATH} bytes of a socket's"
            )
        return endpoint
    match = _HOST_AND_PORT.fullmatch(address)
    if match is None:
        raise ValueError(f"{endpoint!r} needs a host and a port: write {name}/HOST:PORT")
    lowest = 0 if any_port else 1
    if not lowest <= int(match[2]) <= 65535:
        raise ValueError(f"port {match[2]} of {endpoint!r} is not between {lowest} and 65535")
    return endpoint


def _address(endpoint: str) -> str:
    return re.split(r"[?#]", endpoint.partition("/")[2], maxsplit=1)[0]
