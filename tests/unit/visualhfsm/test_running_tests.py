"""Tests of a document, run by pytest below the editor, and what they pass."""

from __future__ import annotations

import asyncio
import sys
from collections.abc import Callable, Coroutine
from dataclasses import replace
from pathlib import Path

import pytest

from tests.support.documents import document, state, sub, transition
from tests.support.processes import assert_gone, children
from tests.support.pushes import Pushes
from visualhfsm._editing.serialization import parse
from visualhfsm._errors import VisualHfsmError
from visualhfsm._running_tests import RunningTests
from visualhfsm._services import Source
from visualhfsm._test_results import TestsPush, TestView

WAITS = document(
    sub(
        1,
        0,
        state(1, "waiting", initial=True),
        state(2, "done"),
        state(3, "never"),
        transition(4, 1, 2, "500", type="time", name="enough"),
        transition(5, 2, 3, "False", name="wrong"),
    ),
)
COUNTS = document(
    sub(
        1,
        0,
        state(
            1,
            "waiting",
            """if not self.rounds:
    self.late = (
        self.rounds
    )
elif self.rounds > 9:
    pass
self.rounds += 0

self.rounds += 1  # in each cycle""",
            initial=True,
        ),
        state(2, "done", "self.divide(0)"),
        transition(4, 1, 2, "self.rounds > 3", name="enough"),
        transition(5, 2, 1, "False", name="never"),
        functions='def divide(self, by):\n    """Divide."""\n    return 1 / by',
        variables="self.rounds = 0",
    ),
)
GOOD = """
def test_it_waits(behavior):
    b = behavior("waits.xml")
    b.advance(0.2)
    assert b.active == "waiting"


def test_it_is_done_soon(behavior):
    b = behavior("waits.xml")
    b.run_until("done", limit=1.0)
"""
BAD = """
import pytest

@pytest.mark.parametrize("limit", [0.1, 0.2])
def test_it_is_done_at_once(behavior, limit):
    behavior("waits.xml").run_until("done", limit=limit)
"""


@pytest.fixture
def path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.delenv("COVERAGE_PROCESS_CONFIG", raising=False)  # else these processes are measured already
    (tmp_path / "behaviors").mkdir()
    (tmp_path / "tests").mkdir()
    (tmp_path / "pyproject.toml").write_text("[tool.pytest.ini_options]\n")
    (tmp_path / "tests" / "test_waits.py").write_text(GOOD.replace("waits.xml", "behaviors/waits.xml"))
    (tmp_path / "tests" / "test_other.py").write_text("def test_other(): pass\n")
    (tmp_path / "behaviors" / "waits.xml").write_text(WAITS)
    return tmp_path / "behaviors" / "waits.xml"


class Tests:
    """A service, and what it has published."""

    __test__ = False

    def __init__(self, path: Path) -> None:
        self.pushes = Pushes()
        self.service = RunningTests(self.pushes, path.parents[1])
        self.source = Source(1, 0, parse(path.read_text(), "Cannot read"), path, False, path.stem)

    @property
    def now(self) -> TestsPush:
        return self.pushes.of(TestsPush)[-1]

    async def run(self, *names: str) -> TestsPush:
        await self.service.run(self.source, names)
        return await self.pushes.until(lambda: self.now if self.now.status == "idle" else None)


def go(path: Path, work: Callable[[Tests], Coroutine[object, object, None]]) -> None:
    async def all_of_it() -> None:
        tests = Tests(path)
        try:
            await work(tests)
        finally:
            await tests.service.close()

    asyncio.run(all_of_it())


def lines(push: TestsPush) -> dict[tuple[str, int], tuple[tuple[int, ...], ...]]:
    return {(each.place.part, each.place.id): (each.passed, each.missed, each.failed) for each in push.code}


def outcomes(push: TestsPush) -> dict[str, str]:
    return {each.name: each.outcome for each in push.tests}


def test_the_tests_of_a_document_are_those_in_files_that_name_it(path: Path) -> None:
    path.with_name("test_bad.py").write_text(BAD)

    async def work(tests: Tests) -> None:
        await tests.service.look(tests.source)
        assert [(each.file, each.name, each.outcome) for each in tests.now.tests] == [
            ("behaviors/test_bad.py", "test_it_is_done_at_once", ""),
            ("tests/test_waits.py", "test_it_waits", ""),
            ("tests/test_waits.py", "test_it_is_done_soon", ""),
        ]
        with pytest.raises(VisualHfsmError, match="save the document first"):
            await tests.service.look(replace(tests.source, path=None))

    go(path, work)


def test_what_they_pass_is_counted(path: Path) -> None:
    async def work(tests: Tests) -> None:
        found = await tests.run()
        assert found.error == ""
        assert outcomes(found) == {"test_it_waits": "passed", "test_it_is_done_soon": "passed"}
        assert {(each.kind, each.id): each.count for each in found.passed} == {
            ("state", 1): 2,
            ("state", 2): 1,
            ("transition", 4): 1,
        }
        assert not any(each.failed for each in found.passed)

    go(path, work)


def test_a_failure_has_its_reason_and_timeline_and_the_state_where_it_failed(path: Path) -> None:
    path.with_name("test_bad.py").write_text(BAD)

    async def work(tests: Tests) -> None:
        found = await tests.run("behaviors/test_bad.py::test_it_is_done_at_once")
        names = [each.name for each in found.tests if each.outcome == "failed"]
        assert names == ["test_it_is_done_at_once[0.1]", "test_it_is_done_at_once[0.2]"]
        failed: TestView = found.tests[0]
        assert failed.reason.startswith("test_bad.py:6: BehaviorFailed: done did not happen")
        assert "enters waiting" in failed.timeline
        assert [each.id for each in found.passed if each.failed] == [1]
        assert outcomes(found)["test_it_waits"] == ""
        again = await tests.run("behaviors/test_bad.py::test_it_is_done_at_once[0.1]")
        assert [each.name for each in again.tests if each.outcome == "failed"] == names

    go(path, work)


