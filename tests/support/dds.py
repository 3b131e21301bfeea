"""Domains of DDS for tests."""

from __future__ import annotations

import secrets
import socket
from contextlib import suppress

__all__ = ["free_domain"]


def free_domain() -> int:
    """Return a domain in which nobody listens on this machine."""
    while True:
        domain = 100 + secrets.randbelow(100)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe, suppress(OSError):
            probe.bind(("", 7400 + 250 * domain))
            return domain
