"""Lines of code that tests run: measured in the component, and found again in the document."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.coroutines import Loop
from tests.support.documents import document, state, sub, transition
from tests.support.running_tests import Tests, outcomes, running
from tests.support.soak import cases
from visualhfsm._processes.test_results import TestsPush

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
TESTS = """
def test_it_waits(behavior):
    behavior("waits.xml").advance(0.2)


def test_it_is_done_soon(behavior):
    behavior("waits.xml").run_until("done", limit=1.0)


def test_it_breaks(behavior):
    behavior("waits.xml").advance(1.0)
"""


@pytest.fixture
def path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The document, in a folder with its tests."""
    monkeypatch.delenv("COVERAGE_PROCESS_CONFIG", raising=False)  # else these processes are measured already
    folder = tmp_path / "behaviors"
    folder.mkdir()
    (tmp_path / "pyproject.toml").write_text("[tool.pytest.ini_options]\n")
    (folder / "test_waits.py").write_text(TESTS)
    (folder / "waits.xml").write_text(COUNTS)
    return folder / "waits.xml"


@pytest.fixture
def tests(path: Path, loop: Loop) -> Tests:
    return loop.enter(running(path))


def lines(push: TestsPush) -> dict[tuple[str, int], tuple[tuple[int, ...], ...]]:
    return {(each.place.part, each.place.id): (each.passed, each.missed, each.failed) for each in push.code}


@pytest.mark.slow
async def test_lines_of_code_are_passed_missed_or_marked_as_failed(path: Path, tests: Tests) -> None:
    found = await tests.run("behaviors/test_waits.py::test_it_waits")
    assert lines(found) == {
        ("functions", 0): ((), (3,), ()),  # neither `def` nor what it says of itself
        ("variables", 0): ((1,), (), ()),
        ("code", 1): ((1, 2, 3, 5, 7, 9), (6,), ()),
        ("code", 2): ((), (1,), ()),
        ("trigger", 4): ((1,), (), ()),
        ("trigger", 5): ((), (1,), ()),
    }
    asked = [(each.id, each.count, each.asked, each.held) for each in found.passed if each.kind != "state"]
    assert asked == [(4, 0, 3, 0)]
    assert found.unmeasured == ""
    # What another test passes counts, too, and code that has changed meanwhile is other code.
    path.write_text(COUNTS.replace("self.rounds += 1", "\nself.rounds += 1"))
    found = await tests.run(
        *(f"behaviors/test_waits.py::{each}" for each in ("test_it_is_done_soon", "test_it_breaks"))
    )
    assert lines(found)["trigger", 4] == ((1,), (), ())
    of_state = [each for each in found.code if (each.place.part, each.place.id) == ("code", 1)]
    assert sorted(each.passed[-1] for each in of_state) == [9, 10]
    assert len({each.version for each in of_state}) == 2
    # A line that fails is marked, and the one that led to it.
    assert outcomes(found)["test_it_breaks"] == "failed"
    assert lines(found)["functions", 0] == ((), (), (3,))
    assert lines(found)["code", 2] == ((), (), (1,))
    assert [(each.id, each.failed) for each in found.passed if each.kind == "state"] == [
        (1, False),
        (2, True),
    ]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("what", "words"),
    cases(
        [
            ("sys.modules['coverage'] = None", "pip install 'visualhfsm[test]'"),
            ("import coverage; coverage.Coverage(data_file=None).start()", "another program"),
        ],
        [pytest.param("sys.settrace(lambda *_: None)", "another program")],
    ),
)
async def test_it_says_why_lines_are_not_measured(path: Path, what: str, words: str, tests: Tests) -> None:
    (path.parents[1] / "conftest.py").write_text(f"import sys\n{what}\n")
    found = await tests.run()
    assert outcomes(found)["test_it_waits"] == "passed"
    assert found.code == ()
    assert words in found.unmeasured
