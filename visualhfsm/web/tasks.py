"""Run things side by side."""

from __future__ import annotations

import asyncio
from collections.abc import Coroutine

__all__ = ["until_one_ends"]


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
