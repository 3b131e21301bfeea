"""The queue of a slow window."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from tests.support.component import snapshot
from tests.support.coroutines import Loop
from tests.support.limits import EVENT_LIMIT, FOREVER
from visualhfsm import Project
from visualhfsm._document.commands.states import AddState
from visualhfsm._editor.protocol import Answer, Problems
from visualhfsm._editor.tab import Tab, Threads
from visualhfsm._editor.window import Window
from visualhfsm._monitor.messages import Output, OutputLine, RecentLines, Snapshot, Stale, StartedPush
from visualhfsm._monitor.realm.robot import RobotState
from visualhfsm._monitor.realm.run_log import LiveSnapshot


def waiting(fill: Callable[[Window], None], lines: int = 5) -> list[dict[str, Any]]:
    """Return what is sent to a window that was filled with messages."""

    async def take() -> list[bytes]:
        window = Window(partial(RecentLines, lines, 1000))
        window.greet()
        fill(window)
        return await batch(window)

    return [json.loads(message) for message in asyncio.run(take())]


async def batch(window: Window) -> list[bytes]:
    """Return what a window sends at once, as soon as there is something."""
    sent: list[bytes] = []
    something = asyncio.Event()

    async def send(message: str) -> None:
        sent.append(message.encode())
        something.set()

    writing = asyncio.create_task(window.write(send))
    try:
        await asyncio.wait_for(something.wait(), EVENT_LIMIT)
    finally:
        writing.cancel()
        await asyncio.gather(writing, return_exceptions=True)
    return sent


@pytest.fixture
def window() -> Window:
    made = Window(partial(RecentLines, 5, 1000))
    made.greet()
    return made


@asynccontextmanager
async def shown(directory: Path, window: Window) -> AsyncIterator[Tab]:
    threads = Threads(1)
    document = Project(directory, journals=directory).new()
    tab = Tab(1, document, threads, changed=window.show, output=RecentLines(1, 100))
    try:
        yield tab
    finally:
        await tab.edit(lambda document: document.close(discard=True))
        await threads.close()


@pytest.fixture
def tab(tmp_path: Path, window: Window, loop: Loop) -> Tab:
    return loop.enter(shown(tmp_path, window))


def problems(revision: int, tab: int = 1) -> Problems:
    return Problems(tab=tab, revision=revision, items=[])


def lines(*texts: str, tab: int = 1) -> Output:
    return Output(tab=tab, lines=[OutputLine(text=text) for text in texts])


def test_of_each_thing_only_the_newest_is_sent() -> None:
    def fill(window: Window) -> None:
        window.push(problems(1))
        window.push(problems(1, tab=2))
        window.push(problems(2))

    assert [(each["tab"], each["revision"]) for each in waiting(fill)] == [(1, 2), (2, 1)]


def test_a_silence_comes_after_the_moment_before_it() -> None:
    moment = LiveSnapshot(5.0, snapshot(5.0), RobotState())

    def fill(window: Window) -> None:
        window.push(Stale(component="walk", since=0.0))
        window.push(Snapshot(component="walk", value=moment))
        window.push(Stale(component="walk", since=5.0))

    assert [(each["push"], each.get("since")) for each in waiting(fill)] == [
        ("snapshot", None),
        ("stale", 5.0),
    ]


def test_each_status_of_a_run_is_sent_in_its_order() -> None:
    def fill(window: Window) -> None:
        window.push(StartedPush(tab=1, component="walk", status="generating"))
        window.push(StartedPush(tab=1, component="walk", status="stopping"))
        window.push(StartedPush(tab=1, component="walk", status="ended"))
        window.push(StartedPush(tab=1, component="walk", status="generating"))

    sent = [each["status"] for each in waiting(fill) if each["push"] == "started"]
    assert sent == ["stopping", "ended", "generating"]


async def test_a_document_is_sent_as_it_is_when_there_is_room(tab: Tab, window: Window) -> None:
    window.show(tab)
    (first,) = await batch(window)
    assert "full" in json.loads(first)
    for name in ("a", "b"):
        command = AddState(automaton=1, x=0, y=0, name=name)
        await tab.edit(lambda document, command=command: document.apply(command))  # type: ignore[misc]
    (second,) = await batch(window)
    sent = json.loads(second)
    (only,) = sent["full"]["automata"]
    assert [state["name"] for state in only["states"]][-2:] == ["a", "b"]
    assert sent["revision"] == 2


def test_what_was_pushed_comes_before_the_answers_in_their_order() -> None:
    def fill(window: Window) -> None:
        window.answer(Answer(re=1))
        window.push(problems(1))
        window.answer(Answer(re=2))

    assert [each.get("push", each.get("re")) for each in waiting(fill)] == ["problems", 1, 2]


def test_output_comes_last_but_before_the_news_that_its_component_has_ended() -> None:
    def fill(window: Window) -> None:
        window.push(lines("x", tab=2))
        window.push(StartedPush(tab=1, component="walk", status="ended"))
        window.push(lines("a", "b", "c"))
        window.push(lines("d", "e", "f", "g"))
        window.answer(Answer(re=1))

    output, ended, answer, other = waiting(fill)
    assert ([line["text"] for line in output["lines"]], output["dropped"]) == (["c", "d", "e", "f", "g"], 2)
    assert ended["status"] == "ended"
    assert answer["re"] == 1
    assert other["tab"] == 2


def test_output_is_bounded_by_its_characters_too() -> None:
    (output,) = waiting(lambda window: window.push(lines("a" * 400, "b" * 400, "c" * 400)))
    assert [line["text"][0] for line in output["lines"]] == ["b", "c"]
    assert output["dropped"] == 1


@asynccontextmanager
async def written(window: Window) -> AsyncIterator[Callable[[], Awaitable[str]]]:
    """Let a window write meanwhile; yield a function that returns the next message."""
    window.greet()
    sent: asyncio.Queue[str] = asyncio.Queue()
    writing = asyncio.create_task(window.write(sent.put))
    try:
        yield sent.get
    finally:
        writing.cancel()
        await asyncio.gather(writing, return_exceptions=True)


def texts(message: str) -> list[str]:
    return [line["text"] for line in json.loads(message)["lines"]]


async def test_more_output_waits_until_the_window_has_shown_the_last(loop: Loop) -> None:
    window = Window(partial(RecentLines, 5, 1000), patience=FOREVER)
    async with written(window) as following:
        window.push(lines("a"))
        assert texts(await following()) == ["a"]
        window.push(lines("b"))
        window.push(lines("c"))
        window.answer(Answer(re=1))
        assert json.loads(await following())["re"] == 1
        window.output_shown()
        assert texts(await following()) == ["b", "c"]


async def test_a_window_that_is_asleep_and_says_nothing_gets_more_output_after_a_while(loop: Loop) -> None:
    window = Window(partial(RecentLines, 5, 1000), patience=0.01)
    async with written(window) as following:
        for text in ("a", "b"):
            window.push(lines(text))
            assert texts(await following()) == [text]


def test_what_a_former_run_has_written_is_dropped_when_another_starts() -> None:
    def fill(window: Window) -> None:
        window.push(lines("a", "b"))
        window.push(StartedPush(tab=1, component="walk", status="generating"))
        window.push(lines("c"))

    run, output = waiting(fill)
    assert run["status"] == "generating"
    assert ([line["text"] for line in output["lines"]], output["whole"]) == (["c"], True)


def test_the_whole_output_takes_the_place_of_what_waits() -> None:
    def fill(window: Window) -> None:
        window.push(lines("a", "b", "c", "d", "e", "f"))
        window.push(Output(tab=1, lines=lines("a", "b").lines, whole=True))
        window.push(lines("c"))

    (sent,) = waiting(fill)
    assert [line["text"] for line in sent["lines"]] == ["a", "b", "c"]
    assert (sent["dropped"], sent["whole"]) == (0, True)


def test_of_a_closed_tab_nothing_else_is_sent() -> None:
    def fill(window: Window) -> None:
        window.push(problems(1))
        window.push(problems(1, tab=2))
        window.close(1)

    assert [(each["push"], each["tab"]) for each in waiting(fill)] == [("problems", 2), ("closed", 1)]


async def test_a_window_that_has_not_said_hello_gets_answers_alone(loop: Loop) -> None:
    window = Window(partial(RecentLines, 5, 1000))
    window.push(problems(1))
    window.answer(Answer(re=1))
    (answer,) = await batch(window)
    assert json.loads(answer)["re"] == 1


async def test_nothing_is_sent_twice(loop: Loop) -> None:
    window = Window(partial(RecentLines, 5, 1000))
    window.answer(Answer(re=1))
    assert len(await batch(window)) == 1
    with pytest.raises(TimeoutError):
        await asyncio.wait_for(batch(window), 0.01)
