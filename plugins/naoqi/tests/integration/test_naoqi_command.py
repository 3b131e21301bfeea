"""The command naoserver-naoqi, where it serves in a separate process."""

import os
import re
import signal
import subprocess
import sys
from contextlib import closing, contextmanager, suppress

import pytest
import typer

pytest.importorskip("qi", reason="a real robot needs libqi: pip install 'visualhfsm[naoqi]'")

from interfaces.jderobot import CameraPrx, CommandRefusedException, HardwareFailedException, MotorsPrx
from interfaces.nao import PoseHeadPrx
from naoserver.errors import RobotError
from plugins.naoqi.tests.support.naoqi import call
from plugins.naoqi.tests.support.robots import fake_as_naoqi
from tests.support.commands import run_here
from tests.support.limits import CALL_LIMIT, RUN_LIMIT
from tests.support.processes import REPOSITORY, ComponentProcess, announced, free_endpoint, module
from tests.support.robot_server import eventually, wait_for
from visualhfsm_naoqi.robot._command import app, parse_address
from visualhfsm_naoqi.robot._libqi_link import connect
from visualhfsm_naoqi.robot._link import NAME, RobotAddress
from zenoh_ice import initialize

SUBSCRIBERS = "ALVideoDevice.getSubscribers"


@pytest.fixture(scope="module")
def url():
    with fake_as_naoqi(speed=3.0) as url:
        yield url


@pytest.fixture
def link(url):
    with closing(connect(RobotAddress.parse(url), CALL_LIMIT)) as link:
        yield link


@contextmanager
def served(url, *options):
    """Start the command; yield the process, and a communicator that is connected to it."""
    endpoint = free_endpoint()
    command = module("visualhfsm_naoqi.robot", "--robot", url, "--listen", endpoint, *options)
    with ComponentProcess(command) as process:
        process.wait_for("^ready: realm nao, .*, robot tcp://")
        with initialize(connect=[endpoint], listen=["tcp/127.0.0.1:0"], clock="wall") as communicator:
            yield process, communicator


def take_picture(communicator):
    """Ask for a picture until there is one: on a busy machine, the robot may seem lost for a moment."""
    camera = CameraPrx.checkedCast(communicator.stringToProxy("Camera"))

    def taken():
        try:
            return camera.getImageData("RGB8")
        except HardwareFailedException:
            return None

    eventually(taken)


def test_it_leaves_the_robot_as_wished_and_its_cameras_also_after_a_crash_by_the_next_start(url, link):
    with served(url) as (process, communicator):
        assert call(link, SUBSCRIBERS) == []
        take_picture(communicator)
        assert len(call(link, SUBSCRIBERS)) == 1
        process.process.kill()
        assert process.wait() == -signal.SIGKILL
    # The virtual NAOqi ends the subscription of a killed program; a robot keeps it, as here.
    call(link, "ALVideoDevice.subscribeCamera", NAME, 0, 1, 11, 10)
    assert len(call(link, SUBSCRIBERS)) == 1

    with served(url, "--start", "stiffen", "--end", "limp") as (process, communicator):
        assert call(link, SUBSCRIBERS) == [], "what was left of the one before"
        take_picture(communicator)
        assert len(call(link, SUBSCRIBERS)) == 1
        head = PoseHeadPrx.checkedCast(communicator.stringToProxy("Head"))
        head.setPose(0.3, 0.1, 1.0)
        wait_for(head.getPose, lambda pose: abs(pose.pan - 0.3) < 0.02)
        process.process.send_signal(signal.SIGINT)
        assert process.wait() == 130
    assert call(link, SUBSCRIBERS) == []
    assert call(link, "ALMotion.getAngles", ["HeadYaw"], True)[0] == pytest.approx(0.3, abs=0.02)
    assert set(call(link, "ALMotion.getStiffnesses", "Body")) == {0.0}


