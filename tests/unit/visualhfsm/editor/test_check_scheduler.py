"""Checks in the background."""

from __future__ import annotations

import asyncio
from pathlib import Path

from codegen.diagnostics import Severity
from codegen.hfsm.codes import PROVED
from codegen.messages import Message
from tests.support.limits import RUN_LIMIT
from visualhfsm import Checked, Event, Findings, Project
from visualhfsm._document.problems import Problem
from visualhfsm._editor.check_scheduler import CheckScheduler
from visualhfsm._editor.tab import Tab, Threads
from visualhfsm._monitor.messages import RecentLines
from visualhfsm.project._check_process import CheckProcess


class FailsOnce(CheckProcess):
    """Finds nothing, from the second question on."""

    asked = 0

    def check(self, *_: object) -> Findings:
        self.asked += 1
        if self.asked == 1:
            raise RuntimeError("a fault")
        return Findings()


class GivesUpOnce(CheckProcess):
    """Gives up its first search."""

    asked = 0

    def check(self, *_: object) -> Findings:
        self.asked += 1
        return Findings(problems=(LATE,), pending=PROVED if self.asked == 1 else frozenset())


LATE = Problem(code="W522", severity=Severity.WARNING, message=Message("late"))
NEVER = Problem(code="W514", severity=Severity.WARNING, message=Message("never entered"))


def test_a_search_that_was_given_up_is_made_up_for_and_its_last_verdicts_stand(tmp_path: Path) -> None:
    process = GivesUpOnce()
    given_up: list[bool] = []

    async def go() -> None:
        loop = asyncio.get_running_loop()
        checked: asyncio.Queue[Checked] = asyncio.Queue()
        project = Project(tmp_path, journals=tmp_path, checks=process)

        def hear(event: Event) -> None:
            if isinstance(event, Checked):
                loop.call_soon_threadsafe(checked.put_nowait, event)

        project.subscribe(hear)
        threads = Threads(1)
        tab = Tab(1, project.new(), threads, changed=lambda _: None, output=RecentLines(1, 100))
        tab.take_findings(tab.shown, Findings(problems=(NEVER, LATE), counts={Severity.WARNING: 2}))
        scheduler = CheckScheduler(0.0, lambda: given_up.append(True))
        running = asyncio.create_task(scheduler.run())
        scheduler.check(tab)
        async with asyncio.timeout(RUN_LIMIT):
            for items, complete in (((LATE, NEVER), False), ((LATE,), True)):
                event = await checked.get()
                tab.take_findings(event.version, event.findings)
                assert tab.findings is not None
                assert (tuple(tab.findings.items), tab.findings.complete) == (items, complete)
        running.cancel()
        await asyncio.wait({running})
        project.close()
        await scheduler.close()
        await threads.close()

    asyncio.run(go())
    assert given_up == [True]


def test_a_check_that_fails_is_not_the_last_one(tmp_path: Path) -> None:
    process = FailsOnce()

    async def go() -> None:
        loop = asyncio.get_running_loop()
        checked: asyncio.Queue[Checked] = asyncio.Queue()

        def hear(event: Event) -> None:
            if isinstance(event, Checked):
                loop.call_soon_threadsafe(checked.put_nowait, event)

        project = Project(tmp_path, journals=tmp_path, checks=process)
        project.subscribe(hear)
        scheduler = CheckScheduler(0.0)
        running = asyncio.create_task(scheduler.run())
        threads = Threads(1)
        documents = [project.new() for _ in range(2)]
        for number, document in enumerate(documents):
            tab = Tab(number, document, threads, changed=lambda _: None, output=RecentLines(1, 100))
            scheduler.check(tab)
        async with asyncio.timeout(RUN_LIMIT):
            assert (await checked.get()).document is documents[1]
        running.cancel()
        await asyncio.wait({running})
        project.close()
        await scheduler.close()
        await threads.close()

    asyncio.run(go())
    assert process.asked == 2
