"""Ask a service of the editor for several things at once, in a random order, also with children of no process."""

from __future__ import annotations

import asyncio
import contextlib
import random
from collections import Counter
from collections.abc import Awaitable, Callable, Iterable, Mapping, Sequence
from typing import TypeVar

from tests.support.limits import RUN_LIMIT
from visualhfsm._base.errors import VisualHfsmError

__all__ = ["Nursery", "interleave"]

T = TypeVar("T")

DELAYS = (0.0, 0.0, 0.02)
"""In s: of a turn of the event loop, mostly, or of a thread that reads a file."""


async def interleave(
    chance: random.Random,
    requests: Iterable[Callable[[], Awaitable[object]]],
    delays: Sequence[float] = DELAYS,
) -> None:
    """Ask for all of it, each after a random number of turns; a request may be refused."""

    async def later(request: Callable[[], Awaitable[object]]) -> None:
        for _ in range(chance.randrange(12)):
            await asyncio.sleep(chance.choice(delays))
        with contextlib.suppress(VisualHfsmError):
            await request()

    asked = list(requests)
    chance.shuffle(asked)
    async with asyncio.timeout(RUN_LIMIT):
        await asyncio.gather(*map(later, asked))


class Nursery:
    """Children that are no processes: whatever they do takes a random number of turns of the event loop.

    `role` says of a command what only one of them may do at a time.
    """

    def __init__(self, chance: random.Random, role: Callable[[Sequence[str]], str]) -> None:
        self.chance = chance
        self.role = role
        self.alive: Counter[str] = Counter()
        self.most: Counter[str] = Counter()
        """How many of a role were alive together."""

    async def turns(self) -> None:
        for _ in range(self.chance.randrange(6)):
            await asyncio.sleep(0)

    async def to_thread(self, work: Callable[..., T], *args: object, **kwargs: object) -> T:
        """Stand in for `asyncio.to_thread`."""
        await self.turns()
        result = work(*args, **kwargs)
        await self.turns()
        return result

    def child(self, _take: Callable[[int, bytes], None]) -> _Child:
        """Stand in for `ChildProcess`."""
        return _Child(self)


class _Child:
    def __init__(self, nursery: Nursery) -> None:
        self._nursery = nursery
        self._role = ""
        self._ended = asyncio.Event()

    async def start(self, command: Sequence[str], _environment: Mapping[str, str]) -> None:
        nursery = self._nursery
        await nursery.turns()
        self._role = nursery.role(command)
        nursery.alive[self._role] += 1
        nursery.most |= nursery.alive
        if nursery.chance.random() < 0.2:
            self.kill()  # it ends by itself
        await nursery.turns()

    async def wait(self) -> int:
        await self._ended.wait()
        await self._nursery.turns()
        return 0

    async def stop(self, _patience: Sequence[float]) -> None:
        await self._nursery.turns()
        self.kill()
        await self._nursery.turns()

    def kill(self) -> None:
        if not self._ended.is_set():
            self._ended.set()
            self._nursery.alive[self._role] -= 1
