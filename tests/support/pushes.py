"""Collect what the services of the editor publish, and wait for it."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import TypeVar

from tests.support.limits import START_LIMIT

__all__ = ["Pushes"]


P = TypeVar("P")
T = TypeVar("T")


class Pushes:
    """A `Publish`, which may be called from any thread; create it on the event loop."""

    def __init__(self) -> None:
        self.all: list[object] = []
        self._loop = asyncio.get_running_loop()
        self._changed = asyncio.Event()

    def __call__(self, push: object) -> None:
        self.all.append(push)
        self._loop.call_soon_threadsafe(self._changed.set)

    def of(self, kind: type[P]) -> list[P]:
        """Return the pushes of a kind."""
        return [push for push in self.all if isinstance(push, kind)]

    async def until(self, find: Callable[[], T | None]) -> T:
        """Wait until a function finds something in the pushes, and return it."""
        async with asyncio.timeout(START_LIMIT):
            while not (found := find()):
                self._changed.clear()
                await self._changed.wait()
            return found

    async def next(self, kind: type[P], matches: Callable[[P], object]) -> P:
        """Wait for the next push of a kind."""
        seen = len(self.all)
        return await self.until(
            lambda: next((p for p in self.all[seen:] if isinstance(p, kind) and matches(p)), None)
        )
