"""What was stopped stays stopped, and what nobody commands any more comes to rest: killed servers and clients."""

from __future__ import annotations

import signal
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from importlib.util import find_spec
from pathlib import Path

import pytest

from interfaces.hfsm import ComponentStatus, HfsmMonitorPrx
from interfaces.jderobot import CommandRefusedException
from interfaces.nao import HealthPrx, JointsPrx, PoseHeadPrx, SafetyPrx
from naoserver.fake import FakeRobot
from tests.integration.test_hfsm_component import start, turning
from tests.support.carriers import LOCAL, NETWORK, is_used
from tests.support.limits import EVENT_LIMIT
from tests.support.processes import ComponentProcess, module
from tests.support.robot_server import RobotClient, clock_at, eventually, served_to_client, wait_for
from tests.support.soak import cases, repeated
from zenoh_ice import Communicator, ConnectionLostException, ObjectNotExistException, initialize

UNCLEAN = "its server ended without warning"


@contextmanager
def server(command: str, endpoint: str, *options: str) -> Iterator[ComponentProcess]:
    with ComponentProcess(module(command, "--listen", endpoint, *options)) as process:
        process.wait_for("^ready")
        yield process


def kill(process: ComponentProcess) -> None:
    process.process.kill()
    assert process.wait() == -signal.SIGKILL


def known(communicator: Communicator) -> SafetyPrx:
    """Return the safety of a server as soon as it can be called."""
    safety = SafetyPrx.uncheckedCast(communicator.stringToProxy("Safety"))

    def answers() -> bool:
        try:
            safety.getSafetyState()
        except (ConnectionLostException, ObjectNotExistException):
            return False
        return True

    eventually(answers)
    return safety


@pytest.fixture
def client(by_environment: None, endpoint: str) -> Iterator[Communicator]:
    with initialize(connect=[endpoint], clock="wall") as communicator:
        yield communicator


SIMULATION = pytest.param(
    "naoserver_sim",
    marks=[pytest.mark.sim, pytest.mark.skipif(not find_spec("mujoco"), reason="no mujoco")],
)


@pytest.mark.parametrize("command", cases([SIMULATION], ["naoserver.fake"]))
def test_a_robot_that_was_stopped_is_stopped_after_the_death_of_its_server(
    command: str, endpoint: str, client: Communicator
) -> None:
    with server(command, endpoint) as process:
        known(client).emergencyStop("a hand in the way")
        kill(process)
    with server(command, endpoint) as process:
        process.wait_for("Safety: still stopped: a hand in the way")
        safety = known(client)
        assert safety.getSafetyState().reason == f"a hand in the way (then {UNCLEAN})"
        head = PoseHeadPrx.checkedCast(client.stringToProxy("Head"))
        with pytest.raises(CommandRefusedException, match="a hand in the way"):
            head.setPose(0.3, 0.0, 1.0)
        safety.resetEmergencyStop(True)
        head.setPose(0.3, 0.0, 1.0)


@pytest.mark.parametrize("end", cases([signal.SIGTERM], [signal.SIGINT]))
def test_a_stop_outlasts_a_server_that_is_ended_and_only_a_stop_does(
    end: signal.Signals, endpoint: str, client: Communicator
) -> None:
    for stopped in (False, True):
        with server("naoserver.fake", endpoint) as process:
            safety = known(client)
            assert safety.getSafetyState().reason == ""
            if stopped:
                safety.emergencyStop("a hand in the way")
            process.process.send_signal(end)
            process.wait()
    with server("naoserver.fake", endpoint):
        assert known(client).getSafetyState().reason == "a hand in the way"


