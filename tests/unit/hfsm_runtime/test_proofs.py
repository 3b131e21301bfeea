"""What proofs rely on, and is not so while a component runs: it is reported, and fails a test and a trial."""

from __future__ import annotations

import os
import re
import threading
from pathlib import Path

import pytest

from codegen.logic import PROOFS
from hfsm_runtime import VirtualRun
from hfsm_runtime._limits import RuntimeLimits
from hfsm_runtime._runtime import Runtime
from hfsm_runtime.errors import DefinitionError
from hfsm_runtime.observer import Observer
from hfsm_runtime.tree import Actor
from hfsm_runtime.virtual.errors import BehaviorFailed
from tests.support.documents import compile_to, load
from tests.support.limits import EVENT_LIMIT
from tests.support.waiting import until
from tests.support.wrong_proofs import ALL, Wrong
from visualhfsm.simulation import Behavior
from visualhfsm.testing._plugin import MakeBehavior
from visualhfsm.trials import Plan, Success
from visualhfsm.trials._trial import run_trial
from zenoh_ice import WallClock

SECONDS = 2.5
every_proof = pytest.mark.parametrize("wrong", ALL.values(), ids=ALL.keys())


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "wrong.xml"


@every_proof
def test_a_proof_that_is_wrong_fails_a_test(
    wrong: Wrong, path: Path, behavior: MakeBehavior, monkeypatch: pytest.MonkeyPatch
) -> None:
    path.write_text(wrong.text)
    wrong.patch(monkeypatch)
    b = behavior(path)
    with pytest.raises(BehaviorFailed, match=wrong.reported):
        b.advance(SECONDS)
    assert any(re.search(wrong.reported, each.message) for each in b.errors)
    assert not b.ended.is_set()


