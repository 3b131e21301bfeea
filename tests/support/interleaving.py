"""Ask a service of the editor for several things at once, in a random order."""

from __future__ import annotations

import asyncio
import contextlib
import random
from collections.abc import Awaitable, Callable, Iterable

from tests.support.limits import RUN_LIMIT
from visualhfsm._base.errors import VisualHfsmError

__all__ = ["interleave"]

DELAYS = (0.0, 0.0, 0.02)
"""In s: of a turn of the event loop, mostly, or of a thread that reads a file."""


async def interleave(chance: random.Random, requests: Iterable[Callable[[], Awaitable[object]]]) -> None:
    """Ask for all of it, each after a random number of turns; a request may be refused."""

    async def later(request: Callable[[], Awaitable[object]]) -> None:
        for _ in range(chance.randrange(12)):
            await asyncio.sleep(chance.choice(DELAYS))
        with contextlib.suppress(VisualHfsmError):
            await request()

    asked = list(requests)
    chance.shuffle(asked)
    async with asyncio.timeout(RUN_LIMIT):
        await asyncio.gather(*map(later, asked))