def test_lines_of_code_are_passed_or_missed(path: Path) -> None:
    path.write_text(COUNTS)

    async def work(tests: Tests) -> None:
        found = await tests.run("tests/test_waits.py::test_it_waits")
        assert lines(found) == {
            ("functions", 0): ((), (3,), ()),  # neither `def` nor what it says of itself
            ("variables", 0): ((1,), (), ()),
            ("code", 1): ((1, 2, 3, 5, 7, 9), (6,), ()),
            ("code", 2): ((), (1,), ()),
            ("trigger", 4): ((1,), (), ()),
            ("trigger", 5): ((), (1,), ()),
        }
        asked = [
            (each.id, each.count, each.asked, each.held) for each in found.passed if each.kind != "state"
        ]
        assert asked == [(4, 0, 3, 0)]
        await tests.run("tests/test_waits.py::test_it_is_done_soon")
        assert lines(tests.now)["trigger", 4] == ((1,), (), ())
        assert found.unmeasured == ""

    go(path, work)


def test_a_line_that_fails_is_marked_and_the_one_that_led_to_it(path: Path) -> None:
    path.write_text(COUNTS)

    async def work(tests: Tests) -> None:
        path.with_name("test_breaks.py").write_text(
            'def test_it_breaks(behavior):\n    behavior("waits.xml").advance(1.0)\n'
        )
        found = await tests.run("behaviors/test_breaks.py::test_it_breaks")
        assert outcomes(found)["test_it_breaks"] == "failed"
        assert lines(found)["functions", 0] == ((), (), (3,))
        assert lines(found)["code", 2] == ((), (), (1,))
        assert [(each.id, each.failed) for each in found.passed if each.kind == "state"] == [
            (1, False),
            (2, True),
        ]

    go(path, work)


def test_code_that_has_changed_between_two_tests_is_other_code(path: Path) -> None:
    path.write_text(COUNTS)

    async def work(tests: Tests) -> None:
        await tests.run("tests/test_waits.py::test_it_waits")
        path.write_text(COUNTS.replace("self.rounds += 1", "\nself.rounds += 1"))
        found = await tests.run("tests/test_waits.py::test_it_is_done_soon")
        of_state = [each for each in found.code if (each.place.part, each.place.id) == ("code", 1)]
        assert sorted(each.passed[-1] for each in of_state) == [9, 10]
        assert len({each.version for each in of_state}) == 2

    go(path, work)


@pytest.mark.parametrize(
    ("what", "words"),
    [
        ("sys.modules['coverage'] = None", "pip install 'visualhfsm[test]'"),
        ("sys.settrace(lambda *_: None)", "another program"),
        ("import coverage; coverage.Coverage(data_file=None).start()", "another program"),
    ],
)
def test_it_says_why_lines_are_not_measured(path: Path, what: str, words: str) -> None:
    (path.parents[1] / "conftest.py").write_text(f"import sys\n{what}\n")

    async def work(tests: Tests) -> None:
        found = await tests.run()
        assert outcomes(found) == {"test_it_waits": "passed", "test_it_is_done_soon": "passed"}
        assert found.code == ()
        assert words in found.unmeasured

    go(path, work)


def test_a_file_that_cannot_be_imported_says_why(path: Path) -> None:
    path.with_name("test_bad.py").write_text("import nowhere_at_all\n" + BAD)

    async def work(tests: Tests) -> None:
        found = await tests.run()
        assert "nowhere_at_all" in found.error + "".join(each.reason for each in found.tests)

    go(path, work)


def test_what_a_test_writes_among_the_results_is_no_result(path: Path) -> None:
    writes = 'import sys\n(file,) = [each[15:] for each in sys.argv if each.startswith("--hfsm-results")]\n'
    path.with_name("test_bad.py").write_text(
        f"# waits.xml\n{writes}open(file, 'a').write('{{\"name\": 3}}\\nwhatever\\n' + '[' * 10000 + '\\n')\n"
        "def test_it(): pass\n"
    )

    async def work(tests: Tests) -> None:
        found = await tests.run()
        assert outcomes(found)["test_it"] == "passed"

    go(path, work)


def test_tests_are_stopped_and_what_is_done_is_kept(path: Path) -> None:
    path.with_name("test_last.py").write_text("# waits.xml\ndef test_it():\n    while True: pass\n")

    async def work(tests: Tests) -> None:
        names = ["tests/test_waits.py::test_it_waits", "behaviors/test_last.py::test_it"]
        await tests.service.run(tests.source, names)
        await tests.pushes.until(lambda: outcomes(tests.now)["test_it_waits"] == "passed")
        below = children("pytest")
        assert below
        with pytest.raises(VisualHfsmError, match="run already"):
            await tests.service.run(tests.source)
        await tests.service.stop(1)
        assert_gone(below)
        assert tests.now.status == "idle"
        assert tests.now.error == ""
        assert outcomes(tests.now)["test_it_waits"] == "passed"

    go(path, work)


def test_a_document_without_tests_says_where_they_would_be(path: Path) -> None:
    (path.parents[1] / "tests" / "test_waits.py").unlink()

    async def work(tests: Tests) -> None:
        with pytest.raises(VisualHfsmError, match=r"test_\*.py"):
            await tests.service.run(tests.source)

    go(path, work)


def test_without_pytest_it_says_what_to_install(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pytest", None)

    async def work(tests: Tests) -> None:
        with pytest.raises(VisualHfsmError, match="visualhfsm\\[test\\]"):
            await tests.service.run(tests.source)

    go(path, work)
