"""The command `naoserver-sim` as a separate process."""

import signal
import time

import pytest

from interfaces.jderobot import CameraPrx, HardwareFailedException, Pose3DEncodersPrx
from interfaces.nao import ClockPrx, PoseHeadPrx
from naoserver.bodies.nao import H25
from naoserver.errors import RobotError
from naoserver_sim._command import app
from tests.support.commands import run_here
from tests.support.limits import END_LIMIT, START_LIMIT
from tests.support.processes import ComponentProcess, announced, free_endpoint, module
from tests.support.robot_server import wait_for
from tests.support.soak import cases
from zenoh_ice import initialize

pytestmark = pytest.mark.sim


def server(endpoint, *options, environment=None):
    command = module("naoserver_sim", "--listen", endpoint, "--no-skin", *options)
    return ComponentProcess(command, environment)


@pytest.fixture
def endpoint():
    return free_endpoint()


@pytest.fixture(scope="module")
def communicator():
    """The session of a client of a simulation without GL, slow and with slow joints."""
    endpoint = free_endpoint()
    options = ("--speed", "0.2", "--joint-speed", "0.8")
    with server(endpoint, *options, environment={"MUJOCO_GL": "disable"}) as process:
        process.wait_for("^ready")
        with initialize(connect=[endpoint], listen=["tcp/127.0.0.1:0"]) as communicator:
            yield communicator


@pytest.mark.gl  # without GL there is a warning
def test_it_says_when_it_is_ready_has_the_cameras_asked_for_and_ends_cleanly_at_ctrl_c(endpoint):
    with server(endpoint, "--realm", "two", "--camera", "Camera=640x480@15") as process:
        process.wait_for(f"^ready: realm two, {endpoint}, 3 cameras$")
        with initialize(realm="two", connect=[endpoint], listen=["tcp/127.0.0.1:0"]) as communicator:
            camera = CameraPrx.checkedCast(communicator.stringToProxy("Camera"))
            image = camera.getImageData.wait(timeout=START_LIMIT).value
            assert (image.description.width, image.description.height) == (640, 480)
            assert len(image.pixelData) == 640 * 480 * 3
        process.process.send_signal(signal.SIGINT)
        assert process.wait() == 130
        # On a busy machine, the simulator rightly reports that it, or the camera before the image, is late.
        late = "does not keep up", "no image of 640x480 within 1 s"
        lines = [line for line in process.output.splitlines() if not any(text in line for text in late)]
        assert len(lines) == 1, process.output


def test_head_turns_and_balls_hang_in_the_air(communicator):
    head = PoseHeadPrx.checkedCast(communicator.stringToProxy("Head"))
    full = H25.joints[H25.joint_names.index("HeadYaw")].max_velocity
    assert head.getLimits().maxPanSpeed == pytest.approx(0.8 * full)
    head.setPose(0.5, 0.1, 0.5)
    for sample in head.getPose.samples(timeout=START_LIMIT):
        if abs(sample.value.pan - 0.5) < 0.02:
            break
    ball = Pose3DEncodersPrx.checkedCast(communicator.stringToProxy("BallGreenEncoders"))
    assert ball.getPose3DEncodersData().z == pytest.approx(0.5, abs=1e-3)


def test_clock_reports_that_it_is_simulated_and_how_fast(communicator):
    clock = ClockPrx.checkedCast(communicator.stringToProxy("Clock"))
    reading = clock.getTime()
    assert reading.simulated
    assert 0.0 < reading.rate < 0.5
    wait_for(clock.getTime, lambda later: later.time > reading.time)


def test_without_gl_a_camera_call_says_why_and_the_rest_works(communicator):
    camera = CameraPrx.checkedCast(communicator.stringToProxy("Camera"))
    with pytest.raises(HardwareFailedException, match=r"MUJOCO_GL=\w+: unset it"):
        camera.getImageData("RGB8")
    assert PoseHeadPrx.checkedCast(communicator.stringToProxy("Head")).getPose().time > 0


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--speed", "fast"], "'fast' is not a speed"),
        (["--body", "H30"], "there is no body 'H30'; there are H25, H21"),
    ],
)
def test_what_it_cannot_do_it_says(endpoint, options, message):
    done = run_here(app, "naoserver-sim", "--listen", endpoint, *options, expected=(RobotError,), columns=200)
    assert done.returncode in {1, 2}
    assert message in done.stderr


@pytest.mark.parametrize(
    ("delay", "signal_number"),
    cases(
        [(0.0, signal.SIGINT), (0.2, signal.SIGTERM)],
        [
            pytest.param(0.1, signal.SIGTERM),
            pytest.param(0.15, signal.SIGINT),
            pytest.param(0.3, signal.SIGINT),
        ],
    ),
)
def test_a_signal_in_the_middle_of_the_start_leaves_nothing_behind(endpoint, signal_number, delay):
    with ComponentProcess(announced("naoserver_sim.__main__", "--listen", endpoint, "--no-skin")) as process:
        process.wait_for("starting")
        time.sleep(delay)  # however far it has come by then, it ends quietly
        process.process.send_signal(signal_number)
        assert process.wait(END_LIMIT) in {128 + signal_number, -signal_number}, process.output
        assert "Traceback" not in process.output
