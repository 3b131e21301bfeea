"""Checks in the background."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from pathlib import Path

import pytest

from codegen.hfsm.document import Document
from tests.support.limits import RUN_LIMIT
from visualhfsm.editing.problems import CheckProcess, Problem
from visualhfsm.sessions.session import DocumentSession
from visualhfsm.web.protocol import Problems
from visualhfsm.web.tab import Tab, Threads
from visualhfsm.web.workspace import Checking


def test_a_check_that_fails_is_not_the_last_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[str] = []

    def find_problems(
        _process: CheckProcess, document: Document, _path: Path | None, _include: Sequence[Path] = ()
    ) -> list[Problem]:
        asked.append(document.description.text)
        if len(asked) == 1:
            raise RuntimeError("a fault")
        return []

    monkeypatch.setattr(CheckProcess, "find_problems", find_problems)

    async def go() -> None:
        reported: asyncio.Queue[Problems] = asyncio.Queue()
        checking = Checking(0.0, lambda _, problems: reported.put_nowait(problems))
        running = asyncio.create_task(checking.run())
        threads = Threads(1)
        for number in (1, 2):
            session = DocumentSession.new(Document(), f"{number}", journals=tmp_path)
            checking.check(Tab(number, session, threads, changed=lambda _: None, output_lines=1))
        async with asyncio.timeout(RUN_LIMIT):
            assert (await reported.get()).tab == 2
        running.cancel()
        await asyncio.wait({running})
        await checking.close()
        await threads.close()

    asyncio.run(go())
    assert len(asked) == 2