@every_proof
def test_a_proof_that_is_wrong_fails_a_trial(
    wrong: Wrong, path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path.write_text(wrong.text)
    wrong.patch(monkeypatch)
    outcome = run_trial(
        Plan(document=str(path), robot="none", limit=SECONDS, success=Success(properties=False)), 1
    )
    assert not outcome.success
    assert re.search(wrong.reported, outcome.error)


class Reports(Observer):
    """Waits until something is reported that matches."""

    def __init__(self, pattern: str) -> None:
        self.pattern = pattern
        self.found = threading.Event()

    def proof_failed(self, actor: Actor | None, message: str) -> None:
        if re.search(self.pattern, message):
            self.found.set()


@pytest.mark.slow
@every_proof
def test_a_proof_that_is_wrong_is_reported_on_threads(
    wrong: Wrong, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    wrong.patch(monkeypatch)
    runtime = Runtime(load(compile_to(tmp_path, wrong.text)), WallClock())
    reports = Reports(wrong.reported)
    runtime.tree.observers.append(reports)
    runtime.start()
    try:
        assert reports.found.wait(EVENT_LIMIT), [each.message for each in runtime.errors]
    finally:
        runtime.stop()
    assert not runtime.failed


@pytest.mark.slow
def test_a_cycle_that_never_ends_is_reported_where_something_is_proved_to_come(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("codegen.hfsm.model_checker._checker.slow_code", lambda _: ((), ()))
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    text = f"""<VisualHFSM>
      <properties><property kind="eventually"><name>b comes</name><expression>b</expression></property></properties>
      <SubAutomata id="1" idFather="0"><iteration_time>20</iteration_time>
        <state id="1" initial="true"><name>a</name><code>open({str(pipe)!r}).read()</code></state>
        <state id="2"><name>b</name></state>
        <transition id="1"><origin>1</origin><destiny>2</destiny><trans type="time">100</trans></transition>
      </SubAutomata>
    </VisualHFSM>"""
    runtime = Runtime(
        load(compile_to(tmp_path, text)), WallClock(), limits=RuntimeLimits(hangs=0.1, stop=0.1)
    )
    reports = Reports(r"the proof of `b comes` is wrong here: the cycle of .* in the state `a` does not end")
    runtime.tree.observers.append(reports)
    runtime.start()
    try:

        def is_noticed() -> bool:
            runtime.look_at_cycles()
            return reports.found.is_set()

        until(is_noticed)
        assert not runtime.failed
    finally:
        pipe.write_text("")
        until(lambda: not runtime.in_cycle)
        runtime.stop()


@pytest.mark.parametrize("right", [each for each in ALL.values() if "stated" not in each.text])
def test_nothing_is_reported_of_right_proofs(right: Wrong, path: Path, behavior: MakeBehavior) -> None:
    path.write_text(right.text)
    b = behavior(path)
    b.advance(SECONDS)
    assert not b.errors


SLOW = """<VisualHFSM>
  <properties><property kind="never"><expression>a/b</expression><within>100</within></property></properties>
  <SubAutomata id="1" idFather="0">
    <state id="1" initial="true"><name>a</name><child>2</child><code>self.sleep(0.2)</code></state>
    <iteration_time>250</iteration_time>
  </SubAutomata>
  <SubAutomata id="2" idFather="1">
    <state id="1" initial="true"><name>c</name></state>
    <state id="2"><name>d</name></state>
    <state id="3"><name>b</name></state>
    <transition id="1"><origin>1</origin><destiny>2</destiny><trans type="condition">True</trans></transition>
    <transition id="2"><origin>2</origin><destiny>3</destiny><trans type="condition">True</trans></transition>
    <iteration_time>150</iteration_time>
  </SubAutomata>
</VisualHFSM>"""


def test_a_cycle_that_ends_after_the_time_of_a_property_does_not_refute_it(
    path: Path, behavior: MakeBehavior
) -> None:
    path.write_text(SLOW)
    b = behavior(path)
    b.advance(0.3)
    assert b.state("a") == "b"
    assert not b.errors


def meddled(b: Behavior, how: str) -> None:
    """Do something that no proof allows for."""
    match how:
        case "force":
            b.force(1, 1)
        case "set":
            b.set(1, n=2)
        case "guard":
            b.guard(b.guards[0], True)
        case "pause":
            b.pause()
            b.resume()
        case "function":
            b.component.near = lambda: True


@pytest.mark.parametrize("how", ["force", "set", "guard", "pause", "function"])
def test_nothing_is_reported_after_what_no_proof_allows_for(
    how: str, path: Path, behavior: MakeBehavior, monkeypatch: pytest.MonkeyPatch
) -> None:
    functions = "<functions>def near(self):\n    return True\n</functions>"
    path.write_text(ALL["state"].text.replace("</SubAutomata>", f"{functions}</SubAutomata>"))
    ALL["state"].patch(monkeypatch)
    b = behavior(path)
    meddled(b, how)
    b.advance(SECONDS)
    assert b.active == "run"
    assert not b.errors


@pytest.mark.parametrize("also_sends", [False, True])
def test_after_an_exception_only_events_are_reported(
    also_sends: bool, path: Path, behavior: MakeBehavior, monkeypatch: pytest.MonkeyPatch
) -> None:
    wrong = ALL["code" if also_sends else "state"]
    raises = "<exit>pass</exit><entry>1 / 0</entry>"
    path.write_text(wrong.text.replace("<name>ask</name>", f"<name>ask</name>{raises}"))
    wrong.patch(monkeypatch)
    b = behavior(path, on_error="continue")
    if also_sends:
        with pytest.raises(BehaviorFailed, match=wrong.reported) as failed:
            b.advance(SECONDS)
        assert str(failed.value).count("is wrong here") == 1
    else:
        b.advance(SECONDS)
    assert b.active == "run"


def test_an_event_that_a_test_sends_is_not_the_codes(path: Path, behavior: MakeBehavior) -> None:
    path.write_text(ALL["code"].text.replace('self.send("go")', "pass"))
    b = behavior(path)
    b.send("go")
    b.advance(SECONDS)
    assert b.active == "run"
    assert not b.errors


def test_a_state_in_which_a_run_begins_is_not_called_impossible(path: Path, tmp_path: Path) -> None:
    text = ALL["code"].text.replace('self.send("go")', "pass")
    run = VirtualRun(load(compile_to(tmp_path, text)), starts=False)
    run.begin_at(1, 2)
    run.start()
    run.advance(SECONDS)
    assert run.active == "run"
    assert not run.errors


@pytest.mark.parametrize("row", [("event", "go"), ("guard", 1, 1, 1, "near", True)], ids=lambda row: row[0])
def test_a_component_of_another_version_does_not_start(row: tuple[object, ...], tmp_path: Path) -> None:
    component = load(compile_to(tmp_path, ALL["code"].text))
    vars(component)[PROOFS] = (row,)
    with pytest.raises(DefinitionError, match="generate it again"):
        VirtualRun(component)


def test_what_is_reported_names_the_line_and_the_properties(
    path: Path, behavior: MakeBehavior, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = ALL["code"].text.replace("<VisualHFSM>", f"<VisualHFSM>{STATED}")
    path.write_text(text)
    ALL["code"].patch(monkeypatch)
    b = behavior(path)
    with pytest.raises(BehaviorFailed):
        b.advance(SECONDS)
    first = b.errors[0]
    assert first.message.startswith("the proof of `never runs` is wrong here: the state `ask` sent `go`, and")
    line = next(number for number, each in enumerate(text.split("\n"), 1) if "self.send" in each)
    assert first.location.endswith(f"(wrong.xml:{line})")
    assert len({each.message for each in b.errors}) == len(b.errors)


STATED = (
    '<properties><property kind="never"><name>never runs</name><expression>run</expression></property>'
    "</properties>"
)
