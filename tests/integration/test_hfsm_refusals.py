"""A component, as a process, whose commands the robot refuses."""

from __future__ import annotations

from pathlib import Path

from typer import Typer

from hfsm_runtime._robot import Permission
from interfaces.hfsm import ComponentStatus, HfsmMonitorPrx
from interfaces.nao import PoseHeadPrx, SafetyPrx
from naoserver.fake import FakeRobot
from tests.integration.test_hfsm_component import start, turning
from tests.support.commands import run_here
from tests.support.limits import START_LIMIT
from tests.support.robot_server import eventually, served, served_to_client
from visualhfsm._command import app as visualhfsm
from visualhfsm.nao._command import app as nao
from zenoh_ice import initialize


def test_what_safety_reports_decides_whether_commands_are_accepted_again() -> None:
    with served_to_client(FakeRobot()) as nao, nao.client() as other:
        safety = nao.proxy(SafetyPrx, "Safety")
        permission = Permission(safety)
        safety.emergencyStop("a hand in the way")
        assert not permission.is_given("")
        safety.resetEmergencyStop()
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
            assert permission.is_given("")


def test_without_a_safety_servant_only_another_command_can_find_out() -> None:
    with initialize(connect=[], clock="wall") as communicator:
        safety = SafetyPrx.uncheckedCast(communicator.stringToProxy("Safety"))
        assert Permission(safety, limit=0.05).is_given("")


def test_a_behavior_goes_on_after_the_reset_of_an_emergency_stop(tmp_path: Path, endpoint: str) -> None:
    def operator(app: Typer, *arguments: str) -> str:
        done = run_here(app, "operator", *arguments, "--connect", endpoint)
        assert done.returncode == 0, done.stderr
        return done.stdout

    with (
        served(FakeRobot(), realm="nao", endpoint=endpoint),
        initialize(connect=[endpoint], clock="wall") as communicator,
    ):
        head = PoseHeadPrx.checkedCast(communicator.stringToProxy("Head"))
        slowly = turning(tmp_path, "self.head.setSpeed(0.05, 0.0)\nprint('turning', flush=True)")
        with start(slowly, endpoint) as component:
            eventually(lambda: head.getPose().panSpeed > 0.03)
            operator(nao, "stop", "a hand in the way")
            component.wait_for(
                "the robot is stopped: a hand in the way.*pauses until commands are accepted again"
            )
            monitor = HfsmMonitorPrx.checkedCast(communicator.stringToProxy("Hfsm.turner"))
            eventually(lambda: monitor.getSnapshot().status is ComponentStatus.Paused)
            first, later = monitor.getSnapshot(), monitor.getSnapshot.wait(timeout=START_LIMIT).value
            assert first.status is later.status is ComponentStatus.Paused
            assert first.refusal.startswith("turner/turn: CommandRefusedException: the robot is stopped")
            assert later.time == first.time
            watched = operator(visualhfsm, "watch", "--seconds", "0.5")
            assert "paused: turner/turn: CommandRefusedException" in watched
            turned = component.output.count("turning")
            operator(nao, "stop", "--reset")
            component.wait_for("commands are accepted again: continuing after")
            eventually(lambda: component.output.count("turning") > turned)
            eventually(lambda: head.getPose().panSpeed > 0.03)
            assert monitor.getSnapshot().refusal == ""
            assert component.output.count("pauses until") == 1
