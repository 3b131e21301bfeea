"""Work that takes long, in threads, one at a time for each thing that it changes."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

from .tasks import retrieve

__all__ = ["Queue", "Workers"]

R = TypeVar("R")


class Workers:
    """A few threads. What is called waits for a free one; who waits for it may give up, the work goes on."""

    def __init__(self, threads: int) -> None:
        self._pool = ThreadPoolExecutor(threads, thread_name_prefix="editor")

    def start(self, work: Callable[[], R]) -> asyncio.Future[R]:
        """Begin work in a thread."""
        return asyncio.get_running_loop().run_in_executor(self._pool, work)

    async def do(self, work: Callable[[], R]) -> R:
        """Do work in a thread and return what it gives."""
        future = self.start(work)
        future.add_done_callback(retrieve)
        return await asyncio.shield(future)

    async def close(self) -> None:
        """Leave out what has not begun and wait for what has."""
        await asyncio.to_thread(self._pool.shutdown, cancel_futures=True)


class Queue:
    """Work on one thing that must not overlap, in the order in which it is asked for."""

    def __init__(self, workers: Workers, done: Callable[[], None]) -> None:
        self._workers = workers
        self._done = done
        self._lock = asyncio.Lock()

    async def do(self, work: Callable[[], R]) -> R:
        """Do work in a thread once the former is done, and return what it gives.

        `done` is called on the event loop before this returns. Work that has begun ends even when nobody
        waits for it any more, and the next waits for it.
        """
        await self._lock.acquire()
        try:
            future = self._workers.start(work)
        except BaseException:
            self._lock.release()
            raise

        def finish(ended: asyncio.Future[R]) -> None:
            self._lock.release()
            retrieve(ended)
            if not ended.cancelled():
                self._done()

        future.add_done_callback(finish)
        return await asyncio.shield(future)
