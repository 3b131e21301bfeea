"""The commands for steering, with a component in the test's process."""

from __future__ import annotations

import json
import threading
from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from hfsm_runtime import Component
from hfsm_runtime._limits import RuntimeLimits
from hfsm_runtime._runtime import Runtime
from hfsm_runtime.debugger.monitor import Monitor
from interfaces.hfsm import ComponentStatus
from nao_tools._command import app as nao_app
from naoserver.fake import FakeRobot
from naoserver.options import ServerOptions
from naoserver.serving.assembly import Assembly
from tests.support.documents import compile_to, document, load, state, sub, transition
from tests.support.limits import EVENT_LIMIT
from tests.support.processes import ComponentProcess, module
from tests.support.soak import cases
from tests.support.suite import Pair
from tests.support.waiting import until
from visualhfsm._base.errors import VisualHfsmError
from visualhfsm._commands.app import app
from zenoh_ice import WallClock

PARAMETERS = "<parameters><parameter><name>speed</name><type>float</type><default>0.3</default></parameter></parameters>"


def walker(*, seconds: int = 3600, step: int = 1) -> str:
    """Return a document: follow, with red and green below it, and dance."""
    return document(
        sub(
            1, 0, state(1, "follow", initial=True, child=2), state(2, "dance", f"beats += {step}"),
            transition(1, 1, 2, "ball_lost", type="event", name="enough"),
            transition(2, 2, 1, str(1000 * seconds), type="time", name="tired"),
            variables="beats = 0", period="20",
        ),
        sub(
            2, 1, state(1, "red", "corner += 1", initial=True), state(2, "green"),
            transition(1, 1, 2, "corner < 0", name="to green"), transition(2, 2, 1, "nap", type="event"),
            variables="corner = 0", period="20",
        ),
        head=PARAMETERS, events=("ball_lost",),
    )  # fmt: skip


@dataclass
class Shell:
    """Runs commands on a component."""

    endpoint: str
    runtime: Runtime
    file: Path

    def result(self, *arguments: str) -> Any:
        return CliRunner().invoke(app, [*arguments, "--connect", self.endpoint])

    def __call__(self, *arguments: str) -> str:
        result = self.result(*arguments)
        if result.exception is not None and not isinstance(result.exception, SystemExit):
            raise result.exception
        assert result.exit_code == 0, result.output
        return str(result.stdout)

    def call(self, operation: str, *arguments: str) -> None:
        """Call an operation of the monitor by `nao call`."""
        address = f"Hfsm.{self.file.stem}.{operation}"
        result = CliRunner().invoke(nao_app, ["call", address, *arguments, "--connect", self.endpoint])
        if result.exception is not None:
            raise result.exception

    def current(self, automaton: int = 1) -> str:
        return self.runtime.actor(automaton).current.name

    def variable(self, automaton: int, name: str) -> int:
        from hfsm_runtime._variables import values_of

        return int(str(values_of(self.runtime.actor(automaton).automaton)[name]))


@pytest.fixture
def component(tmp_path: Path) -> Component:
    return load(compile_to(tmp_path, walker(), "walker"))


@pytest.fixture
def shell(pair: Pair, component: Component, tmp_path: Path) -> Iterator[Shell]:
    runtime = Runtime(component, WallClock())
    with Monitor(runtime, pair.server):
        runtime.start()
        try:
            yield Shell(pair.endpoint, runtime, tmp_path / "walker.xml")
        finally:
            runtime.stop()


def test_pause_step_and_resume(shell: Shell) -> None:
    shell.call("pause")
    assert shell.runtime.status is ComponentStatus.Paused
    until(lambda: not shell.runtime.in_cycle)
    before = shell.variable(2, "corner")
    out = shell("step", "walker", "follow", "--count", "3")
    assert "follow > red" in out
    assert shell.variable(2, "corner") == before + 3
    shell("step", "walker")
    assert shell.variable(2, "corner") == before + 4
    shown = json.loads(shell("step", "walker", "--json"))
    assert shown["status"] == "paused"
    assert [(one["name"], one["state"]) for one in shown["automata"]] == [
        ("walker", "follow"),
        ("follow", "red"),
    ]
    shell.call("resume")
    until(lambda: shell.variable(2, "corner") > before + 10)


def test_a_step_names_a_cycle_that_still_runs(pair: Pair, tmp_path: Path) -> None:
    go_on = threading.Event()
    code = "self.entered.set()\nself.go_on.wait(30)"
    only = sub(1, 0, state(1, "only", code, initial=True))
    component: Any = load(compile_to(tmp_path, document(only), "stuck"))
    component.entered, component.go_on = threading.Event(), go_on
    runtime = Runtime(component, WallClock(), limits=RuntimeLimits(step=0.05))
    with Monitor(runtime, pair.server):
        runtime.start()
        try:
            shell = Shell(pair.endpoint, runtime, tmp_path / "stuck.xml")
            assert component.entered.wait(EVENT_LIMIT)
            shell.call("pause")
            result = shell.result("step", "stuck")
            assert "stuck paused at" in result.stdout
            assert result.stderr.endswith(
                "but a cycle of stuck in the state only still runs: its code must not block\n"
            )
        finally:
            go_on.set()
            runtime.stop()


