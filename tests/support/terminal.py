"""The user's side of a terminal."""

from __future__ import annotations

import os
import select
import time

from tests.support.limits import START_LIMIT

__all__ = ["read_until"]


def read_until(terminal: int, text: str, before: str = "") -> str:
    """Read the further output of a terminal until a text appears."""
    output = before.encode()
    deadline = time.monotonic() + START_LIMIT
    while text.encode() not in output:
        ready, _, _ = select.select([terminal], [], [], max(0.0, deadline - time.monotonic()))
        assert ready, output.decode(errors="replace")
        try:
            output += os.read(terminal, 65536)
        except OSError:  # nobody writes to it any more
            raise AssertionError(output.decode(errors="replace")) from None
    return output.decode(errors="replace")
