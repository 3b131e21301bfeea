"""Attachments of calls, as a client makes them."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence

from zenoh_ice.data.wire import encode_attachment

__all__ = ["encode_call_attachment"]


def encode_call_attachment(
    fingerprint: str, number: int, client: str, timeout: float, given_up: Sequence[int] = ()
) -> bytes:
    """Return the encoded attachment of a call."""
    members = (fingerprint, number, math.nan, time.time(), f"{client}/{number}", timeout)
    return encode_attachment((*members, given_up) if given_up else members)