def test_a_behavior_goes_on_only_after_a_reset_however_often_its_server_is_killed(
    tmp_path: Path, endpoint: str, client: Communicator
) -> None:
    behavior = turning(tmp_path)
    with ExitStack() as stack:
        with server("naoserver.fake", endpoint) as process:
            component = stack.enter_context(start(behavior, endpoint))
            component.wait_for("turning")
            head = PoseHeadPrx.checkedCast(client.stringToProxy("Head"))
            wait_for(head.getPose, lambda pose: pose.panSpeed > 0.05)
            known(client).emergencyStop("a hand in the way")
            component.wait_for("the robot is stopped: a hand in the way.*; pauses ")
            kill(process)
        monitor = HfsmMonitorPrx.checkedCast(client.stringToProxy("Hfsm.turner"))
        for _ in range(repeated(test=1, soak=2)):
            with server("naoserver.fake", endpoint) as process:
                safety = known(client)
                sample = head.getPose.wait(timeout=EVENT_LIMIT)
                for _ in range(75):  # 1.5 s: it asks once a second
                    sample = head.getPose.wait(after=sample, timeout=EVENT_LIMIT)
                    assert abs(sample.value.panSpeed) < 0.01
                assert safety.getSafetyState().stopped
                assert monitor.getSnapshot().status is ComponentStatus.Paused
                kill(process)
        with server("naoserver.fake", endpoint):
            known(client).resetEmergencyStop()
            component.wait_for("the emergency stop was reset: resume by hand")
            assert monitor.getSnapshot().status is ComponentStatus.Paused
            monitor.resume()
            assert monitor.getSnapshot().status is ComponentStatus.Running
            wait_for(head.getPose, lambda pose: pose.panSpeed > 0.05)


@pytest.mark.parametrize("carrier", cases([LOCAL], [NETWORK]))
def test_a_behavior_whose_server_was_killed_waits_for_somebody_to_look_at_the_robot(
    tmp_path: Path, carrier: str, endpoint: str, client: Communicator
) -> None:
    behavior = turning(tmp_path)
    with ExitStack() as stack:
        with server("naoserver.fake", endpoint) as process:
            component = stack.enter_context(start(behavior, endpoint))
            component.wait_for("turning")
            assert is_used(carrier, component.process.pid)
            kill(process)
        with server("naoserver.fake", endpoint):
            component.wait_for(f"the robot is stopped: {UNCLEAN}.*; pauses ")
            known(client).resetEmergencyStop(True)
            component.wait_for("commands are accepted again: continuing")


COMMANDER = """
import sys
from interfaces.nao import JointsPrx
from zenoh_ice import initialize
realm, endpoint, burst = sys.argv[1:]
with initialize(realm=realm, connect=[endpoint], clock="wall") as communicator:
    body = JointsPrx.checkedCast(communicator.stringToProxy("Body"))
    body.setJointPositions({"LShoulderPitch": -1.5, "HeadYaw": 1.0}, 0.007)
    print("commanded", flush=True)
    while True:  # so that many of its commands still wait for the robot when it dies
        calls = [body.setJointPositions.begin({"RShoulderPitch": -1.5}, 0.007) for _ in range(int(burst))]
        for call in calls:
            call.result()
"""


@pytest.fixture
def nao(by_environment: None) -> Iterator[RobotClient]:
    with served_to_client(FakeRobot(clock_at(3.0))) as nao:
        yield nao


@pytest.mark.parametrize(
    ("carrier", "burst"),
    cases([(LOCAL, 50), (NETWORK, 1)], [pytest.param(LOCAL, 1), pytest.param(NETWORK, 50)]),
)
def test_the_joints_of_a_killed_commander_stop_on_their_way(
    nao: RobotClient, carrier: str, burst: int
) -> None:
    body = nao.proxy(JointsPrx, "Body")
    left, right = (body.getJointNames().index(name) for name in ("LShoulderPitch", "RShoulderPitch"))
    at_first = body.getJointState().commands
    command = [sys.executable, "-c", COMMANDER, nao.realm, nao.endpoint, str(burst)]
    with ComponentProcess(command) as commander:
        commander.wait_for("commanded")
        wait_for(body.getJointState, lambda state: state.commands[right] < at_first[right] - 0.05)
        assert is_used(carrier, commander.process.pid)
        kill(commander)
        health = nao.proxy(HealthPrx, "Health")
        eventually(
            lambda: any(
                "the client that commanded it is gone" in each.message for each in health.getHealth().events
            )
        )
        there = body.getJointState()
        assert there.commands[left] > -1.4, "far before its goal"
        later = wait_for(body.getJointState, lambda state: state.time > there.time + 1.0)
        assert later.commands == there.commands


def test_a_client_asks_whether_something_still_moves_because_it_commanded_it(nao: RobotClient) -> None:
    head, safety = nao.proxy(PoseHeadPrx, "Head"), nao.proxy(SafetyPrx, "Safety")
    assert not safety.isMoving()
    head.setPose(0.5, 0.0, 0.1)
    assert safety.isMoving()
    with nao.client() as other:
        assert not other.proxy(SafetyPrx, "Safety").isMoving()
    eventually(lambda: not safety.isMoving())
    assert nao.robot.read().commands[0] == pytest.approx(0.5, abs=0.001)
