"""How long tests wait for expected events: each limit is a promise for an idle machine, times one factor.

No run that passes comes near them, even on a busy machine: they end what would never end. `TEST_PATIENCE=2 pytest`,
on a machine that does nothing else, finds promises that are kept only because the limits are long.
"""

from __future__ import annotations

import os
from typing import Final

__all__ = [
    "CALL_LIMIT",
    "END_LIMIT",
    "EVENT_LIMIT",
    "FACTOR",
    "FOREVER",
    "LONGEST_CALL",
    "MOVE_LIMIT",
    "PAGE_LIMIT",
    "RUN_LIMIT",
    "SHORT_RUN",
    "START_LIMIT",
]

# Kept in the environment, so that all processes of a run have the same limits.
FACTOR: Final = float(os.environ.setdefault("TEST_PATIENCE", "20"))
"""How many times as long as on an idle machine everything may take."""

EVENT_LIMIT: Final = 1.0 * FACTOR
"""A thread, or a communicator on loopback, does or notices something within this many s."""

CALL_LIMIT: Final = 1.0 * FACTOR
"""A call ends, or the loss of a peer that hangs is noticed: `timeout` and `lease` of the settings."""

START_LIMIT: Final = 3.0 * FACTOR
"""A process of ours has started, or reacts to another one's start, end or restart."""

END_LIMIT: Final = 2.0 * FACTOR
"""A process ends after a signal, or when what it depends on has ended."""

RUN_LIMIT: Final = 6.0 * FACTOR
"""A short program has run from its start to its end."""

MOVE_LIMIT: Final = 5.0 * FACTOR
"""A robot has come to the pose or the place that it was sent to."""

PAGE_LIMIT: Final = 3.0 * FACTOR
"""The page shows, or the server of the editor answers, what was asked for."""

SHORT_RUN: Final = 0.1 * FACTOR
"""A behavior that runs for so many s begins its first cycles, and what they command begins to move."""

FOREVER: Final = 240.0
"""What no test waits for takes this many s: more than every limit, less than a test may take."""

LONGEST_CALL: Final = 60.0
"""The longest that the settings allow for `timeout` and `lease`, for calls that end for another reason."""
