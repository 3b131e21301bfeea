"""Tests of a document, run by pytest below the editor, and what they pass."""

from __future__ import annotations

import asyncio
import random
import sys
from dataclasses import replace
from functools import partial
from pathlib import Path

import pytest

from tests.support.coroutines import Loop
from tests.support.documents import document, state, sub, transition
from tests.support.interleaving import interleave
from tests.support.processes import assert_gone, children
from tests.support.running_tests import Tests, outcomes, running
from tests.support.soak import repeated
from visualhfsm._base.errors import VisualHfsmError
from visualhfsm._processes.test_results import TestsPush, TestView

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
def path(tmp_path: Path) -> Path:
    (tmp_path / "behaviors").mkdir()
    (tmp_path / "tests").mkdir()
    (tmp_path / "pyproject.toml").write_text("[tool.pytest.ini_options]\n")
    (tmp_path / "tests" / "test_waits.py").write_text(GOOD.replace("waits.xml", "behaviors/waits.xml"))
    (tmp_path / "tests" / "test_other.py").write_text("def test_other(): pass\n")
    (tmp_path / "behaviors" / "waits.xml").write_text(WAITS)
    return tmp_path / "behaviors" / "waits.xml"


@pytest.fixture
def tests(path: Path, loop: Loop) -> Tests:
    return loop.enter(running(path))


async def test_the_tests_of_a_document_are_those_in_files_that_name_it(path: Path, tests: Tests) -> None:
    path.with_name("test_bad.py").write_text(BAD)
    await tests.service.find(tests.source)
    assert [(each.file, each.name, each.outcome) for each in tests.now.tests] == [
        ("behaviors/test_bad.py", "test_it_is_done_at_once", ""),
        ("tests/test_waits.py", "test_it_waits", ""),
        ("tests/test_waits.py", "test_it_is_done_soon", ""),
    ]
    with pytest.raises(VisualHfsmError, match="save the document first"):
        await tests.service.find(replace(tests.source, path=None))


@pytest.mark.slow
async def test_what_tests_pass_is_counted_and_files_that_come_change_and_go_later_are_noticed(
    path: Path, tests: Tests
) -> None:
    await tests.service.refresh(tests.source)
    assert not tests.pushes.of(TestsPush)  # nobody has asked for them
    found = await tests.run()
    assert found.error == ""
    assert outcomes(found) == {"test_it_waits": "passed", "test_it_is_done_soon": "passed"}
    assert {(each.kind, each.id): each.count for each in found.passed} == {
        ("state", 1): 2,
        ("state", 2): 1,
        ("transition", 4): 1,
    }
    assert not any(each.failed for each in found.passed)
    known = len(tests.pushes.of(TestsPush))
    await tests.service.refresh(tests.source)
    assert len(tests.pushes.of(TestsPush)) == known  # nothing has changed
    bad = path.with_name("test_bad.py")
    bad.write_text(BAD)
    await tests.service.refresh(tests.source)
    assert outcomes(tests.now) == {
        "test_it_is_done_at_once": "",
        "test_it_waits": "passed",
        "test_it_is_done_soon": "passed",
    }
    good = path.parents[1] / "tests" / "test_waits.py"
    good.write_text(good.read_text().replace("soon", "later"))
    await tests.service.refresh(tests.source)
    assert outcomes(tests.now) == {
        "test_it_is_done_at_once": "",
        "test_it_waits": "",  # it passed as it was before
        "test_it_is_done_later": "",
    }
    bad.unlink()
    await tests.service.refresh(tests.source)
    assert list(outcomes(tests.now)) == ["test_it_waits", "test_it_is_done_later"]


@pytest.mark.slow
async def test_a_failure_has_its_reason_and_timeline_and_the_state_where_it_failed(
    path: Path, tests: Tests
) -> None:
    path.with_name("test_bad.py").write_text(BAD)
    found = await tests.run("behaviors/test_bad.py::test_it_is_done_at_once")
    names = [each.name for each in found.tests if each.outcome == "failed"]
    assert names == ["test_it_is_done_at_once[0.1]", "test_it_is_done_at_once[0.2]"]
    failed: TestView = found.tests[0]
    assert failed.reason.startswith("test_bad.py:6: the state done was not reached within 0.1 s: ")
    assert "enters waiting" in failed.timeline
    assert [each.id for each in found.passed if each.failed] == [1]
    assert outcomes(found)["test_it_waits"] == ""
    again = await tests.run("behaviors/test_bad.py::test_it_is_done_at_once[0.1]")
    assert [each.name for each in again.tests if each.outcome == "failed"] == names


