"""Limits of waits in tests: long enough for a very busy machine, as they cost nothing when all is well."""

from __future__ import annotations

from typing import Final

__all__ = ["AT_ONCE", "CALL_LIMIT", "LIMIT"]

LIMIT: Final = 60.0
"""The longest wait in s."""

AT_ONCE: Final = LIMIT / 2
"""The limit in s for what must end by itself; what a test must not wait for takes at least LIMIT."""

CALL_LIMIT: Final = 20.0
"""The limit of a call in s, instead of the default of 2 s."""
