"""Requests that open and close documents, whose window is closed meanwhile."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Awaitable, Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from tests.support.coroutines import Loop
from tests.support.editor import no_parts
from tests.support.limits import FOREVER
from visualhfsm import Closed, Event, Opened, Project
from visualhfsm._editor import protocol as p
from visualhfsm._editor.handlers import HANDLERS
from visualhfsm._editor.limits import Limits
from visualhfsm._editor.workspace import Workspace

WINDOW: Any = SimpleNamespace(language="en")


@pytest.fixture
def workspace(tmp_path: Path, loop: Loop) -> Workspace:
    project = Project(tmp_path, journals=tmp_path / "journals")
    return loop.enter(Workspace(Limits(), no_parts, lambda _: project))


async def give_up(workspace: Workspace, work: Awaitable[object], when: type[Event]) -> None:
    """Cancel a request when its event is heard, and wait until it is done nevertheless."""
    heard, go_on = threading.Event(), threading.Event()

    def hear(event: Event) -> None:
        if isinstance(event, when):
            heard.set()
            assert go_on.wait(FOREVER)

    unsubscribe = workspace.project.subscribe(hear)
    task = asyncio.ensure_future(work)
    await asyncio.to_thread(heard.wait, FOREVER)
    task.cancel()
    await asyncio.gather(task, return_exceptions=True)
    go_on.set()
    unsubscribe()


def ask(workspace: Workspace, request: p.Request) -> Awaitable[object]:
    return HANDLERS[type(request)].handle(workspace, WINDOW, request)


async def until(condition: Callable[[], bool]) -> None:
    while not condition():
        await asyncio.sleep(0.01)


async def test_a_document_is_closed_with_its_tab_though_its_window_is_closed(workspace: Workspace) -> None:
    await ask(workspace, p.New(id=1, template="empty"))
    close = ask(workspace, p.Close(id=2, tab=1))
    await give_up(workspace, close, Closed)
    await until(lambda: not workspace.tabs)


async def test_a_new_document_gets_a_tab_though_its_window_is_closed(workspace: Workspace) -> None:
    new = ask(workspace, p.New(id=1, template="empty"))
    await give_up(workspace, new, Opened)
    await until(lambda: len(workspace.tabs) == 1)


async def test_what_cannot_be_closed_at_the_end_keeps_nothing_else_open(workspace: Workspace) -> None:
    for _ in range(2):
        await ask(workspace, p.New(id=1, template="empty"))
    workspace.tabs.get(1).document.close()  # not by the page
