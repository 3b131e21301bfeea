"""Tests that are coroutines, and what their fixtures do in the same loop; a conftest.py imports both names."""

from __future__ import annotations

import asyncio
import inspect
from collections.abc import Coroutine, Iterator
from contextlib import AbstractAsyncContextManager, AsyncExitStack
from typing import TypeVar

import pytest

from tests.support.limits import RUN_LIMIT

__all__ = ["Loop", "loop", "pytest_pyfunc_call"]

T = TypeVar("T")


class Loop:
    """The loop of a test, which ends what was entered in it."""

    def __init__(self) -> None:
        self._runner = asyncio.Runner()
        self._entered = AsyncExitStack()

    def run(self, coroutine: Coroutine[object, object, T]) -> T:
        """Run a coroutine to its end."""
        return self._runner.run(asyncio.wait_for(coroutine, RUN_LIMIT))

    def enter(self, context: AbstractAsyncContextManager[T]) -> T:
        """Enter a context, which is left after the test."""
        return self.run(self._entered.enter_async_context(context))

    def close(self) -> None:
        """Leave all contexts."""
        with self._runner:
            self.run(self._entered.aclose())


@pytest.fixture
def loop() -> Iterator[Loop]:
    """The loop in which the test runs, if it is a coroutine."""
    made = Loop()
    yield made
    made.close()


@pytest.hookimpl(tryfirst=True)
def pytest_pyfunc_call(pyfuncitem: pytest.Function) -> object:
    """Run a test that is a coroutine, in the loop of its fixtures."""
    if not inspect.iscoroutinefunction(pyfuncitem.obj):
        return None
    arguments = {name: pyfuncitem.funcargs[name] for name in inspect.signature(pyfuncitem.obj).parameters}
    its_loop = pyfuncitem.funcargs.get("loop")
    assert isinstance(its_loop, Loop), "it needs the fixture `loop`, or one that enters something there"
    its_loop.run(pyfuncitem.obj(**arguments))
    return True
