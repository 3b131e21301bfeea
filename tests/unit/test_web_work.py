"""Work in threads, one at a time for each thing."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable, Coroutine
from typing import Any

import pytest

from tests.support.limits import LIMIT
from visualhfsm.web.work import Queue, Workers


def run(test: Callable[[Workers], Coroutine[Any, Any, None]]) -> None:
    async def with_workers() -> None:
        workers = Workers(3)
        try:
            await asyncio.wait_for(test(workers), LIMIT)
        finally:
            await workers.close()

    asyncio.run(with_workers())


def test_work_on_one_thing_neither_overlaps_nor_overtakes() -> None:
    log: list[str] = []

    async def test(workers: Workers) -> None:
        queue = Queue(workers, lambda: log.append("done"))
        first_runs, go_on = threading.Event(), threading.Event()

        def first() -> None:
            first_runs.set()
            assert go_on.wait(LIMIT)
            log.append("first")

        one = asyncio.create_task(queue.do(first))
        two = asyncio.create_task(queue.do(lambda: log.append("second")))
        await asyncio.to_thread(first_runs.wait, 10)
        assert await workers.do(lambda: "other work goes on") == "other work goes on"
        assert log == []
        go_on.set()
        await asyncio.gather(one, two)

    run(test)
    assert log == ["first", "done", "second", "done"]


def test_work_whose_caller_gave_up_ends_before_the_next_begins() -> None:
    log: list[str] = []

    async def test(workers: Workers) -> None:
        queue = Queue(workers, lambda: log.append("done"))
        go_on = threading.Event()

        def slow() -> None:
            assert go_on.wait(LIMIT)
            log.append("slow")

        with pytest.raises(TimeoutError):
            await asyncio.wait_for(queue.do(slow), 0.01)
        later = asyncio.create_task(queue.do(lambda: log.append("later")))
        await workers.do(lambda: None)
        assert log == []
        go_on.set()
        await later

    run(test)
    assert log == ["slow", "done", "later", "done"]


def test_what_fails_is_raised_and_the_next_goes_on() -> None:
    async def test(workers: Workers) -> None:
        queue = Queue(workers, lambda: None)
        with pytest.raises(ZeroDivisionError):
            await queue.do(lambda: 1 // 0)
        assert await queue.do(lambda: "next") == "next"

    run(test)
