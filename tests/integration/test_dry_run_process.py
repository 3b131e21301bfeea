"""*Try it* as a process: its monitor answers and a signal ends it, whatever the component's code does."""

from __future__ import annotations

import json
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from interfaces.hfsm import ComponentStatus, HfsmMonitorPrx, InvalidValue, NoSuchElement, ReloadRefused
from interfaces.nao import DescriptionPrx
from naoserver.bodies import find_body
from tests.support.documents import compile_to, document, state, sub, transition
from tests.support.limits import END_LIMIT
from tests.support.processes import ComponentProcess, module
from tests.support.soak import cases
from tests.support.waiting import until
from visualhfsm.simulation._dry_run import main
from zenoh_ice import initialize

Tried = tuple[ComponentProcess, HfsmMonitorPrx]

PROGRAM = module("visualhfsm.simulation._dry_run")
HASTY = [
    sys.executable,
    "-c",
    (
        "from hfsm_runtime._limits import RuntimeLimits\n"
        "from visualhfsm.simulation._dry_run import main\n"
        "main(limits=RuntimeLimits(gap=0.1, hangs=0.1, step=0.1, stop=0.1))"
    ),
]
"""The same program, which does not wait for long for code that hangs."""


@contextmanager
def tried(directory: Path, endpoint: str, code: str, *options: str, body: str = "") -> Iterator[Tried]:
    """Try a document with some code in its second state; yield its process and its monitor, once there."""
    program = HASTY if code == HANGS else PROGRAM
    states = state(1, "first", initial=True), state(2, "second", code)
    root = sub(
        1,
        0,
        *states,
        transition(1, 1, 2, "100", type="time", name="time"),
        period="10" if code == HANGS else "50",
    )
    file = compile_to(directory, document(root), "odd")
    where = ("--connect", endpoint, "--clock", "wall")
    chosen = [f"--body={body}"] if body else []
    command = [*program, *chosen, str(file), *where, *options]
    with (
        initialize(connect=[], listen=[endpoint], clock="wall") as communicator,
        ComponentProcess(command) as process,
    ):
        process.wait_for("second")
        yield process, HfsmMonitorPrx.checkedCast(communicator.stringToProxy("Hfsm.odd"))


def test_a_dry_run_describes_the_robot_that_was_chosen(tmp_path: Path, endpoint: str) -> None:
    with tried(tmp_path, endpoint, SHOWS, body="T1") as (_, monitor):
        proxy = monitor.ice_getCommunicator().stringToProxy("DryRun.odd")
        described = DescriptionPrx.checkedCast(proxy)
        assert json.loads(described.getBody())["name"] == "T1"
        joints = json.loads(described.getLooks())["shapes"]
        assert joints
        until(lambda: {*monitor.getSnapshot().joints} == {*find_body("T1").joint_names})


def test_a_dry_run_of_a_robot_that_is_not_there_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.argv", ["_dry_run.py", f"--body={tmp_path}/robots/none.toml", "odd.py"])
    with pytest.raises(SystemExit, match=r"robots/none\.toml"):
        main()


SHOWS = "print('second', flush=True)"
HANGS = "import select\nprint('second', flush=True)\nwhile True: select.select([], [], [], 0.01)"
"""No code of ours: it neither ends nor lets go, and takes no processor time."""


@pytest.mark.slow
@pytest.mark.parametrize(
    "options",
    cases([pytest.param(("--seconds", "600"), id="for a time")], [pytest.param((), id="without end")]),
)
def test_code_that_hangs_keeps_neither_the_monitor_nor_a_signal_waiting(
    tmp_path: Path, endpoint: str, options: tuple[str, ...]
) -> None:
    with tried(tmp_path, endpoint, HANGS, *options) as (process, monitor):
        until(lambda: monitor.getSnapshot().automata[0].hangsFor > 0.0)
        assert "odd" in monitor.getSnapshot().automata[0].hangsAt
        monitor.setSpeed(20.0)
        monitor.pause()
        monitor.step(0)
        snapshot = monitor.getSnapshot()
        assert (snapshot.status, snapshot.speed) == (ComponentStatus.Paused, 20.0)
        with pytest.raises(ReloadRefused, match="its code must not block"):
            monitor.reload()
        process.process.send_signal(signal.SIGTERM)
        assert process.wait(END_LIMIT) == 143
        assert "is abandoned: its code must not block" in process.output


@pytest.mark.slow
def test_the_monitor_ends_code_that_hangs(tmp_path: Path, endpoint: str) -> None:
    with tried(tmp_path, endpoint, HANGS) as (process, monitor):
        monitor.stop()
        assert process.wait(END_LIMIT) == 0


def test_a_pause_ends_a_sleep_of_a_dry_run(tmp_path: Path, endpoint: str) -> None:
    with tried(tmp_path, endpoint, "print('second', flush=True)\nself.sleep(600)") as (_, monitor):
        monitor.pause()
        until(lambda: not monitor.getSnapshot().automata[0].inCycle)
        monitor.resume()
        until(lambda: monitor.getSnapshot().automata[0].inCycle)


@pytest.mark.parametrize("sleep", ["self.sleep(600)", "import time; time.sleep(600)"])
def test_code_that_sleeps_ends_with_its_dry_run(tmp_path: Path, endpoint: str, sleep: str) -> None:
    with tried(tmp_path, endpoint, f"print('second', flush=True)\n{sleep}") as (process, _):
        process.process.send_signal(signal.SIGTERM)
        assert process.wait(END_LIMIT) == 143
        assert "abandoned" not in process.output


def test_a_dry_run_is_steered_like_any_component(tmp_path: Path, endpoint: str) -> None:
    with tried(tmp_path, endpoint, "print('second', flush=True)") as (_, monitor):
        with pytest.raises(NoSuchElement, match="no transition 1 leaves second"):
            monitor.forceTransition(1, 1)
        with pytest.raises(InvalidValue, match="at most 100"):
            monitor.setSpeed(1000.0)
        assert monitor.reload().notKept == []
        assert monitor.getSnapshot().generation == 1
        monitor.pause()
        before = monitor.getSnapshot()
        monitor.step(0)
        after = monitor.getSnapshot()
        assert after.time == pytest.approx(before.time + 0.05)
        assert after.automata[0].cycles == before.automata[0].cycles + 1