def test_a_killed_server_does_not_leave_the_robot_walking(url, link):
    with served(url, "--start", "stiffen") as (process, communicator):
        motors = MotorsPrx.checkedCast(communicator.stringToProxy("Motors"))

        def walks():
            with suppress(
                CommandRefusedException
            ):  # on a busy machine the robot may be out of reach meanwhile
                motors.setV(0.05)  # again and again: it is obeyed for half a second
            return call(link, "ALMotion.moveIsActive")

        eventually(walks)
        process.process.kill()
        process.wait_for("the server ended without warning: the robot was stopped")
        eventually(lambda: not call(link, "ALMotion.moveIsActive"))


def test_ctrl_c_while_it_starts_ends_it_quietly():
    with ComponentProcess(
        announced("visualhfsm_naoqi.robot.__main__", "--robot", "tcp://127.0.0.1:1")
    ) as process:
        process.wait_for("starting")
        process.process.send_signal(signal.SIGINT)
        assert process.wait() in (130, 1)  # it may have found by then that nobody is there
        assert "Traceback" not in process.output


def test_a_robot_that_is_not_there_is_one_line():
    options = ("--robot", "tcp://127.0.0.1:1", "--listen", "tcp/127.0.0.1:0")
    done = run_here(app, "naoserver-naoqi", *options, expected=(RobotError,))
    assert done.returncode == 1
    assert re.search(r"cannot connect to tcp://127\.0\.0\.1:1: .*refused.*is the robot on", done.stderr)


def test_a_robot_that_is_no_nao_is_refused_by_name():
    options = ("--robot", "tcp://127.0.0.1:1", "--body", "T1")
    done = run_here(app, "naoserver-naoqi", *options, expected=(RobotError,))
    assert done.returncode == 1
    assert "drives NAOqi, the system of the Nao; this robot is a Booster T1" in done.stderr


@pytest.mark.parametrize(
    ("robot", "reason"), [("ftp://nao.local", "tcp://"), ("tcps://nao.local", "requires a login")]
)
def test_an_address_that_cannot_be_is_refused(robot, reason):
    with pytest.raises(typer.BadParameter, match=reason):
        parse_address(robot, "nao", "")


def test_a_login_is_kept_for_where_it_is_wanted():
    assert parse_address("tcps://nao.local", "nao", "secret").user == "nao"
    assert parse_address("tcp://nao.local", "nao", "").user == ""


def test_it_names_what_is_not_installed(tmp_path):
    (tmp_path / "qi.py").write_text("raise ModuleNotFoundError(\"No module named 'qi'\", name='qi')")
    done = subprocess.run(
        [
            sys.executable,
            "-c",
            "from visualhfsm_naoqi.robot.__main__ import main; main()",
            "--robot",
            "tcp://nao.local",
        ],
        capture_output=True,
        text=True,
        cwd=REPOSITORY,
        env={**os.environ, "PYTHONPATH": os.pathsep.join((str(tmp_path), *sys.path))},
        timeout=RUN_LIMIT,
        check=False,
    )
    assert done.returncode == 1
    assert "qi is not installed; type: pip install 'visualhfsm[naoqi]'" in done.stderr


def test_a_module_that_hides_the_interfaces_is_named(tmp_path):
    hiding = tmp_path / "interfaces.py"
    hiding.write_text("raise RuntimeError('it was executed')\n")
    done = subprocess.run(
        [sys.executable, "-P", "-m", "visualhfsm_naoqi.robot"],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": os.pathsep.join((str(tmp_path), *sys.path))},
        timeout=RUN_LIMIT,
        check=False,
    )
    expected = f"robot: error: {hiding} hides the package interfaces of VisualHFSM: rename it\n"
    assert (done.returncode, done.stdout) == (1, expected)


def test_the_password_may_come_from_the_environment(monkeypatch):
    """Its name may not look like a setting's: a setting that does not exist ends every command."""
    monkeypatch.setenv("NAOQI_PASSWORD", "secret")
    options = ("--robot", "tcps://127.0.0.1:1", "--listen", free_endpoint())
    refused = run_here(app, "naoserver-naoqi", *options, expected=(RobotError,))
    assert "cannot connect to tcps://127.0.0.1:1" in refused.stderr
    assert "password" not in refused.stderr
