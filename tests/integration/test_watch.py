"""`visualhfsm watch`, where signals matter as a process, on a fake robot and on a component whose monitor the test serves."""

from __future__ import annotations

import re
import signal
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest
from msgspec.structs import replace

from interfaces.hfsm import ComponentSnapshot, ComponentStructure
from naoserver.fake import FakeRobot
from tests.support.commands import run_here
from tests.support.component import MonitorStub, dance_and_follow, snapshot
from tests.support.limits import START_LIMIT
from tests.support.processes import ComponentProcess, free_endpoint, module
from tests.support.robot_server import ServedRobot, eventually, served
from tests.support.stranger import session_of
from tests.support.waiting import until
from tests.support.watching import content
from visualhfsm._base.errors import VisualHfsmError
from visualhfsm._commands.app import app
from visualhfsm._commands.watch import Telemetry, status_line
from zenoh_ice import Current, initialize


class Monitor(MonitorStub):
    """A component that starts its document at a time, without a robot."""

    def __init__(self) -> None:
        self.began = time.monotonic()
        self.generation = 0

    def now(self) -> ComponentSnapshot:
        seconds = round(time.monotonic() - self.began, 3)
        # However long the machine takes, it is still in its first states.
        now = snapshot(min(seconds, 5.0))
        return replace(now, startedAt=self.began, time=seconds, generation=self.generation)

    def getStructure(self, current: Current) -> ComponentStructure:
        return replace(dance_and_follow(), generation=self.generation)

    def getSnapshot(self, current: Current) -> ComponentSnapshot:
        return self.now()


@contextmanager
def component(endpoint: str, realm: str = "nao", name: str = "dance_and_follow") -> Iterator[Monitor]:
    """Serve a component's monitor and a robot."""
    monitor, ended = Monitor(), threading.Event()

    def publish() -> None:
        while not ended.wait(0.1):
            monitor.getSnapshotPublisher.publish(monitor.now())

    with initialize(realm=realm, connect=[endpoint], clock="wall") as communicator:
        adapter = communicator.createObjectAdapter("Component")
        adapter.add(monitor, f"Hfsm.{name}")
        adapter.activate()
        thread = threading.Thread(target=publish)
        thread.start()
        try:
            yield monitor
        finally:
            ended.set()
            thread.join()


@pytest.fixture
def robot() -> Iterator[ServedRobot]:
    with served(FakeRobot()) as robot:
        yield robot


def options(robot: ServedRobot, *arguments: str) -> list[str]:
    return ["watch", *arguments, "--connect", robot.endpoint, "--realm", robot.realm]


def watch(robot: ServedRobot, *arguments: str) -> list[str]:
    """Return the command for a separate process: one that a signal ends."""
    return module("visualhfsm", *options(robot, *arguments))


def run(arguments: list[str]) -> tuple[int, str]:
    """Run the command to its end; return its exit code and all its output."""
    done = run_here(app, "visualhfsm", *arguments, expected=(VisualHfsmError,))
    return done.returncode, done.stdout + done.stderr


def test_a_component_is_reported_line_by_line_and_the_report_is_the_page_of_the_run(
    robot: ServedRobot, tmp_path: Path
) -> None:
    path = tmp_path / "report.html"
    with component(robot.endpoint, robot.realm):
        command = watch(robot, "dance_and_follow", "--wait", "60", "--report", str(path))
        with ComponentProcess(command) as watcher:
            watcher.wait_for("followBall > red > follow.*red ball 172 116 px.*images/s.*real time")
            eventually(lambda: watcher.output.count("images/s") >= 2)
            watcher.process.send_signal(signal.SIGINT)
            code, output = watcher.wait(), watcher.output

    assert code == 130, output
    assert re.search(r"watched +\d+\.\d s", output)
    assert f"Report: {path}" in output.replace("\n", "")
    found, moments = content(path.read_text(encoding="utf-8"))
    assert moments
    assert found["document"]["automata"]
    assert found["pictures"]["Camera"]


def test_a_component_needs_no_name_when_it_is_the_only_one(robot: ServedRobot) -> None:
    with component(robot.endpoint, robot.realm, "alone"):
        code, output = run(options(robot, "--seconds", "0.05", "--wait", "60"))
    assert code == 0, output


def test_of_several_components_one_must_be_named(robot: ServedRobot) -> None:
    with component(robot.endpoint, robot.realm, "one"), component(robot.endpoint, robot.realm, "two"):
        code, output = run(options(robot, "--wait", "60"))
    assert code == 1
    assert "several components run; name one of one, two" in output