def test_a_step_of_a_ghost_reports_that_nothing_ran(shell: Shell) -> None:
    shell("force", "walker", "enough")
    until(lambda: shell.current() == "dance")
    shell.call("pause")
    before = shell.runtime.actor(2).cycle.count
    result = shell.result("step", "walker", "follow")
    assert result.stderr == "nothing ran: follow is a ghost\n"
    assert "walker paused at" in result.stdout
    assert shell.runtime.actor(2).cycle.count == before


def test_step_needs_a_pause(shell: Shell) -> None:
    with pytest.raises(VisualHfsmError, match=r"walker is running, not paused: nao call Hfsm\.walker\.pause"):
        shell("step", "walker")


def test_a_breakpoint_is_set_reached_listed_and_deleted(shell: Shell) -> None:
    assert shell("break", "walker") == "no breakpoints\n"
    assert (
        shell("break", "walker", "follow/green", "--if", "corner < -5")
        == "  state follow/green if corner < -5\n"
    )
    shell("break", "walker", "enough")
    shell("set", "walker", "corner=-100")
    listed = shell("break", "walker", "--wait", "60")
    assert listed == "* state follow/green if corner < -5\n  transition enough\n"
    assert shell.current(2) == "green"
    stopped = json.loads(shell("break", "walker", "--json"))["stoppedAt"]
    assert stopped == [{"automaton": 2, "state": 2, "transition": 0, "condition": "corner < -5"}]
    assert shell("break", "walker", "follow/green", "--delete") == "  transition enough\n"
    assert shell("break", "walker", "--delete") == "no breakpoints\n"
    with pytest.raises(VisualHfsmError, match="no breakpoint at dance"):
        shell("break", "walker", "dance", "--delete")


def test_a_condition_that_is_none_is_refused(shell: Shell) -> None:
    with pytest.raises(VisualHfsmError, match=r"column 1: print\(corner\) is not allowed"):
        shell("break", "walker", "follow/green", "--if", "print(corner)")
    with pytest.raises(VisualHfsmError, match=r"uses no variable corner; automaton 2 \(follow\) does"):
        shell("break", "walker", "dance", "--if", "corner > 2")
    assert shell.result("break", "walker", "--if", "corner > 2").exit_code == 2


def test_waiting_for_a_breakpoint_ends(shell: Shell) -> None:
    with pytest.raises(VisualHfsmError, match=r"walker reached no breakpoint within 0\.2 s"):
        shell("break", "walker", "dance", "--wait", "0.2")


def test_a_transition_is_forced(shell: Shell) -> None:
    assert shell("force", "walker", "follow -> dance") == "enough fires at the next cycle\n"
    until(lambda: shell.current() == "dance")
    with pytest.raises(
        VisualHfsmError, match="the transition enough leaves the state 'follow', and walker is in 'dance'"
    ):
        shell("force", "walker", "enough")
    with pytest.raises(VisualHfsmError, match="no transition tird; did you mean tired"):
        shell("force", "walker", "tird")


def test_variables_and_parameters_are_set(shell: Shell) -> None:
    assert shell("set", "walker", "corner=1000", "speed=0.5") == "follow: corner = 1000\nself: speed = 0.5\n"
    assert shell.variable(2, "corner") >= 1000
    assert shell.runtime.component.speed == 0.5  # type: ignore[attr-defined]
    shell("set", "walker", "beats=1.5", "--automaton", "walker")
    with pytest.raises(VisualHfsmError, match="did you mean corner"):
        shell("set", "walker", "cornr=1")
    with pytest.raises(VisualHfsmError, match="speed is float, not str"):
        shell("set", "walker", "speed=fast")
    with pytest.raises(VisualHfsmError, match="no variable 'red'"):
        shell("set", "walker", "red=1", "--automaton", "follow")
    assert shell.result("set", "walker", "corner").exit_code == 2


@pytest.mark.parametrize(
    ("value", "problem"),
    [
        ("{color: red}", "{color: red} is not JSON: .*char 1"),
        ('"red', "is not JSON"),
        ("True", "write true, not True"),
    ],
)
def test_what_is_almost_json_is_no_text(shell: Shell, value: str, problem: str) -> None:
    with pytest.raises(VisualHfsmError, match=problem):
        shell("set", "walker", "corner=1000000", f"speed={value}")
    assert shell.variable(2, "corner") < 1_000_000, "nothing is set"


