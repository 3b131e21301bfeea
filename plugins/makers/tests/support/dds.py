"""Domains of DDS for tests, each for one process of the machine."""

from __future__ import annotations

import os
import socket
import tempfile
from contextlib import suppress
from pathlib import Path
from typing import Final

from tests.support.ports import Ports

__all__ = ["domain_ports", "free_domain"]

_FIRST, _STEP = 7400, 250
_DOMAINS: Final = range(10, 101)
"""Their ports end below 32768, from where on Linux gives ports to whoever asks for any."""


def domain_ports(domain: int) -> range:
    """Return the UDP ports of a domain (DDSI-RTPS 2.5, 9.6.2.3)."""
    return range(_FIRST + _STEP * domain, _FIRST + _STEP * (domain + 1))


_PORTS: Final = Ports(
    (domain_ports(domain)[0] for domain in _DOMAINS),
    Path(tempfile.gettempdir(), f"visualhfsm-test-domains-{os.getuid()}"),
)


def free_domain() -> int:
    """Return a domain in which nobody listens on this machine, reserved for this process."""
    while True:
        port = _PORTS.take()
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe, suppress(OSError):
            probe.bind(("", port))
            return (port - _FIRST) // _STEP
