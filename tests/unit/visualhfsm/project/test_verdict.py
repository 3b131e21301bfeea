"""The verdict on a document: what is not ready, in the order of what to fix first, and what leaves it ready."""

from __future__ import annotations

import importlib.util
import os
import re
from collections.abc import Iterator
from importlib.machinery import ModuleSpec
from pathlib import Path
from typing import Final

import msgspec
import pytest

from tests.support.documents import document, state, sub, transition
from tests.support.limits import RUN_LIMIT
from visualhfsm import EditError, OpenDocument, Place, Project, Reason, SetText, Verdict, VisualHfsmError
from visualhfsm._document.reasons import summary
from visualhfsm.trials import Archive, Outcome

pytestmark = pytest.mark.slow

GO: Final = Place(kind="state", automaton=1, id=2, part="code")
AFTER: Final = transition(3, 1, 2, "500", type="time", name="soon")


SENSES: Final = "".join(
    f"<iceinterface><nameinterface>{name}</nameinterface><nameproxy>{name}</nameproxy><ip>localhost</ip>"
    f"<port>7447</port><interface>{name}</interface></iceinterface>"
    for name in ("Motors", "Battery")
)
LOW: Final = '<survives part="Battery" kind="low"{}/>\n'


def moves(code: str = "", *, libraries: tuple[str, ...] = (), properties: str = "") -> str:
    """Return a document that goes from `wait` to `go` after 0.5 s, where it runs some code."""
    return document(
        sub(1, 0, state(1, "wait", initial=True), state(2, "go", code), AFTER),
        libraries=libraries,
        head=f"<properties>{properties}</properties>",
    )


def stated(name: str, kind: str, expression: str) -> str:
    return f'<property kind="{kind}"><name>{name}</name><expression>{expression}</expression></property>'


