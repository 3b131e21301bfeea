"""Loops over streams, in threads and in asyncio."""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import suppress
from typing import Any, Final, Generic, Protocol, TypeVar

from .pacing import Pacer
from .sample import Sample
from .stream_reader import StreamReader
from .subscription import Delivery, Subscription

__all__ = ["Samples"]

V = TypeVar("V")


class Subscribe(Protocol[V]):
    """Call a function with the samples of a stream."""

    def __call__(self, callback: Callable[[Sample[V]], Any]) -> Subscription[V]:
        """Begin to."""


class Samples(Generic[V]):
    """Sample after sample of a stream, always the newest, for `for` and for `async for`.

    Each is waited for for at most `timeout` s; raises as `StreamReader.wait` does.
    """

    def __init__(
        self, reader: StreamReader[V], timeout: float, rate: float | None, subscribe: Subscribe[V]
    ) -> None:
        self._reader: Final = reader
        self._timeout: Final = timeout
        self._rate: Final = Delivery(rate).rate  # which checks it
        self._subscribe: Final = subscribe
        self._pacer: Final = Pacer(rate)
        self._sample: Sample[V] | None = None

    def __iter__(self) -> Iterator[Sample[V]]:
        return self

    def __next__(self) -> Sample[V]:
        if delay := self._pacer.delay():
            self._reader.rest(delay)
        self._sample = self._reader.wait(self._sample, self._timeout)
        self._pacer.count()
        return self._sample

    async def __aiter__(self) -> AsyncIterator[Sample[V]]:
        loop = asyncio.get_running_loop()
        changed = asyncio.Event()
        arrived: list[Sample[V]] = []  # the newest, or none

        def take(sample: Sample[V]) -> None:
            with suppress(IndexError):
                sample.lost += arrived.pop().lost + 1
            arrived.append(sample)
            tell()

        def tell() -> None:
            with suppress(RuntimeError):  # the loop was closed, and nobody looks any more
                loop.call_soon_threadsafe(changed.set)

        pacer = Pacer(self._rate)
        self._reader.add_watcher(tell)
        try:
            with self._subscribe(take):
                while True:
                    await asyncio.sleep(pacer.delay())
                    sample = await self._next(arrived, changed)
                    pacer.count()
                    yield sample
        finally:
            self._reader.remove_watcher(tell)

    async def _next(self, arrived: list[Sample[V]], changed: asyncio.Event) -> Sample[V]:
        started = time.monotonic()
        while True:
            changed.clear()
            with suppress(IndexError):
                return arrived.pop()
            left = self._timeout - (time.monotonic() - started)
            if left <= 0 or self._reader.closed or self._reader.lost_since(started):
                # On another thread: it may ask others for the reason.
                raise await asyncio.to_thread(self._reader.explain_silence, self._timeout)
            with suppress(TimeoutError):
                await asyncio.wait_for(changed.wait(), left)