@pytest.mark.slow
async def test_a_file_that_cannot_be_imported_says_why(path: Path, tests: Tests) -> None:
    path.with_name("test_bad.py").write_text("import nowhere_at_all\n" + BAD)
    found = await tests.run()
    assert "nowhere_at_all" in found.error + "".join(each.reason for each in found.tests)


@pytest.mark.slow
async def test_what_a_test_writes_among_the_results_is_no_result(path: Path, tests: Tests) -> None:
    writes = 'import sys\n(file,) = [each[15:] for each in sys.argv if each.startswith("--hfsm-results")]\n'
    path.with_name("test_bad.py").write_text(
        f"# waits.xml\n{writes}open(file, 'a').write('{{\"name\": 3}}\\nwhatever\\n' + '[' * 10000 + '\\n')\n"
        "def test_it(): pass\n"
    )
    found = await tests.run()
    assert outcomes(found)["test_it"] == "passed"


@pytest.mark.slow
async def test_a_test_that_deletes_the_folder_of_temporary_files_is_an_error_and_others_run(
    path: Path, tests: Tests
) -> None:
    bad = path.with_name("test_bad.py")
    bad.write_text(
        "# waits.xml\nimport shutil, tempfile\ndef test_it():\n    shutil.rmtree(tempfile.gettempdir())\n"
    )
    ended = await tests.run()
    assert "No such file or directory" in ended.error
    bad.unlink()
    assert set(outcomes(await tests.run()).values()) == {"passed"}


@pytest.mark.slow
async def test_tests_are_stopped_and_what_is_done_is_kept(path: Path, tests: Tests) -> None:
    path.with_name("test_last.py").write_text("# waits.xml\ndef test_it():\n    while True: pass\n")
    names = ["tests/test_waits.py::test_it_waits", "behaviors/test_last.py::test_it"]
    await tests.service.start(tests.source, names)
    await tests.pushes.until(lambda: outcomes(tests.now)["test_it_waits"] == "passed")
    below = children("pytest")
    assert below
    with pytest.raises(VisualHfsmError, match="run already"):
        await tests.service.start(tests.source)
    await tests.service.stop(1)
    assert_gone(below)
    assert tests.now.status == "idle"
    assert tests.now.error == ""
    assert outcomes(tests.now)["test_it_waits"] == "passed"


async def test_a_document_without_tests_says_where_they_would_be(path: Path, tests: Tests) -> None:
    (path.parents[1] / "tests" / "test_waits.py").unlink()
    with pytest.raises(VisualHfsmError, match=r"test_\*.py"):
        await tests.service.start(tests.source)


async def test_without_pytest_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch, tests: Tests) -> None:
    monkeypatch.setitem(sys.modules, "pytest", None)
    with pytest.raises(VisualHfsmError, match="visualhfsm\\[test\\]"):
        await tests.service.start(tests.source)


@pytest.mark.slow
def test_no_tests_run_after_they_were_stopped_or_their_tab_closed_whatever_is_asked_meanwhile(
    path: Path,
) -> None:
    path.with_name("test_long.py").write_text("# waits.xml\ndef test_it():\n    while True: pass\n")

    async def go_on(seed: int) -> None:
        tests = Tests(path)
        asked, closing = 0, False

        async def run() -> None:
            nonlocal asked
            asked += 1
            await tests.service.start(tests.source)

        async def stop() -> None:
            before = asked
            await tests.service.stop(1)
            assert asked != before or closing or not children("pytest")

        async def close() -> None:
            nonlocal closing
            closing = True  # this ends them now, not who stops them then
            await tests.service.forget(1)

        look = partial(tests.service.find, tests.source)
        try:
            await interleave(random.Random(seed), [run, stop, look, run, stop, close, run])
            assert not children("pytest")
            with pytest.raises(VisualHfsmError, match="the document was closed"):
                await tests.service.start(tests.source)
        finally:
            await tests.service.close()

    for seed in range(repeated(6, soak=1000)):
        asyncio.run(go_on(seed))
