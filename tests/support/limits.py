"""How long tests wait: enough for the busiest machine, since a limit costs nothing while all goes well."""

from __future__ import annotations

from typing import Final

__all__ = ["AT_ONCE", "CALL_LIMIT", "LIMIT"]

LIMIT: Final = 60.0
"""The longest wait in s for anything."""

AT_ONCE: Final = LIMIT / 2
"""What is to end by itself ends before this many s; a test gives what it must not wait for at least LIMIT."""

CALL_LIMIT: Final = 20.0
"""How many s a call may take, rather than the 2 s of every day."""
