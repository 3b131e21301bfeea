"""What the tests of the trials share: they may be coroutines."""

from __future__ import annotations

from tests.support.coroutines import loop, pytest_pyfunc_call

__all__ = ["loop", "pytest_pyfunc_call"]
