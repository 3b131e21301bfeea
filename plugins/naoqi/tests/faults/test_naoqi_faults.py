"""Faults of a robot over genuine libqi, and the errors that the server's clients get."""

import signal
import threading
from contextlib import closing, contextmanager

import pytest

pytest.importorskip("qi", reason="a real robot needs libqi: pip install 'visualhfsm[naoqi]'")

from interfaces.jderobot import CameraPrx, CommandRefusedException
from interfaces.nao import HealthPrx, JointsPrx, PoseHeadPrx, Severity
from naoserver.errors import RobotError
from naoserver.hardware.connection import HardwareLimits
from naoserver.hardware.serving import serve_hardware
from naoserver.safety.latch import latch_of
from plugins.naoqi.tests.support.naoqi import call, connect_patiently
from tests.support.limits import CALL_LIMIT
from tests.support.processes import ComponentProcess, free_endpoint, module
from tests.support.robot_server import eventually, served_to_client, wait_for
from visualhfsm_naoqi.robot._libqi_link import connect
from visualhfsm_naoqi.robot._link import RobotAddress
from visualhfsm_naoqi.robot._robot import LifecycleOptions, NaoqiRobot, NaoStart
from zenoh_ice.settings import Settings


@pytest.fixture(scope="module")
def process():
    with ComponentProcess(
        module("plugins.naoqi.tests.support.faulty", "--qi", "tcp://127.0.0.1:0")
    ) as process:
        yield process


@pytest.fixture(scope="module")
def address(process):
    return RobotAddress.parse(process.wait_for(r"^ready: (\S+)")[1])


@pytest.fixture
def nao(address):
    """The robot, served, and a client's session; everything goes well again at the end."""
    with reported(NaoqiRobot(lambda _: connect_patiently(address))) as nao:
        yield nao
    faults(address, "clear")


@contextmanager
def reported(robot):
    """Serve a robot that notifies the server's clients of what happens to it."""
    with served_to_client(robot) as nao:
        robot.lifecycle.report_to(nao.assembly)
        yield nao


def faults(address, operation, *arguments):
    with closing(connect(address, CALL_LIMIT)) as link:
        call(link, f"Faults.{operation}", *arguments)


@contextmanager
def frozen(process):
    """Let the robot's computer hang."""
    process.freeze()
    try:
        yield
    finally:
        process.process.send_signal(signal.SIGCONT)


def wait_for_event(nao, text):
    """Wait until the health report contains a text; return the event."""
    health = nao.proxy(HealthPrx, "Health")

    def find(report):
        return [event for event in report.events if text in event.message]

    return find(wait_for(health.getHealth, find))[-1]


def test_a_robot_that_hangs_is_reported_as_lost_and_refuses_commands_until_it_is_found(process, address):
    with reported(NaoqiRobot(lambda timeout: connect(address, timeout))) as nao:
        head = nao.proxy(PoseHeadPrx, "Head")

        def out_of_reach():
            try:
                head.setPose(0.2, 0.0, 0.5)
            except CommandRefusedException as refusal:
                return "unreachable" in str(refusal)
            return False

        with frozen(process):
            event = wait_for_event(nao, "lost the robot")
            assert event.level == Severity.Error
            eventually(out_of_reach)
            body = nao.proxy(JointsPrx, "Body")
            assert len(body.getJointState().positions) == 26, "what was measured last"
        wait_for_event(nao, "found the robot again")
        eventually(lambda: not out_of_reach())
        wait_for(head.getPose, lambda pose: abs(pose.pan - 0.2) < 0.02)


def test_a_connection_that_breaks_is_reported_and_made_again(nao, address):
    camera = nao.proxy(CameraPrx, "Camera")
    camera.getImageData("RGB8")
    faults(address, "disconnect")
    wait_for_event(nao, "lost the robot")
    wait_for_event(nao, "found the robot again")
    camera.getImageData("RGB8")
    head = nao.proxy(PoseHeadPrx, "Head")
    head.setPose(-0.2, 0.0, 1.0)
    wait_for(head.getPose, lambda pose: abs(pose.pan + 0.2) < 0.02)


def test_a_command_that_the_robot_refuses_is_reported(nao, address):
    faults(address, "fail", "ALMotion::setAngles", "the motors are too hot")
    nao.proxy(PoseHeadPrx, "Head").setPose(0.3, 0.0, 0.5)
    assert wait_for_event(nao, "the motors are too hot").level == Severity.Warning
    faults(address, "clear")
    head = nao.proxy(PoseHeadPrx, "Head")
    head.setPose(0.31, 0.0, 1.0)
    wait_for(head.getPose, lambda pose: abs(pose.pan - 0.31) < 0.02)


@contextmanager
def hanging_when_it_wakes_up(process, address, limits, until_it_goes_on=None):
    """Make a robot that stands up at its start; it hangs the first time, until a function has returned or the end."""
    waking = []

    def go_on():
        until_it_goes_on()
        process.process.send_signal(signal.SIGCONT)

    def connected(timeout):
        link = connect(address, timeout)
        begin = link.begin

        def begin_and_hang(operation, *arguments):
            reply = begin(operation, *arguments)
            if operation == "ALMotion.wakeUp":
                waking.append(operation)
                if len(waking) == 1:
                    process.freeze()
                    if until_it_goes_on is not None:
                        threading.Thread(target=go_on).start()
            return reply

        link.begin = begin_and_hang  # type: ignore[method-assign]
        return link

    try:
        with closing(NaoqiRobot(connected, LifecycleOptions(NaoStart.STAND), limits=limits)) as robot:
            yield robot, waking
    finally:
        process.process.send_signal(signal.SIGCONT)


@pytest.mark.slow
@pytest.mark.parametrize("seconds", [0.0, 1.2])
def test_a_robot_that_hangs_while_it_wakes_up_is_woken_up_again(process, address, caplog, seconds):
    def is_lost():
        eventually(lambda: "lost at its start" in caplog.text)
        threading.Event().wait(seconds)  # in which it is sought, again and again

    with hanging_when_it_wakes_up(process, address, HardwareLimits(), is_lost) as (robot, waking):
        robot.start()
        assert len(waking) > 1
        assert robot.postures.current() == "Stand"
    assert "lost at its start (ALMotion.wakeUp: " in caplog.text


@pytest.mark.slow
def test_a_robot_that_answers_nothing_once_it_wakes_up_ends_its_server_and_leaves_no_stop(process, address):
    settings = Settings(listen=(free_endpoint(),), connect=(), clock="wall")
    with (
        hanging_when_it_wakes_up(process, address, HardwareLimits(start=0.5)) as (robot, _),
        pytest.raises(RobotError, match=r"ALMotion\.wakeUp.*not found within 0\.5 s"),
    ):
        serve_hardware(robot, settings, lifecycle=robot.lifecycle)
    with latch_of(settings) as latch:
        assert latch is not None
        assert latch.found.stop == ""
