"""Work on an open document: in threads, one at a time for each document."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import asynccontextmanager
from pathlib import Path

import pytest

from codegen.diagnostics import Severity
from codegen.messages import Message
from tests.support.coroutines import Loop
from tests.support.documents import document, state, sub
from tests.support.limits import FOREVER
from visualhfsm import AddState, OpenDocument, Project, SetText
from visualhfsm._document.origins import Origin
from visualhfsm._document.places import Place, texts_at
from visualhfsm._editor.protocol import Problems
from visualhfsm._editor.tab import Tab, Threads
from visualhfsm._monitor.messages import Failed, RecentLines
from visualhfsm._processes.document_tests import version_of
from visualhfsm._processes.test_results import PassedCode, TestsPush

EMPTY = '<VisualHFSM><SubAutomata id="1"/></VisualHFSM>'


@pytest.fixture
def log() -> list[str]:
    """What has been done, and to what a document has changed."""
    return []


@pytest.fixture
def threads(loop: Loop) -> Threads:
    return loop.enter(closing(Threads(3)))


@asynccontextmanager
async def closing(threads: Threads) -> AsyncIterator[Threads]:
    yield threads
    await threads.close()


@pytest.fixture
def opened(tmp_path: Path, log: list[str], threads: Threads, loop: Loop) -> Iterator[Callable[[int], Tab]]:
    """Open documents; their changes are logged."""
    tabs: list[Tab] = []
    project = Project(tmp_path, journals=tmp_path)

    def changed(tab: Tab) -> None:
        log.append(f"changed to {tab.shown.revision}")

    def opened(number: int) -> Tab:
        document = project.open_text(f"{number}", EMPTY, kept=True)
        tabs.append(Tab(number, document, threads, changed=changed, output=RecentLines(1, 100)))
        return tabs[-1]

    yield opened
    for tab in tabs:
        loop.run(tab.edit(OpenDocument.close, discard=True))


def add_state(document: OpenDocument) -> None:
    document.apply(AddState(automaton=1, x=0, y=0))


async def test_work_on_one_document_neither_overlaps_nor_overtakes(
    opened: Callable[[int], Tab], threads: Threads, log: list[str]
) -> None:
    tab, other = opened(1), opened(2)
    first_runs, go_on = threading.Event(), threading.Event()

    def first(document: OpenDocument) -> None:
        first_runs.set()
        assert go_on.wait(FOREVER)
        add_state(document)
        log.append("first")

    def second(document: OpenDocument) -> None:
        add_state(document)
        log.append("second")

    one = asyncio.create_task(tab.edit(first))
    two = asyncio.create_task(tab.edit(second))
    await asyncio.to_thread(first_runs.wait, FOREVER)
    assert await threads.do(lambda: "other work goes on") == "other work goes on"
    assert await other.edit(lambda document: document.version.title) == "2"
    assert log == []
    go_on.set()
    await asyncio.gather(one, two)
    assert log == ["first", "changed to 1", "second", "changed to 2"]


async def test_work_whose_caller_gave_up_ends_before_the_next_begins(
    opened: Callable[[int], Tab], threads: Threads, log: list[str]
) -> None:
    tab = opened(1)
    go_on = threading.Event()

    def slow(document: OpenDocument) -> None:
        assert go_on.wait(FOREVER)
        add_state(document)
        log.append("slow")

    with pytest.raises(TimeoutError):
        await asyncio.wait_for(tab.edit(slow), 0.01)
    later = asyncio.create_task(tab.edit(lambda _: log.append("later")))
    await threads.do(lambda: None)
    assert log == []
    go_on.set()
    await later
    assert log == ["slow", "changed to 1", "later"]


async def test_work_whose_caller_gave_up_before_it_began_is_not_done(
    opened: Callable[[int], Tab], log: list[str]
) -> None:
    tab = opened(1)
    go_on = threading.Event()
    slow = asyncio.create_task(tab.edit(lambda _: go_on.wait(FOREVER)))
    await asyncio.sleep(0)
    with pytest.raises(TimeoutError):
        await asyncio.wait_for(tab.edit(add_state), 0.01)
    go_on.set()
    await slow
    assert tab.shown.revision == 0
    assert log == []


async def test_what_fails_is_raised_and_the_next_goes_on(opened: Callable[[int], Tab]) -> None:
    tab = opened(1)
    with pytest.raises(ZeroDivisionError):
        await tab.edit(lambda _: 1 // 0)
    assert await tab.edit(lambda document: document.version.title) == "1"


async def test_changes_that_others_make_are_shown_too(opened: Callable[[int], Tab], log: list[str]) -> None:
    tab = opened(1)
    await asyncio.to_thread(add_state, tab.document)
    await asyncio.sleep(0)
    assert tab.shown is tab.document.version
    assert log == ["changed to 1"]


async def test_a_failure_is_a_problem_until_its_code_changes(opened: Callable[[int], Tab]) -> None:
    tab = opened(1)
    await tab.edit(add_state)
    place = Place(kind="state", automaton=1, id=1, part="code")

    def write(text: str) -> None:
        tab.document.apply(SetText(place=Place(kind="state", automaton=1, id=1, part="code"), text=text))

    await tab.edit(lambda _: write("x = 1\n  y = 1 / 0"))
    texts = texts_at(tab.shown.document, place)
    tab.failures.append(
        Failed(tab=1, origin=Origin(place, 2), message=Message("division by zero"), texts=texts)
    )
    assert tab.problems is None
    tab.findings = Problems(tab=1, revision=tab.shown.revision, items=[], counts={Severity.NOTE: 7})
    assert tab.problems is not None
    assert tab.problems.counts == {"error": 1, "note": 7}
    (problem,) = tab.problems.items
    found = problem.code, problem.severity, problem.message, problem.line, problem.column, problem.length
    assert found == ("run", "error", "division by zero", 2, 3, 9)
    await tab.edit(lambda _: write("y = 1"))
    assert tab.problems.items == []
    await tab.edit(lambda _: write("x = 1\n  y = 1 / 0"))
    assert tab.problems.items == [problem]


async def test_a_failure_in_imported_code_is_a_problem_until_the_file_changes(
    tmp_path: Path, threads: Threads
) -> None:
    look = tmp_path / "look.xml"
    imported = '<SubAutomata id="2" idFather="1"><import>look.xml</import></SubAutomata>'
    file = tmp_path / "robot.xml"
    file.write_text(document(sub(1, 0, state(1, "top", initial=True, child=2)), imported))

    def write(code: str) -> None:
        look.write_text(document(sub(1, 0, state(1, "look", code, initial=True))))

    project = Project(tmp_path, journals=tmp_path)
    tab = Tab(1, project.open(file), threads, changed=lambda _: None, output=RecentLines(1, 100))
    write("1 / 0")
    assert await tab.look_at_imports()
    assert not await tab.imports_changed()
    place = Place(kind="state", automaton=2, id=1, part="code")
    owners = (Place(kind="state", automaton=1, id=1),)
    origin = Origin(place, 1, "look.xml", owners=owners)
    tab.failures.append(Failed(tab=1, origin=origin, message=Message("zero"), texts=("1 / 0",)))
    tab.findings = Problems(tab=1, revision=tab.shown.revision, items=[])
    assert tab.problems is not None
    (problem,) = tab.problems.items
    assert (problem.file, problem.owners, problem.line) == ("look.xml", owners, 1)
    write("1 / 1.0")
    assert await tab.imports_changed()
    assert await tab.look_at_imports()
    assert tab.problems.items == []
    tab.document.close(discard=True)
    project.close()


async def test_lines_that_tests_passed_are_shown_beside_the_text_that_they_ran(
    opened: Callable[[int], Tab],
) -> None:
    place = Place(kind="state", automaton=1, id=1, part="code")
    passed = PassedCode(place=place, version=version_of("pass"), passed=(1,), missed=())
    tab = opened(1)

    async def write(text: str) -> None:
        change = SetText(place=Place(kind="state", automaton=1, id=1, part="code"), text=text)
        await tab.edit(lambda document: document.apply(change))

    await tab.edit(add_state)
    await write("pass")
    tab.tests.of = tab.shown.document
    shown = tab.tests.take(TestsPush(tab=1, code=(passed,)), tab.shown.document)
    assert (shown.code, shown.outdated) == ((passed,), False)
    await write("0")
    changed = tab.tests.compare(tab.shown.document)
    assert changed is not None
    assert (changed.code, changed.outdated) == ((), True)
    await write("pass")
    again = tab.tests.compare(tab.shown.document)
    assert again is not None
    assert (again.code, again.outdated) == ((passed,), False)
