"""Faults around a robot server: clients that die or hang, cameras that fail, payloads that are too large."""

import signal
import sys
import threading

import pytest

from interfaces.jderobot import CameraPrx, HardwareFailedException
from interfaces.nao import ClockPrx, HealthPrx, JointsPrx, PoseHeadPrx, SafetyPrx
from naoserver.fake import FakeRobot
from naoserver.fake.__main__ import app
from naoserver.options import SafetyOptions, ServerOptions
from tests.support.carriers import LOCAL, NETWORK, is_used, over_both
from tests.support.commands import run_here
from tests.support.limits import END_LIMIT, EVENT_LIMIT, FOREVER
from tests.support.processes import ComponentProcess, module
from tests.support.robot_server import eventually, served_to_client, wait_for
from tests.support.soak import cases
from zenoh_ice import MarshalException, UnknownException

DRIVER = """
import sys, time
from interfaces.nao import PoseHeadPrx
from zenoh_ice import initialize
realm, endpoint, period = sys.argv[1:]
with initialize(realm=realm, connect=[endpoint], clock="wall") as communicator:
    head = PoseHeadPrx.checkedCast(communicator.stringToProxy("Head"))
    head.setSpeed(0.1, 0.0)
    print("driving", flush=True)
    while True:
        time.sleep(float(period))
        head.setSpeed(0.1, 0.0)
"""

INSISTENT = DRIVER.replace(
    "        head.setSpeed(0.1, 0.0)\n",
    "        try:\n"
    "            head.setSpeed(0.1, 0.0)\n"
    "        except Exception as refusal:\n"
    "            print(refusal, flush=True)\n",
)
"""Drives on whatever it is told."""

WATCHER = """
import sys, time
from interfaces.jderobot import CameraPrx
from zenoh_ice import initialize
realm, endpoint = sys.argv[1:]
with initialize(realm=realm, connect=[endpoint], clock="wall") as communicator:
    CameraPrx.checkedCast(communicator.stringToProxy("Camera")).startCameraStreaming()
    print("streaming", flush=True)
    time.sleep(600)
"""


def driver(nao, period=0.05, program=DRIVER):
    return ComponentProcess([sys.executable, "-c", program, nao.realm, nao.endpoint, str(period)])


def is_driven(pose):
    return pose.panSpeed > 0.08


def stands(pose):
    return abs(pose.panSpeed) < 0.01


@pytest.fixture
def nao(by_environment):
    with served_to_client(FakeRobot()) as nao:
        yield nao


@pytest.fixture
def patient(by_environment):
    """A robot that does not mind when a velocity is not renewed: a busy machine may not get to it."""
    options = ServerOptions(safety=SafetyOptions(velocity_timeout=FOREVER))
    with served_to_client(FakeRobot(), options) as nao:
        yield nao


@over_both
def test_the_death_of_the_client_is_enough_the_timeout_need_not_pass(patient, carrier):
    head = patient.proxy(PoseHeadPrx, "Head")
    with driver(patient) as behavior:
        behavior.wait_for("driving")
        wait_for(head.getPose, is_driven)
        assert is_used(carrier, behavior.process.pid)
        at = head.getPose().pan
        behavior.process.kill()
        behavior.wait()
        stopped = wait_for(head.getPose, stands)
    assert stopped.pan - at < 1.0, "far before its limit"
    assert patient.robot.read().velocities[0] == pytest.approx(0.0, abs=0.01)
    report = patient.proxy(HealthPrx, "Health").getHealth()
    assert report.velocityTimeouts == 0
    assert any("HeadYaw" in event.message and "gone" in event.message for event in report.events)


@pytest.mark.parametrize("carrier", cases([LOCAL], [NETWORK]))
def test_a_behavior_that_hangs_while_the_head_turns_leaves_it_standing(nao, carrier):
    head = nao.proxy(PoseHeadPrx, "Head")
    with driver(nao) as behavior:
        behavior.wait_for("driving")
        wait_for(head.getPose, is_driven)
        assert is_used(carrier, behavior.process.pid)
        behavior.process.send_signal(signal.SIGSTOP)
        at = head.getPose().pan
        try:
            stopped = wait_for(head.getPose, stands)
            assert stopped.pan - at < 1.0, "far before its limit"
            assert nao.proxy(HealthPrx, "Health").getHealth().velocityTimeouts >= 1
        finally:
            behavior.process.send_signal(signal.SIGCONT)


