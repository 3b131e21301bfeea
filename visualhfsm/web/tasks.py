"""Run things side by side, and to their end."""

from __future__ import annotations

import asyncio
from collections.abc import Coroutine
from typing import TypeVar

__all__ = ["retrieve", "to_the_end", "until_one_ends"]

R = TypeVar("R")


async def until_one_ends(*work: Coroutine[object, object, None]) -> None:
    """Run all until one ends, and cancel the others; raises what the first one to fail raised."""
    tasks = [asyncio.create_task(each) for each in work]
    try:
        await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
    finally:
        for task in tasks:
            task.cancel()
        results = await asyncio.gather(*tasks, return_exceptions=True)
    for result in results:
        if isinstance(result, Exception):
            raise result


async def to_the_end(work: Coroutine[object, object, R]) -> R:
    """Wait for work that goes on when who waits for it gives up; others may wait for what it locks."""
    task = asyncio.create_task(work)
    task.add_done_callback(retrieve)
    return await asyncio.shield(task)


def retrieve(future: asyncio.Future[R]) -> None:
    """Take note of an exception: whoever waits gets it; if nobody does any more, it is not a fault."""
    if not future.cancelled():
        future.exception()
