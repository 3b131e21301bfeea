"""Work on the event loop that is completed once it has begun, and is done alone for its document."""

from __future__ import annotations

import asyncio
from collections import defaultdict
from collections.abc import Awaitable, Callable, Coroutine, Iterator
from typing import Generic, Protocol, TypeVar

from visualhfsm._base.errors import VisualHfsmError

T = TypeVar("T")


class Runner(Protocol):
    """What runs something for one document."""

    async def stop(self) -> None:
        """End what runs."""

    async def close(self) -> None:
        """End what runs, and delete its temporary files."""


R = TypeVar("R", bound=Runner)


class PerDocument(Generic[R]):
    """A runner for each open document, by the number of its tab. Used on one event loop.

    Work with a runner is done alone, from its first look at what runs to the last thing that it does, and is
    completed even when its caller is cancelled. Nothing begins for a document that was closed.
    """

    def __init__(self, make: Callable[[int], R]) -> None:
        self._make = make
        self._kept: dict[int, R] = {}
        self._busy: defaultdict[int, asyncio.Lock] = defaultdict(asyncio.Lock)
        self._forgotten: set[int] = set()
        self._closed = False

    def get(self, tab: int) -> R | None:
        """Return the runner of a document, if it has one."""
        return self._kept.get(tab)

    def __iter__(self) -> Iterator[R]:
        return iter([*self._kept.values()])

    async def do(self, tab: int, work: Callable[[R], Awaitable[T]]) -> T:
        """Do work with the runner of a document, which is made now if need be.

        Raises VisualHfsmError for a document that was closed, also while the work waited for its turn.
        """

        async def unless_closed() -> T:
            return await work(self._of(tab))

        self._of(tab)  # whoever stops it from now on waits for this work
        return await complete(self._alone(tab, unless_closed))

    async def stop(self, tab: int) -> None:
        """End what runs for a document, also what is being started."""
        if (runner := self.get(tab)) is not None:
            await complete(self._alone(tab, runner.stop))

    async def forget(self, tab: int) -> None:
        """Close the runner of a document that is closed for good."""
        self._forgotten.add(tab)
        if (runner := self.get(tab)) is not None:
            await complete(self._alone(tab, runner.close))
            self._kept.pop(tab, None)  # only now: what has not ended yet is still known

    async def close(self) -> None:
        """Close all runners, for good."""
        self._closed = True
        await asyncio.gather(*map(self.forget, [*self._kept]))

    def _of(self, tab: int) -> R:
        if self._closed or tab in self._forgotten:
            raise VisualHfsmError.because("the document was closed: nothing is started for it")
        if tab not in self._kept:
            self._kept[tab] = self._make(tab)
        return self._kept[tab]

    async def _alone(self, tab: int, work: Callable[[], Awaitable[T]]) -> T:
        async with self._busy[tab]:
            return await work()


async def complete(work: Coroutine[object, object, T]) -> T:
    """Wait for work that continues to its end even when its caller is cancelled."""
    task = asyncio.create_task(work)
    task.add_done_callback(retrieve)
    return await asyncio.shield(task)


def retrieve(future: asyncio.Future[T]) -> None:
    """Mark an exception as seen: a caller that still waits gets it."""
    if not future.cancelled():
        future.exception()