@pytest.fixture(scope="module")
def root(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("verdicts")


@pytest.fixture(scope="module")
def project(root: Path) -> Iterator[Project]:
    """Have one project for all tests, whose processes last from verdict to verdict."""
    with Project(root, journals=root / ".journals") as opened:
        Judged(opened, root).verdict(moves())
        opened.documents[0].close()
        yield opened


class Judged:
    """A folder with a document and its tests, of which verdicts are asked."""

    def __init__(self, project: Project, folder: Path) -> None:
        self.project = project
        self.folder = folder
        self.opened: OpenDocument | None = None

    def write(self, text: str, tests: str = "") -> Path:
        (self.folder / "pyproject.toml").write_text("[tool.pytest.ini_options]\naddopts = '-p no:anyio'\n")
        path = self.folder / "moves.xml"
        path.write_text(text, encoding="utf-8")
        if tests:
            (self.folder / "test_moves.py").write_text(f'"""Tests of moves.xml."""\n{tests}')
        return path

    def open(self, text: str, tests: str = "") -> OpenDocument:
        self.opened = self.project.open(self.write(text, tests))
        return self.opened

    def verdict(self, text: str, tests: str = "", *, patience: float = RUN_LIMIT) -> Verdict:
        return self.open(text, tests).verdict(seconds=1.0, patience=patience)

    def reason(self, text: str, tests: str = "", *, patience: float = RUN_LIMIT) -> Reason:
        verdict = self.verdict(text, tests, patience=patience)
        assert not verdict.ready
        (reason,) = verdict.reasons
        return reason


@pytest.fixture
def alone(tmp_path: Path) -> Iterator[Judged]:
    """Have a folder whose processes are of one test, which ends them."""
    with Project(tmp_path, journals=tmp_path / ".journals") as opened:
        yield Judged(opened, tmp_path)


@pytest.fixture
def judged(project: Project, root: Path, request: pytest.FixtureRequest) -> Iterator[Judged]:
    folder = root / request.node.originalname
    folder.mkdir(exist_ok=True)
    made = Judged(project, folder)
    yield made
    if made.opened is not None:
        made.opened.close(discard=True)


# -- ready -------------------------------------------------------------------------------------------------


def test_it_is_ready_when_all_agree(judged: Judged) -> None:
    tests = "def test_it(behavior):\n    behavior('moves.xml').run_until('go', limit=1.0)\n"
    properties = stated("arrives", "eventually", "go")
    verdict = judged.verdict(moves("unread = 1", properties=properties), tests)
    assert (verdict.ready, verdict.reasons) == (True, ())
    assert (verdict.document, verdict.tests, verdict.seconds) == ("moves.xml", 1, 1.0)
    assert (verdict.proved, verdict.undecided, verdict.missed) == (("arrives",), (), ())
    (warning,) = verdict.warnings
    assert (warning.found, warning.line, warning.state) == ("checks", 4, "go")
    assert judged.opened is not None
    again = judged.opened.verdict(seconds=1.0)
    assert again == verdict
    (judged.folder / "helper.py").write_text("ANGLE = 0.5\n")
    assert judged.opened.verdict(seconds=1.0).digest != verdict.digest


def test_a_property_that_the_model_checker_cannot_decide_leaves_it_ready(judged: Judged) -> None:
    late = transition(5, 1, 4, "700", type="time")
    waits = state(1, "wait", "self.sleep(0.2)", initial=True)
    text = document(
        sub(1, 0, waits, state(2, "go"), state(4, "late"), AFTER, late),
        head=f"<properties>{stated('prompt', 'never', 'late')}</properties>",
    )
    verdict = judged.verdict(text)
    assert (verdict.ready, verdict.proved, verdict.undecided) == (True, (), ("prompt",))
    assert verdict.missed == ("late",)


def counting(guard: str, code: str = "") -> str:
    """Return a document whose state `bad` is entered when a guard holds, of a number from 0 to 3."""
    way = transition(3, 1, 2, guard, type="condition")
    return document(
        sub(
            1,
            0,
            state(1, "count", "n = (n + 1) % 4", initial=True),
            state(2, "bad", code),
            way,
            variables="n = 0",
        ),
        head=f"<properties>{stated('never bad', 'never', 'bad')}</properties>",
    )


def test_what_only_a_guard_would_violate_that_never_held_in_the_run_leaves_it_ready(judged: Judged) -> None:
    verdict = judged.verdict(counting("n == 4"))
    assert (verdict.ready, verdict.reasons, verdict.not_shown) == (True, (), ("never bad",))


def test_what_a_guard_violates_in_the_run_is_not_ready(judged: Judged) -> None:
    verdict = judged.verdict(counting("n == 3"))
    assert [reason.found for reason in verdict.reasons] == ["run"]
    assert "never bad" in verdict.reasons[0].message


def test_what_only_a_guard_would_violate_is_said_where_nothing_is_run(judged: Judged) -> None:
    verdict = judged.verdict(counting("n == 4", "x ="))
    assert not verdict.ready
    assert verdict.not_shown == ()


# -- what checks and the model checker find ----------------------------------------------------------------


def test_no_code_of_a_document_with_errors_is_run(judged: Judged) -> None:
    wrote = judged.folder / "wrote"
    code = f"open({str(wrote)!r}, 'w')\nprint('a' 'b'"
    tests = f"def test_it():\n    open({str(wrote)!r}, 'w')\n"
    reason = judged.reason(moves(code), tests)
    assert (reason.found, reason.file, reason.line, reason.state) == ("checks", "moves.xml", 5, "go")
    assert (reason.where, reason.place) == ("code of go, line 2", GO)
    assert not wrote.exists()


def test_a_violated_property_has_the_steps_that_lead_there(judged: Judged) -> None:
    properties = stated("stays", "never", "go") + stated("starts", "eventually", "wait")
    verdict = judged.verdict(moves(properties=properties))
    (reason,) = verdict.reasons
    assert (reason.found, reason.state) == ("model checker", "go")
    assert reason.message.startswith("`stays` is violated")
    assert [step.split() for step in reason.steps] == [
        ["0.000", "s", "`wait`", "is", "entered"],
        ["0.500", "s", "`wait`", "->", "`go`", "by", "`soon`"],
    ]
    assert verdict.proved == ("starts",)


def test_an_error_in_an_imported_file_is_one_of_that_file(judged: Judged) -> None:
    (judged.folder / "part.xml").write_text(document(sub(1, 0, state(1, "in", "x =", initial=True))))
    text = document(
        sub(1, 0, state(1, "wait", initial=True, child=2)),
        '<SubAutomata id="2" idFather="1"><import>part.xml</import></SubAutomata>\n',
    )
    reason = judged.reason(text)
    assert (reason.found, reason.file, reason.line) == ("checks", "part.xml", 1)
    assert "in" in reason.where


# -- the run -----------------------------------------------------------------------------------------------


def test_a_run_that_raises_says_where(judged: Judged) -> None:
    reason = judged.reason(moves("names = {}\nself.log.info(names['a'])"))
    assert (reason.found, reason.file, reason.line, reason.state) == ("run", "moves.xml", 5, "go")
    assert "KeyError" in reason.message
    assert any("wait -> go" in step for step in reason.steps)


def test_a_run_that_hangs_is_ended(alone: Judged) -> None:
    reason = alone.reason(moves("while self.clock is not None: pass"), patience=2.0)
    assert (reason.found, reason.hints) == ("run", ("see it in a dry run: visualhfsm edit moves.xml",))
    assert "took more than 2 s" in reason.message


def test_a_run_that_ends_its_process_is_not_ready(alone: Judged) -> None:
    reason = alone.reason(moves("os._exit(0)", libraries=("import os",)))
    assert (reason.found, reason.message) == ("run", "a run in virtual time failed: ended its process")


def test_a_run_without_a_library_says_how_to_install_it(judged: Judged) -> None:
    reason = judged.reason(moves(libraries=("import nosuchlib",)))
    assert (reason.found, reason.file) == ("run", "moves.xml")
    assert reason.message.endswith("the library nosuchlib is not installed: try `pip install nosuchlib`")


def test_what_is_found_by_a_run_comes_before_what_tests_find(judged: Judged) -> None:
    verdict = judged.verdict(moves("raise ValueError"), "def test_it():\n    raise OSError\n")
    assert [reason.found for reason in verdict.reasons] == ["run", "tests"]


# -- the tests ---------------------------------------------------------------------------------------------


def test_a_test_that_fails_says_where_and_how_the_behavior_got_there(judged: Judged) -> None:
    tests = (
        "def test_good(behavior):\n    behavior('moves.xml').advance(0.1)\n\n"
        "def test_bad(behavior):\n    behavior('moves.xml').run_until('go', limit=0.2)\n"
    )
    verdict = judged.verdict(moves(), tests)
    (reason,) = verdict.reasons
    name = "test_moves.py::test_bad"
    assert (reason.found, reason.where, verdict.tests) == ("tests", name, 1)
    assert (reason.file, reason.line) == ("test_moves.py", 6)
    assert reason.hints == (f"run it alone: pytest {name}",)
    assert any("enters wait" in step for step in reason.steps)


def test_tests_that_are_no_python_say_where(judged: Judged) -> None:
    reason = judged.reason(moves(), "def test_it(behavior):\n    def (:\n")
    assert (reason.found, reason.file, reason.line) == ("tests", "test_moves.py", 3)
    assert "SyntaxError" in reason.message


def test_a_test_that_hangs_is_ended(judged: Judged) -> None:
    tests = "def test_it():\n    while True: pass\n"
    verdict = judged.verdict(moves(), tests, patience=3.0)
    reason = verdict.reasons[-1]
    assert (reason.found, reason.message) == ("tests", "the tests took more than 3 s")
    assert reason.where == "test_moves.py::test_it"


@pytest.mark.parametrize("code", [0, 3])
def test_a_test_that_ends_pytest_is_none_that_passed(judged: Judged, code: int) -> None:
    tests = f"import os\n\ndef test_good(): ...\n\ndef test_end():\n    os._exit({code})\n"
    reason = judged.reason(moves(), tests)
    assert (reason.found, reason.where) == ("tests", "test_moves.py::test_end")
    assert reason.message == f"pytest ended with {code}, and did not say how all tests went"


WRITES: Final = """
import sys

def test_it():
    [name] = [each[15:] for each in sys.argv if each.startswith('--hfsm-results')]
    open(name, 'w').write('[')
"""


@pytest.mark.parametrize(
    "tests",
    [
        "def test_it(:\n",
        "import nowhere\n\ndef test_it(): ...\n",
        WRITES,
        "import shutil, tempfile\n\ndef test_it():\n    shutil.rmtree(tempfile.gettempdir())\n",
    ],
    ids=["no Python", "import", "writes results", "deletes results"],
)
def test_tests_that_do_not_say_how_they_went_are_none_that_passed(judged: Judged, tests: str) -> None:
    verdict = judged.verdict(moves(), tests)
    assert (verdict.ready, verdict.tests) == (False, 0)
    assert [reason.found for reason in verdict.reasons] == ["tests"]
    (reason,) = verdict.reasons
    assert reason.where or reason.steps


def test_tests_without_pytest_say_how_to_install_it(judged: Judged, monkeypatch: pytest.MonkeyPatch) -> None:
    genuine = importlib.util.find_spec

    def find(name: str, package: str | None = None) -> ModuleSpec | None:
        return None if name == "pytest" else genuine(name, package)

    monkeypatch.setattr("importlib.util.find_spec", find)
    reason = judged.reason(moves(), "def test_it(): ...\n")
    assert (reason.found, "pip install 'visualhfsm[test]'" in reason.message) == ("tests", True)


# -- files that change -------------------------------------------------------------------------------------


CHANGES: Final = """
from pathlib import Path

def test_it(behavior):
    Path({file!r}).write_text({text!r})
    assert "moves" == Path(__file__).parent.name
    behavior("moves.xml").advance(0.6)
"""


@pytest.mark.parametrize(
    ("name", "text"),
    [("moves.xml", moves("raise OSError")), ("helper.py", "raise OSError"), ("test_moves.py", "")],
)
def test_files_that_change_meanwhile_are_judged_as_they_were_read(
    judged: Judged, name: str, text: str
) -> None:
    folder = judged.folder / "moves"
    folder.mkdir(exist_ok=True)
    judged.folder = folder
    (folder / "helper.py").write_text("ANGLE = 0.5\n")
    (folder / "test_z.py").write_text(
        '"""moves.xml"""\n\ndef test_z(behavior):\n    import helper\n    behavior("moves.xml").advance(0.6)\n'
    )
    verdict = judged.verdict(
        moves("helper.ANGLE", libraries=("import helper",)),
        CHANGES.format(file=str(folder / name), text=text),
    )
    assert (verdict.ready, verdict.tests) == (True, 2), verdict
    assert (folder / name).read_text() == text
    assert judged.opened is not None
    judged.opened.refresh()
    changed = judged.opened.verdict(seconds=1.0)
    assert (changed.digest == verdict.digest) == (name == "test_moves.py")
    assert changed.ready == (name == "test_moves.py")


def test_tests_find_what_stands_elsewhere_in_the_project(judged: Judged) -> None:
    (judged.folder / "data.bin").write_bytes(b"1")
    (judged.folder / "parts").mkdir(exist_ok=True)
    (judged.folder / "parts" / "__init__.py").write_text("X = 1\n")
    (judged.folder / "tests").mkdir(exist_ok=True)
    (judged.folder / "tests" / "conftest.py").write_text("import sys; sys.path.insert(0, '.')\n")
    (judged.folder / "tests" / "test_more.py").write_text(
        "from pathlib import Path\nimport parts\n\ndef test_it(behavior):\n"
        "    assert (Path(__file__).parents[1] / 'data.bin').read_bytes() == b'1'\n"
        "    behavior('moves.xml').advance(parts.X)\n"
    )
    verdict = judged.verdict(moves())
    assert (verdict.ready, verdict.tests) == (True, 1), verdict


def test_a_document_without_a_file_is_refused(project: Project) -> None:
    made = project.new()
    try:
        with pytest.raises(EditError, match="it has no file yet; save it first"):
            made.verdict()
    finally:
        made.close(discard=True)


def test_changes_that_are_not_saved_are_refused(judged: Judged) -> None:
    opened = judged.open(moves())
    opened.apply(SetText(place=GO, text="raise ValueError"))
    with pytest.raises(EditError, match="changes that are not saved; save it first"):
        opened.verdict()
    opened.save()
    assert not opened.verdict(seconds=1.0).ready


# -- what others say of the same errors --------------------------------------------------------------------


def test_a_document_with_errors_is_refused_in_the_words_of_its_verdict(judged: Judged) -> None:
    imported = '<SubAutomata id="2" idFather="1"><import>part.xml</import></SubAutomata>\n'
    for text in (
        moves("print('a' 'b'"),
        moves("x = 1\nself.Haed.stop()\ny ="),
        moves(properties=stated("stays", "never", "go")),
        document(sub(1, 0, state(1, "wait", initial=True, child=2)), imported),
    ):
        (judged.folder / "part.xml").write_text(document(sub(1, 0, state(1, "in", "x =", initial=True))))
        opened = judged.open(text)
        verdict = opened.verdict()
        with pytest.raises(VisualHfsmError) as refused:
            opened.generate()
        assert str(refused.value) == f"It is not ready: {summary(verdict.reasons)}"
        assert verdict.reasons[0].code.startswith("E")
        assert verdict.reasons[0].said in str(refused.value)
        opened.close()


def test_nothing_of_a_document_that_may_not_run_is_run(judged: Judged) -> None:
    wrote = judged.folder / "wrote"
    opened = judged.open(
        moves(f"open({str(wrote)!r}, 'w')"), f"def test_it():\n    open({str(wrote)!r}, 'w')\n"
    )

    def refuse(archive: Archive) -> None:
        raise EditError("Cannot run", archive.document)

    with pytest.raises(EditError, match=r"moves\.xml"):
        opened.verdict(seconds=1.0, allow=refuse)
    assert not wrote.exists()


# -- what it must survive ----------------------------------------------------------------------------------


def walks(then: str, *survives: str) -> str:
    """Return a document that walks, runs code once its battery is low, and states what it survives."""
    return document(
        sub(
            1,
            0,
            state(1, "walks", "self.Motors.setV(0.1)", initial=True),
            state(2, "tired", then),
            transition(3, 1, 2, "self.Battery.getBatteryReading().charge < 0.1"),
        ),
        config=SENSES,
        head="\n" + "".join(survives),
    )


STOPS: Final = "self.Motors.setV(0.0)"
HANGS: Final = f"{STOPS}\nself.sleep(60.0)"
WALKS_ON: Final = "self.Motors.setV(0.1)"


@pytest.mark.parametrize(
    ("then", "more", "held", "fate"),
    [
        (STOPS, "", True, ("stopped", 2.1)),
        (STOPS, ' after="1.5"', True, ("stopped", 1.6)),
        (STOPS, ' must="succeed"', False, ("stopped", 2.1)),
        (WALKS_ON, ' must="succeed"', True, ("succeeded", 5.0)),
        (HANGS, "", False, ("hung", 2.1)),
        (STOPS, ' amount="0.5"', True, ("succeeded", 5.0)),  # which it need not notice
    ],
)
def test_it_is_held_to_what_it_must_survive(
    judged: Judged, then: str, more: str, held: bool, fate: tuple[str, float]
) -> None:
    verdict = judged.open(walks(then, LOW.format(more))).verdict(seconds=3.0)
    (survival,) = verdict.survivals
    assert (survival.held, survival.fate) == (held, fate[0])
    assert survival.seconds == pytest.approx(fate[1], abs=0.21)
    assert verdict.ready == held
    assert [(each.found, each.line, each.place) for each in verdict.reasons] == (
        [] if held else [("survives", 2, Place(kind="document", part="survives"))]
    )


@pytest.mark.parametrize(
    ("survives", "said"),
    [
        ('<survives part="Knee" kind="stuck"/>', "Knee cannot fail: there is no part 'Knee' .* LKneePitch"),
        ('<survives part="Battery" kind="stuck"/>', "Battery cannot fail: .* it can be low"),
        (LOW.format(' amount="3"'), "the amount is 3, and must be from 0 to 1"),
    ],
)
def test_a_failure_that_its_robot_cannot_have_is_said_with_those_that_there_are(
    judged: Judged, survives: str, said: str
) -> None:
    reason = judged.reason(walks(STOPS, survives))
    assert re.search(said, reason.message)
    assert (reason.found, reason.file, reason.line) == ("survives", "moves.xml", 2)


def test_a_failure_that_comes_after_its_end_is_no_trial(judged: Judged) -> None:
    text = document(
        sub(
            1,
            0,
            state(1, "wait", initial=True),
            state(2, "end").replace("<code>", "<final>true</final><code>"),
            AFTER,
        ),
        config=SENSES,
        head="\n" + LOW.format(""),
    )
    assert judged.reason(text).message.startswith("it ended at 0.5 s, before Battery low")


def test_the_plan_beside_it_says_what_is_a_success(judged: Judged) -> None:
    (judged.folder / "moves.trials.toml").write_text('robot = "fake"\nlimit = 3\nsuccess.state = "tired"\n')
    verdict = judged.verdict(walks(WALKS_ON, LOW.format(' must="succeed"'), LOW.format(' amount="0.5"')))
    assert [(each.failure, each.fate) for each in verdict.survivals] == [
        ("Battery low", "succeeded"),
        ("Battery low 0.5", "failed"),
    ]


def test_all_failures_together_have_a_limit_of_time(judged: Judged) -> None:
    endless = walks("while self:\n    pass", LOW.format(""), LOW.format(' amount="0.08"'))
    first, second = judged.verdict(endless, patience=4.0).reasons
    assert re.search(r"with Battery low it hung .*: took more than \d", first.message)
    assert second.message == "no time is left for Battery low 0.08: all failures took 4 s"


def test_what_was_never_tried_is_counted_with_the_command_that_tries_it(judged: Judged) -> None:
    path = judged.write(walks(STOPS, LOW.format("")))
    opened = judged.open(path.read_text())
    before = opened.verdict(seconds=1.0).never_tried
    assert before is not None
    assert (before.all - before.count, before.sweep) == (1, "visualhfsm sweep moves.xml")
    swept = Outcome(number=1, values={"failure": "Camera black"}, success=True)
    kept = judged.folder / "moves.sweep.outcomes.jsonl"
    kept.write_bytes(b'{"document":"moves.xml"}\n' + msgspec.json.encode(swept) + b"\n" + b'{"cut o')
    after = opened.verdict(seconds=1.0).never_tried
    assert after is not None
    assert (after.all, after.count) == (before.all, before.count - 1)
    os.utime(kept, (1, 1))  # of what it was long ago
    old = opened.verdict(seconds=1.0).never_tried
    assert old is not None
    assert (old.count, old.sweep) == (before.count, "visualhfsm sweep moves.xml --again")
    kept.write_text("nothing\n")
    (warning,) = opened.verdict(seconds=1.0).warnings
    assert warning.message.startswith("moves.sweep.outcomes.jsonl: it is no kept sweep")


def test_of_what_uses_no_robot_nothing_was_left_out(judged: Judged) -> None:
    assert judged.verdict(moves()).never_tried is None
