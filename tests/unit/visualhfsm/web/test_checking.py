"""Checks in the background."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from pathlib import Path

from codegen.hfsm.document import Document
from tests.support.limits import RUN_LIMIT
from visualhfsm.editing.check_process import CheckProcess
from visualhfsm.editing.problems import Problem
from visualhfsm.services import RecentLines
from visualhfsm.sessions.session import DocumentSession
from visualhfsm.web.checking import Checking
from visualhfsm.web.protocol import Problems
from visualhfsm.web.tab import Tab, Threads


class FailsOnce(CheckProcess):
    """Finds nothing, from the second question on."""

    asked = 0

    def find_problems(
        self, document: Document, path: Path | None, include: Sequence[Path] = ()
    ) -> list[Problem]:
        self.asked += 1
        if self.asked == 1:
            raise RuntimeError("a fault")
        return []


def test_a_check_that_fails_is_not_the_last_one(tmp_path: Path) -> None:
    process = FailsOnce()

    async def go() -> None:
        reported: asyncio.Queue[Problems] = asyncio.Queue()
        checking = Checking(process, 0.0, lambda _, problems: reported.put_nowait(problems))
        running = asyncio.create_task(checking.run())
        threads = Threads(1)
        for number in (1, 2):
            session = DocumentSession.new(Document(), f"{number}", journals=tmp_path)
            checking.check(Tab(number, session, threads, changed=lambda _: None, output=RecentLines(1, 100)))
        async with asyncio.timeout(RUN_LIMIT):
            assert (await reported.get()).tab == 2
        running.cancel()
        await asyncio.wait({running})
        await checking.close()
        await threads.close()

    asyncio.run(go())
    assert process.asked == 2