@pytest.mark.parametrize("carrier", cases([NETWORK], [LOCAL]))
def test_a_reset_starts_nothing_of_a_program_that_was_held_until_its_link_broke(nao, carrier):
    head, safety = nao.proxy(PoseHeadPrx, "Head"), nao.proxy(SafetyPrx, "Safety")
    with driver(nao, program=INSISTENT) as behavior:
        wait_for(head.getPose, is_driven)
        assert is_used(carrier, behavior.process.pid)
        safety.emergencyStop("enough")
        behavior.wait_for("the robot is stopped: enough")
        behavior.process.send_signal(signal.SIGSTOP)
        try:
            (client,) = nao.assembly.gate._commanders._ended
            eventually(lambda: nao.assembly.gate.is_lost(client))
            wait_for(head.getPose, stands)
            safety.resetEmergencyStop()
        finally:
            behavior.process.send_signal(signal.SIGCONT)
        behavior.wait_for("the emergency stop ended the commands")
        sample = head.getPose.wait(timeout=EVENT_LIMIT)
        for _ in range(25):
            sample = head.getPose.wait(after=sample, timeout=EVENT_LIMIT)
            assert stands(sample.value)


@pytest.mark.parametrize("carrier", cases([NETWORK], [LOCAL]))
def test_one_behaviors_death_does_not_stop_what_another_drives(patient):
    head = patient.proxy(PoseHeadPrx, "Head")
    with driver(patient) as first:
        first.wait_for("driving")
        first.process.send_signal(signal.SIGSTOP)  # it has commanded, but commands no more
        done, taken_over = threading.Event(), threading.Event()

        def renew():
            while not done.wait(0.05):
                head.setSpeed(0.1, 0.0)
                taken_over.set()

        renewing = threading.Thread(target=renew)
        renewing.start()
        try:
            assert taken_over.wait(EVENT_LIMIT)
            wait_for(head.getPose, is_driven)
            first.process.kill()
            first.wait()
            sample = head.getPose.wait(timeout=EVENT_LIMIT)
            for _ in range(25):  # half a second
                sample = head.getPose.wait(after=sample, timeout=EVENT_LIMIT)
                assert is_driven(sample.value)
        finally:
            done.set()
            renewing.join(EVENT_LIMIT)


def test_a_camera_without_gl_names_the_package_and_all_else_works():
    with served_to_client(FakeRobot(camera_failure="no EGL: install it with 'apt install libegl1'")) as nao:
        camera = nao.proxy(CameraPrx, "Camera")
        for call in (lambda: camera.getImageData("RGB8"), camera.startCameraStreaming):
            with pytest.raises(HardwareFailedException, match="libegl1"):
                call()
        with camera.getImageData.subscribe(lambda sample: None):
            report = nao.proxy(HealthPrx, "Health").getHealth()
            assert any(e.source == "Camera" and "libegl1" in e.message for e in report.events)
            wait_for(nao.proxy(PoseHeadPrx, "Head").getPose, lambda _: True)


def test_a_camera_streams_no_longer_than_the_client_that_started_it_lives(nao):
    camera = nao.proxy(CameraPrx, "Camera")
    with ComponentProcess([sys.executable, "-c", WATCHER, nao.realm, nao.endpoint]) as watcher:
        watcher.wait_for("streaming")
        assert camera.getCameraDescription().streamingUri
        watcher.process.kill()
        eventually(lambda: not camera.getCameraDescription().streamingUri)


class BrokenCamera(FakeRobot):
    def capture(self, camera, width, height):
        raise ValueError("not one of the errors it may raise")


def test_a_robot_that_breaks_its_word_does_not_take_the_server_down(caplog):
    with served_to_client(BrokenCamera()) as nao:
        camera = nao.proxy(CameraPrx, "Camera")
        with pytest.raises(UnknownException, match="not one of the errors"):
            camera.getImageData("RGB8")
        with camera.getImageData.subscribe(lambda sample: None):
            wait_for(nao.proxy(PoseHeadPrx, "Head").getPose, lambda _: True)
        assert nao.proxy(ClockPrx, "Clock").getTime().time > 0


@pytest.mark.parametrize("count", [200_000])
def test_an_oversized_payload_is_refused_and_the_server_lives(nao, count):
    body = nao.proxy(JointsPrx, "Body")
    with pytest.raises(MarshalException, match="setJointPositions"):
        body.setJointPositions({f"Joint{number}": 0.0 for number in range(count)}, 0.1)
    assert len(body.getJointState().positions) == 26


def test_ctrl_c_ends_the_fake_server_cleanly():
    with ComponentProcess(module("naoserver.fake", "--listen", "tcp/127.0.0.1:0")) as server:
        server.wait_for("ready")
        server.process.send_signal(signal.SIGINT)
        assert server.wait(END_LIMIT) == 130
        assert "Traceback" not in server.output


def test_the_fake_says_how_to_use_it():
    done = run_here(app, "naoserver.fake", "--help")
    assert done.returncode == 0
    assert "Examples" in done.stdout
