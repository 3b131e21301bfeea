"""The components of tests/data/components: each shows one feature, starts, and does what its document says.

They are generated here, and are not in git. What a change of the generator changes is seen in the components of
behaviors/, which are, and in that of a small document in test_generator.py.
"""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import pytest

from codegen.diagnostics import Diagnostics, Severity
from codegen.hfsm import compile_document
from hfsm_runtime import VirtualRun
from tests.support.documents import generate, load
from tests.support.places import DATA, ROOT
from tests.support.plugins import needs
from visualhfsm.simulation import Behavior

DIRECTORY = DATA / "components"
DOCUMENTS = sorted(path.stem for path in DIRECTORY.glob("*.xml"))
DOUBTFUL = {"own_names": {"W543"}, "tolerated": {"W510", "W511", "W512", "W513"}}
IN_GIT = [
    pytest.param(path, marks=[needs("visualhfsm_match")] if "visualhfsm_match" in path.read_text() else [])
    for folder in ("behaviors", "examples")
    for path in sorted((ROOT / folder).rglob("*.py"))
    if "(Component, document=" in path.read_text()
]

behaviors: dict[str, Callable[[VirtualRun], None]] = {}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a copy of the documents, with what they need beside them."""
    return shutil.copytree(DIRECTORY, tmp_path_factory.mktemp("made") / "components")


@pytest.fixture
def made(folder: Path) -> Callable[[str], Path]:
    """Return what gives the component of a document, which is generated once."""

    def component(name: str) -> Path:
        file = folder / f"{name}.py"
        return file if file.exists() else generate(folder / f"{name}.xml", folder)

    return component


@pytest.mark.parametrize("name", DOCUMENTS)
def test_its_document_is_doubted_only_where_it_is_to_show_that(name: str) -> None:
    compile_document(DIRECTORY / f"{name}.xml", None, diagnostics := Diagnostics())
    doubts = {found.code for found in diagnostics if found.severity is not Severity.NOTE}
    assert doubts == DOUBTFUL.get(name, set())


@pytest.mark.parametrize("name", DOCUMENTS)
def test_a_component_behaves_as_its_document_says(name: str, made: Callable[[str], Path]) -> None:
    behaviors[name](VirtualRun(load(made(name))))


@pytest.mark.parametrize("name", DOCUMENTS)
def test_a_component_starts_with_stand_ins_for_what_it_uses(name: str, made: Callable[[str], Path]) -> None:
    starts(made(name))


@pytest.mark.parametrize("file", IN_GIT, ids=lambda path: path.stem)
def test_a_component_in_git_starts(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(file.parent)  # for hand-written code beside it
    starts(file)


def test_all_of_them_are_there() -> None:
    assert len(IN_GIT) > 5
    assert len(DOCUMENTS) > 10


def starts(file: Path) -> None:
    with Behavior(load(file), robot="fake", stand_ins=True) as run:
        run.advance(1.0)
        assert run.tree.root.cycle.count > 1


def behavior(check: Callable[[VirtualRun], None]) -> Callable[[VirtualRun], None]:
    """Take a function as what is to be seen of the component that it is named after."""
    behaviors[check.__name__] = check
    return check


def notes(run: VirtualRun) -> list[object]:
    """Return what a document noted."""
    found: list[object] = vars(run.component)["notes"]
    return found


@behavior
def basic(run: VirtualRun) -> None:
    run.advance(1)
    assert run.changes("work") == [(0, "count"), (0.2, "check")]
    assert run.changes("basic") == [(0, "work"), (0.3, "rest"), (0.9, "work")]


@behavior
def entry_exit(run: VirtualRun) -> None:
    run.advance(0.3)
    assert run.changes("entry_exit") == [(0, "open"), (0.2, "closed"), (0.3, "open")]
    assert notes(run) == [
        "enter open", "open", "open", "leave open", "close", "enter closed 1", "enter open", "open"
    ]  # fmt: skip


@behavior
def final_and_finished(run: VirtualRun) -> None:
    run.advance(1)
    assert run.changes("task") == [(0, "try"), (0.3, "over")]
    assert run.changes("final_and_finished") == [(0, "task"), (0.4, "done")]
    assert notes(run) == ["done"]
    assert run.finished


@behavior
def several_children(run: VirtualRun) -> None:
    run.advance(0.3)
    assert run.active_paths == ("greet/waved", "greet/speak")
    run.advance(0.2)
    assert run.changes("several_children") == [(0, "greet"), (0.5, "bow")]


@behavior
def history(run: VirtualRun) -> None:
    run.advance(1)
    assert run.changes("resumed") == [(0, "first"), (0.2, "second")]
    assert run.changes("restarted") == [(0.3, "first"), (0.5, "second"), (0.9, "first")]


@behavior
def priority(run: VirtualRun) -> None:
    run.advance(0.25)
    assert run.changes("priority") == [(0, "choose"), (0.1, "first"), (0.2, "choose")]
    ids = [transition.id for transition in run.tree.root.automaton.outgoing(run.tree.root.current)]
    assert ids == [3, 2, 1]


@behavior
def events(run: VirtualRun) -> None:
    run.advance(0.5)
    assert run.changes("events") == [(0, "watch"), (0.3, "grasp")]
    assert notes(run) == [0.4]
    run.send("stop")
    run.advance(0.1)
    assert run.finished


@behavior
def guards(run: VirtualRun) -> None:
    run.advance(0.5)
    assert run.changes("guards") == [(0, "wait"), (0.4, "called")]
    run.send("come", "later")
    run.advance(0.1)
    assert run.active == "called"
    run.send("come", "now")
    run.advance(0.3)
    assert run.active == "task/nothing to do"
    vars(run.component)["allowed"] = True
    run.advance(0.1)
    assert run.active == "end"


@behavior
def parameters(run: VirtualRun) -> None:
    vars(run.component).update(top_speed=0.5)
    run.advance(1)
    assert run.changes("parameters") == [(0, "run"), (0.7, "there")]


@behavior
def inputs_and_arguments(run: VirtualRun) -> None:
    run.advance(0.5)
    assert notes(run) == [("red", 0.5, 0), (1, ("hm",)), ("green", 1.5, 1), (2, ("hm",))]


@behavior
def outputs(run: VirtualRun) -> None:
    run.advance(1)
    first = [(False, 1.0, 0), (False, 1.0, 1), (False, 1.0, 2), "lost"]
    assert notes(run) == [*first, (False, 1.0, 0), (True, 2.0, 1), "found at 2.0 m"]


@behavior
def imports(run: VirtualRun) -> None:
    run.advance(2)
    assert run.errors == ()
    assert run.changes("near") == [(0, "go"), (0.2, "turn"), (0.4, "back")]
    assert run.changes("far") == [(0.5, "go"), (0.8, "turn"), (1.0, "back")]
    assert run.finished


@behavior
def extension(run: VirtualRun) -> None:
    run.advance(1)
    assert run.changes("extension") == [(0, "count"), (0.3, "enough")]


@behavior
def statement_condition(run: VirtualRun) -> None:
    run.advance(0.5)
    assert run.changes("statement_condition") == [(0, "go"), (0.3, "turn")]
    vars(run.component)["near"] = False
    run.advance(0.1)
    assert run.active == "go"


@behavior
def own_names(run: VirtualRun) -> None:
    run.send("rest")  # from outside: the document's own `send` has nothing to do with events
    run.advance(1)
    assert run.changes("own_names") == [(0, "work"), (0.3, "rest")]
    assert notes(run)[:3] == ["sent line", "asleep at 60", "slept, todaytoday"]
    assert len(notes(run)) == 9, "it ran three times, and no cycle slept"


@behavior
def proxies(run: VirtualRun) -> None:
    run.advance(0.5)
    assert not run.halted, "the document says to continue after an error"
    assert run.errors[0].message == "NotConnectedError: self.head (servant Head) is not connected"
    vars(run.component)["head"] = SimpleNamespace(getPose=lambda: SimpleNamespace(pan=2.0))
    run.advance(0.2)
    assert run.active == "found"


@behavior
def tolerated(run: VirtualRun) -> None:
    run.advance(0.2)
    assert run.changes("tolerated") == [(0, "same name"), (0.1, "same name"), (0.2, "")]
