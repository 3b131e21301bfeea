"""Run and watch: pause, step, break and reload a behavior while it drives the robot, both in separate processes."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest
import typer

from interfaces.hfsm import ComponentSnapshot, ComponentStatus, HfsmMonitorPrx
from nao_tools._command import app as visualhfsm_nao
from tests.doors.conftest import ServedRobot
from tests.integration.test_hfsm_monitor import first_snapshot
from tests.support.commands import run_here
from tests.support.documents import generate
from tests.support.limits import START_LIMIT
from tests.support.places import ROOT
from tests.support.processes import ComponentProcess, module
from visualhfsm._base.errors import VisualHfsmError
from visualhfsm._commands.app import app as visualhfsm


@pytest.fixture
def stack() -> Iterator[ExitStack]:
    with ExitStack() as stack:
        yield stack


@pytest.mark.promise("pause, step, set breakpoints, reload the changed behavior while it runs")
def test_dance_and_follow_goes_on_in_its_edited_document(
    fake: ServedRobot, stack: ExitStack, tmp_path: Path
) -> None:
    source = (ROOT / "behaviors" / "dance_and_follow.xml").read_text(encoding="utf-8")
    source = source.replace("<within>10000<", "<within>4000000<")
    for milliseconds in ("8000", "10000"):  # nothing changes by itself, however long a command takes
        assert source.count(f">{milliseconds}<") == 2
        source = source.replace(f">{milliseconds}<", ">600000<")
    path = tmp_path / "dance_and_follow.xml"
    path.write_text(source, encoding="utf-8")
    (tmp_path / "follow_ball.xml").write_bytes((ROOT / "behaviors" / "follow_ball.xml").read_bytes())
    file = generate(path, tmp_path)
    command = [sys.executable, str(file), "--connect", fake.endpoint, "--clock", "wall"]
    component = stack.enter_context(ComponentProcess(command, {"PYTHONPATH": str(ROOT)}))
    communicator = stack.enter_context(fake.client())
    monitor = HfsmMonitorPrx.uncheckedCast(communicator.stringToProxy("Hfsm.dance_and_follow"))
    monitor.getSnapshot.wait(timeout=START_LIMIT)

    def steer(*arguments: str, code: int = 0, app: typer.Typer = visualhfsm) -> str:
        done = run_here(
            app, "visualhfsm", *arguments, "--connect", fake.endpoint, expected=(VisualHfsmError,)
        )
        assert done.returncode == code, done.stderr
        return f"{done.stdout}{done.stderr}"

    def dancing(snapshot: ComponentSnapshot) -> bool:
        root, follow, _, _, dance = snapshot.automata
        return root.state == 2 and follow.ghost and not dance.ghost

    with ComponentProcess(module("visualhfsm", "why", "dance_and_follow", "--connect", fake.endpoint)) as why:
        assert why.wait() == 0, why.output
    assert "followBall is in red" in why.output
    assert "enough fires" in steer("force", "dance_and_follow", "enough")
    before = first_snapshot(monitor, dancing)
    assert before.automata[0].timers[0].remaining <= 600.0

    path.write_text(source.replace(">600000<", ">3600000<"), encoding="utf-8")
    assert "dance_and_follow was reloaded" in steer("reload", "dance_and_follow", str(path))
    after = first_snapshot(monitor, lambda snapshot: snapshot.generation == 1)
    assert dancing(after)
    assert after.automata[0].enteredAt == before.automata[0].enteredAt
    spent = after.time - after.automata[0].enteredAt
    assert after.automata[0].timers[0].remaining == pytest.approx(3600.0 - spent, abs=0.5)
    assert after.automata[1].state == before.automata[1].state
    first_snapshot(monitor, lambda snapshot: snapshot.automata[4].cycles > after.automata[4].cycles + 3)

    path.write_text(source.replace("self.Head.stop()", "self.Head.stopp("), encoding="utf-8")
    assert "nothing was written or reloaded" in steer("reload", "dance_and_follow", str(path), code=1)

    assert "followBall" in steer("break", "dance_and_follow", "followBall", "--state")
    steer("force", "dance_and_follow", "tired")
    stopped = first_snapshot(monitor, lambda snapshot: bool(snapshot.stoppedAt))
    assert stopped.automata[0].state == 1
    steer("call", "Hfsm.dance_and_follow.resume", app=visualhfsm_nao)
    first_snapshot(monitor, lambda snapshot: snapshot.status is ComponentStatus.Running)
    steer("stop", "dance_and_follow")
    assert component.wait() == 0, component.output
