"""The tests of a document, run below an editor without a page."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

from codegen.messages import Message
from tests.support.pushes import Pushes
from visualhfsm._document.serialization import parse
from visualhfsm._monitor.messages import Source
from visualhfsm._processes.test_results import TestsPush
from visualhfsm._processes.tests import StartedTests

__all__ = ["Tests", "outcomes", "running"]


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


@asynccontextmanager
async def running(path: Path) -> AsyncIterator[Tests]:
    """Have such a service for the tests of a document."""
    tests = Tests(path)
    try:
        yield tests
    finally:
        await tests.service.close()


def outcomes(push: TestsPush) -> dict[str, str]:
    return {each.name: each.outcome for each in push.tests}
