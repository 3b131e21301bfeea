"""The tests of a document, run below an editor without a page."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from pathlib import Path

from codegen.messages import Message
from tests.support.pushes import Pushes
from visualhfsm._document.serialization import parse
from visualhfsm._monitor.messages import Source
from visualhfsm._processes.test_results import TestsPush
from visualhfsm._processes.tests import StartedTests

__all__ = ["Tests", "go", "outcomes"]


class Tests:
    """A service, and what it has published."""

    __test__ = False

    def __init__(self, path: Path) -> None:
        self.pushes = Pushes()
        self.service = StartedTests(self.pushes, path.parents[1])
        self.source = Source(1, 0, parse(path.read_text(), Message("Cannot read")), path, False, path.stem)

    @property
    def now(self) -> TestsPush:
        return self.pushes.of(TestsPush)[-1]

    async def run(self, *names: str) -> TestsPush:
        await self.service.start(self.source, names)
        return await self.pushes.until(lambda: self.now if self.now.status == "idle" else None)


def go(path: Path, work: Callable[[Tests], Coroutine[object, object, None]]) -> None:
    async def all_of_it() -> None:
        tests = Tests(path)
        try:
            await work(tests)
        finally:
            await tests.service.close()

    asyncio.run(all_of_it())


def outcomes(push: TestsPush) -> dict[str, str]:
    return {each.name: each.outcome for each in push.tests}
