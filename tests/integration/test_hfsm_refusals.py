"""A component, as a process, whose commands the robot refuses."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from typer import Typer

from hfsm_runtime._robot import Permission
from interfaces.hfsm import ComponentStatus, HfsmMonitorPrx
from interfaces.nao import PoseHeadPrx, SafetyPrx
from nao_tools._command import app as nao
from naoserver.fake import FakeRobot
from tests.integration.test_hfsm_component import HEAD, start, turning
from tests.support.commands import run_here
from tests.support.limits import START_LIMIT
from tests.support.robot_server import eventually, served, served_to_client
from visualhfsm._commands.app import app as visualhfsm
from zenoh_ice import Communicator, initialize


@pytest.fixture
def beside(endpoint: str) -> Iterator[Communicator]:
    """Another program in the realm of a robot."""
    with (
        served(FakeRobot(), realm="nao", endpoint=endpoint),
        initialize(connect=[endpoint], clock="wall") as communicator,
    ):
        yield communicator


def test_what_safety_reports_decides_whether_commands_are_accepted_again() -> None:
    with served_to_client(FakeRobot()) as nao, nao.client() as other:
        safety = nao.proxy(SafetyPrx, "Safety")
        permission = Permission(safety)
        safety.emergencyStop("a hand in the way")
        assert not permission.is_given("")
        safety.resetEmergencyStop()
        assert not permission.is_given(""), "the reset alone starts nothing"
        permission.begin_again()
        assert permission.is_given("")
        other.proxy(SafetyPrx, "Safety").acquireLease("Anna", 60.0)
        assert not permission.is_given("Anna")
        assert permission.is_given("Ben"), "who holds it now may be the component itself"
        other.proxy(SafetyPrx, "Safety").releaseLease()
        assert permission.is_given("Anna")


def test_a_server_that_knows_of_no_stop_is_not_enough_until_somebody_resets_it(endpoint: str) -> None:
    with initialize(connect=[endpoint], clock="wall") as communicator:
        safety = SafetyPrx.uncheckedCast(communicator.stringToProxy("Safety"))
        permission = Permission(safety)
        with served(FakeRobot(), realm="nao", endpoint=endpoint):
            eventually(lambda: bool(communicator.identities()))
            safety.emergencyStop("a hand in the way")
            assert not permission.is_given("")
        assert not permission.is_given(""), "nobody can be asked"
        with served(FakeRobot(), realm="nao", endpoint=endpoint):
            eventually(lambda: bool(communicator.identities()))
            assert not safety.getSafetyState().stopped, "it kept no record"
            assert not permission.is_given("")
            safety.resetEmergencyStop()
            assert not permission.is_given("")
            safety.resetEmergencyStop(True)
            assert permission.is_given("")


@pytest.mark.parametrize("asked_before", [False, True])
def test_a_stop_that_was_reset_before_anybody_asked_counts(asked_before: bool) -> None:
    with served_to_client(FakeRobot()) as nao:
        safety = nao.proxy(SafetyPrx, "Safety")
        permission = Permission(safety)
        if asked_before:
            assert permission.is_given("")
        safety.emergencyStop("a hand in the way")
        safety.resetEmergencyStop()
        assert not permission.is_given("")
        permission.begin_again()


def test_a_stop_pauses_what_may_move_though_it_commands_nothing_meanwhile(
    tmp_path: Path, endpoint: str, beside: Communicator
) -> None:
    """Its next command would be accepted after the reset, and move the robot."""
    safety = SafetyPrx.checkedCast(beside.stringToProxy("Safety"))
    with start(turning(tmp_path, "print('idle', flush=True)"), endpoint) as component:
        component.wait_for("idle")
        safety.emergencyStop("a hand in the way")
        component.wait_for("the robot is stopped: a hand in the way; pauses until a person lets it go on")
        safety.resetEmergencyStop()
        component.wait_for("the emergency stop was reset: resume by hand")
        monitor = HfsmMonitorPrx.checkedCast(beside.stringToProxy("Hfsm.turner"))
        assert monitor.getSnapshot().status is ComponentStatus.Paused
        assert monitor.getSnapshot().refusal == "the robot is stopped: a hand in the way"
        idle = component.output.count("idle")
        monitor.resume()
        eventually(lambda: component.output.count("idle") > idle)


def test_a_behavior_that_begins_beside_a_stopped_robot_waits_for_a_person(
    tmp_path: Path, endpoint: str, beside: Communicator
) -> None:
    safety = SafetyPrx.checkedCast(beside.stringToProxy("Safety"))
    safety.emergencyStop("a hand in the way")
    with start(turning(tmp_path, "print('idle', flush=True)"), endpoint) as component:
        component.wait_for("the robot is stopped: a hand in the way; pauses until a person lets it go on")
        safety.resetEmergencyStop(True)
        monitor = HfsmMonitorPrx.checkedCast(beside.stringToProxy("Hfsm.turner"))
        eventually(lambda: monitor.getSnapshot().status is ComponentStatus.Running)


def test_without_a_safety_servant_only_another_command_can_find_out() -> None:
    with initialize(connect=[], clock="wall") as communicator:
        safety = SafetyPrx.uncheckedCast(communicator.stringToProxy("Safety"))
        assert Permission(safety, limit=0.05).is_given("")


@pytest.mark.parametrize("way", ["reset and resume", "reset, then a person"])
def test_a_behavior_goes_on_after_the_reset_of_an_emergency_stop_when_a_person_lets_it(
    tmp_path: Path, endpoint: str, way: str, beside: Communicator
) -> None:
    def operator(app: Typer, *arguments: str) -> str:
        done = run_here(app, "operator", *arguments, "--connect", endpoint)
        assert done.returncode == 0, done.stderr
        return done.stdout

    head = PoseHeadPrx.checkedCast(beside.stringToProxy("Head"))
    slowly = turning(tmp_path, "self.head.setSpeed(0.05, 0.0)\nprint('turning', flush=True)")
    with start(slowly, endpoint) as component:
        eventually(lambda: head.getPose().panSpeed > 0.03)
        operator(nao, "stop", "a hand in the way")
        component.wait_for("the robot is stopped: a hand in the way.*pauses until")
        monitor = HfsmMonitorPrx.checkedCast(beside.stringToProxy("Hfsm.turner"))
        eventually(lambda: monitor.getSnapshot().status is ComponentStatus.Paused)
        first, later = monitor.getSnapshot(), monitor.getSnapshot.wait(timeout=START_LIMIT).value
        assert first.status is later.status is ComponentStatus.Paused
        assert "the robot is stopped: a hand in the way" in first.refusal
        assert later.time == first.time
        watched = operator(visualhfsm, "watch", "--seconds", "0.5")
        assert f"paused: {first.refusal}" in watched
        turned = component.output.count("turning")
        if way == "reset and resume":
            assert "paused behaviors go on" in operator(nao, "stop", "--reset", "--resume")
        else:
            assert "when a person lets them" in operator(nao, "stop", "--reset")
            component.wait_for("the emergency stop was reset: resume by hand")
            assert monitor.getSnapshot().status is ComponentStatus.Paused
            monitor.resume()
        eventually(lambda: component.output.count("turning") > turned)
        eventually(lambda: head.getPose().panSpeed > 0.03)
        assert monitor.getSnapshot().refusal == ""
        assert 1 <= component.output.count("pauses until") <= 2, "its command may be refused, too"


def test_a_behavior_goes_on_with_a_robot_of_another_realm_when_a_person_lets_it(
    tmp_path: Path, endpoint: str, beside: Communicator
) -> None:
    config = HEAD.replace(">Head<", ">Head@other<")
    with served(FakeRobot(), realm="other") as other, initialize(connect=[endpoint, other.endpoint]) as seen:
        head, safety = (
            kind.uncheckedCast(seen.stringToProxy(f"{name}@other"))
            for kind, name in ((PoseHeadPrx, "Head"), (SafetyPrx, "Safety"))
        )
        assert isinstance(head, PoseHeadPrx)
        assert isinstance(safety, SafetyPrx)
        with start(turning(tmp_path, config=config), endpoint, "--connect", other.endpoint) as component:
            eventually(lambda: head.getPose().panSpeed > 0.03)
            safety.emergencyStop("a hand in the way")
            component.wait_for("the robot is stopped: a hand in the way.*pauses until")
            safety.resetEmergencyStop()
            events = other.assembly.events
            eventually(lambda: any("ended the commands" in event.message for event in events.snapshot()[0]))
            assert head.getPose().panSpeed == pytest.approx(0.0, abs=0.01)
            monitor = HfsmMonitorPrx.checkedCast(beside.stringToProxy("Hfsm.turner"))
            monitor.resume()
            eventually(lambda: head.getPose().panSpeed > 0.03)