def test_a_name_that_a_terminal_would_obey_is_not_shown(robot: ServedRobot) -> None:
    with (
        component(robot.endpoint, robot.realm, "one"),
        initialize(realm=robot.realm, connect=[robot.endpoint], clock="wall") as stranger,
    ):
        token = session_of(stranger).liveliness().declare_token(f"@servant/{robot.realm}/Hfsm.\x1b[2J/::A/-")
        code, output = run(options(robot, "--seconds", "0.05", "--wait", "60"))
        token.undeclare()
    assert code == 0, output  # the only component of a name that can be shown is found
    assert "[2J" not in output
    assert "\x1b" not in output


def test_without_a_component_the_command_says_how_to_start_one(robot: ServedRobot) -> None:
    code, output = run(options(robot, "--wait", "0.05"))
    assert code == 1
    assert "python behaviors/follow_ball.py" in output
    assert "Traceback" not in output


def test_a_component_that_is_not_there_is_an_error_that_names_it(robot: ServedRobot) -> None:
    code, output = run(options(robot, "absent", "--wait", "0.05", "--timeout", "5"))
    assert code == 1
    assert "Hfsm.absent" in output
    assert "Traceback" not in output


def test_instead_of_a_component_that_is_not_there_those_that_run_are_named(robot: ServedRobot) -> None:
    with component(robot.endpoint, robot.realm, "present"):
        for patience in ("0.1", "1", "20"):
            code, output = run(options(robot, "absent", "--wait", patience))
            if "did you mean present" in output:
                break
    assert code == 1
    assert "no component absent runs" in output
    assert "did you mean present" in output


def test_without_a_server_the_command_names_the_endpoint_and_how_to_start_one() -> None:
    endpoint = free_endpoint()
    code, output = run(["watch", "absent", "--wait", "0.05", "--timeout", "0.2", "--connect", endpoint])
    assert code == 1
    assert endpoint in output.splitlines()[-1]
    assert "naoserver-sim" in output.splitlines()[-1]


@contextmanager
def listening(robot: ServedRobot) -> Iterator[Telemetry]:
    with (
        robot.client() as client,
        Telemetry(client.communicator, "dance_and_follow", pictures=False) as telemetry,
    ):
        yield telemetry


def wait_until(telemetry: Telemetry, condition: object) -> None:
    assert callable(condition)
    until(lambda: condition(telemetry.update()), START_LIMIT)


def test_a_lost_server_is_reported_and_found_again() -> None:
    endpoint = free_endpoint()
    with ExitStack() as stack, ExitStack() as first:
        robot = first.enter_context(served(FakeRobot(), realm="nao", endpoint=endpoint))
        stack.enter_context(component(endpoint))
        telemetry = stack.enter_context(listening(robot))
        wait_until(telemetry, lambda state: "followBall > red" in status_line(state))
        first.close()
        wait_until(telemetry, lambda state: "Robot server lost" in status_line(state))
        stack.enter_context(served(FakeRobot(), realm="nao", endpoint=endpoint))
        wait_until(telemetry, lambda state: "images/s" in status_line(state))


def test_a_robot_that_its_server_loses_is_called_lost(robot: ServedRobot) -> None:
    with component(robot.endpoint, robot.realm), listening(robot) as telemetry:
        wait_until(telemetry, lambda state: "real time x" in status_line(state))
        robot.assembly.gate.lose("the cable is out")
        wait_until(telemetry, lambda state: status_line(state).endswith("robot lost"))
        robot.assembly.gate.find()
        wait_until(telemetry, lambda state: "real time x" in status_line(state))


def test_a_component_that_is_restarted_begins_a_new_log(robot: ServedRobot) -> None:
    with component(robot.endpoint, robot.realm) as monitor, listening(robot) as telemetry:
        monitor.began -= 1000.0
        wait_until(telemetry, lambda _: telemetry.log.duration > 0.2)
        first = telemetry.log
        monitor.began = time.monotonic()
        wait_until(telemetry, lambda state: telemetry.log is not first and state.snapshot)
        wait_until(telemetry, lambda _: telemetry.log.duration > 0.2)
        assert telemetry.log.timeline().start < 500.0


def test_a_component_that_is_reloaded_goes_on_in_the_same_log(robot: ServedRobot) -> None:
    with component(robot.endpoint, robot.realm) as monitor, listening(robot) as telemetry:
        wait_until(telemetry, lambda _: telemetry.log.duration > 0.3)
        log = telemetry.log
        before = log.duration
        monitor.generation = 1
        wait_until(telemetry, lambda state: state.snapshot and state.snapshot.generation == 1)
        assert telemetry.log is log
        assert telemetry.automata is not None
        assert telemetry.automata.structure.generation == 1
        wait_until(telemetry, lambda _: log.duration > before + 0.3)