def test_why_not(shell: Shell) -> None:
    until(lambda: shell.runtime.actor(2).cycle.count > 3)
    out = shell("why", "walker")
    assert "walker is in follow\n  1. enough to dance: no event ball_lost has come" in out
    assert "follow is in red\n  1. to green to green: its guard `corner < 0` was false" in out
    (explained,) = json.loads(shell("why", "walker", "follow", "--json"))
    assert explained["transitions"][0]["value"] is False
    shell("force", "walker", "enough")
    until(lambda: shell.current() == "dance")
    assert "follow is a ghost in red" in shell("why", "walker", "follow")
    assert "2. " not in shell("why", "walker")


def test_why_not_names_what_was_made_to_fail(shell: Shell, pair: Pair) -> None:
    with closing(FakeRobot()) as robot:
        pair.adapter.add(Assembly(robot, ServerOptions(), WallClock()).servants["Faults"], "Faults")
        assert "made to fail" not in shell("why", "walker")
        robot.faults.inject("Camera", "late", 0.5)
        assert shell("why", "walker").endswith("made to fail: Camera late 0.5\n")


def test_reload_compiles_writes_and_keeps_the_state(shell: Shell) -> None:
    shell("force", "walker", "enough")
    until(lambda: shell.variable(1, "beats") > 2)
    shell.file.write_text(walker(seconds=7200, step=1000), encoding="utf-8")
    out = shell("reload", "walker", str(shell.file))
    assert "walker.py is written" in out
    assert "walker was reloaded, and paused for" in out
    assert "not kept" not in out
    assert shell.current() == "dance"
    until(lambda: shell.variable(1, "beats") > 1000)
    report = json.loads(shell("reload", "walker", str(shell.file), "--json"))
    assert (report["generation"], report["notKept"]) == (2, [])


def test_reload_reports_what_was_not_kept(shell: Shell) -> None:
    shell.file.write_text(
        walker().replace("<name>red<", "<name>blue<").replace("corner", "angle"), encoding="utf-8"
    )
    assert "not kept: no code of automaton 2 (follow) uses corner any more" in shell(
        "reload", "walker", str(shell.file)
    )


def test_a_counter_is_not_set_to_a_list(shell: Shell) -> None:
    shell.call("pause")
    with pytest.raises(VisualHfsmError, match=r"corner is int now \(\d+\), not list: \[1, 2\]"):
        shell("set", "walker", "corner=[1, 2]")
    for value in ("7.5", "null", "[1, 2]"):
        shell("set", "walker", f"corner={value}")


def test_a_document_with_errors_touches_nothing(shell: Shell) -> None:
    before = shell.file.with_suffix(".py").read_bytes()
    shell.file.write_text(walker().replace("corner += 1", "corner +="), encoding="utf-8")
    result = shell.result("reload", "walker", str(shell.file))
    assert result.exit_code == 1
    assert "walker.xml:" in result.stderr
    assert "nothing was written or reloaded" in result.stderr
    assert shell.file.with_suffix(".py").read_bytes() == before
    assert shell.runtime.reloads == 0


def test_a_refusal_is_reported(shell: Shell) -> None:
    before = shell.file.with_suffix(".py").read_bytes()
    shell.file.write_text(walker().replace("corner = 0", "corner = 1 / 0"), encoding="utf-8")
    with pytest.raises(VisualHfsmError, match=r"not reloaded, walker runs on as it was: .*ZeroDivisionError"):
        shell("reload", "walker", str(shell.file))
    assert shell.result("reload", "walker", str(shell.file)).stdout == ""
    assert shell.file.with_suffix(".py").read_bytes() == before


def test_the_document_is_found_where_it_is_expected(
    shell: Shell, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.chdir(tmp_path)
    assert "walker was reloaded" in shell("reload", "walker")
    shell.file.rename(tmp_path / "moved.xml")
    with pytest.raises(
        VisualHfsmError, match=r"which document\? walker.xml is neither here nor in behaviors/"
    ):
        shell("reload", "walker")


def test_stop_ends_the_component(shell: Shell) -> None:
    assert shell("stop", "walker") == "walker ends\n"
    assert shell.runtime.ended.wait(EVENT_LIMIT)


@pytest.mark.parametrize(
    "arguments",
    cases([["step"]], [["break"], ["force", "x"], ["set", "x=1"], ["why"], ["reload"], ["stop"]]),
    ids=lambda arguments: arguments[0],
)
def test_a_component_that_is_not_there_is_reported_with_those_that_are(
    shell: Shell, arguments: list[str]
) -> None:
    command, *rest = arguments
    with pytest.raises(VisualHfsmError, match="no component walkr runs in realm nao; did you mean walker"):
        shell(command, "walkr", *rest, "--timeout", "5")  # a tenth of that is waited for it


def test_an_error_is_one_line_and_exit_code_1(shell: Shell) -> None:
    with ComponentProcess(
        module("visualhfsm", "why", "walker", "nowhere", "--connect", shell.endpoint)
    ) as process:
        assert process.wait() == 1
        assert process.output.count("\n") == 1
        assert "error: there is no automaton nowhere; there are follow, walker" in process.output
