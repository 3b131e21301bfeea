"""Use a real Nao, or your own servos, behind the same interfaces, and be able to stop them."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest

from interfaces.jderobot import CommandRefusedException, MotorsPrx
from interfaces.nao import JointsPrx, SafetyPrx
from naoserver.bodies.nao import H25
from naoserver.hardware.sim_bus import SimBus
from tests.doors.conftest import ServedRobot
from tests.support.limits import END_LIMIT, MOVE_LIMIT, RUN_LIMIT
from tests.support.nao_command import at, nao
from tests.support.places import ROOT
from tests.support.plugins import needs
from tests.support.processes import STEADY, ComponentProcess, free_endpoint, module
from tests.support.robot_server import eventually
from tests.support.security import Keys
from tests.support.stacks import stack_in
from tests.support.waiting import until
from zenoh_ice import initialize

YAW = H25.joint_names.index("HeadYaw")


@needs("visualhfsm_naoqi")
@pytest.mark.promise("**Use a real Nao")
def test_joints_go_where_they_are_sent_and_the_robot_reports() -> None:
    """By genuine libqi, with a fake robot in a separate process, which is served as NAOqi."""
    pytest.importorskip("qi", reason="a real robot needs libqi: pip install 'visualhfsm[naoqi]'")
    from plugins.naoqi.tests.support.naoqi import call, connect_patiently
    from visualhfsm_naoqi.robot._link import RobotAddress
    from visualhfsm_naoqi.robot._robot import NaoqiRobot

    with ComponentProcess(module("visualhfsm_naoqi.programs", "--qi", "tcp://127.0.0.1:0")) as process:
        address = RobotAddress.parse(process.wait_for(r"^ready: (\S+)")[1])
        with closing(NaoqiRobot(lambda _: connect_patiently(address))) as robot:
            robot.start()
            speeds = {"HeadYaw": 4.0, "LElbowRoll": 3.0}
            robot.command_positions({"HeadYaw": 0.4, "LElbowRoll": -0.9}, speeds)
            eventually(lambda: abs(robot.read().positions[YAW] - 0.4) < 0.01)
            assert robot.read().commands[YAW] == pytest.approx(0.4)
            with closing(connect_patiently(address)) as link:
                assert call(link, "ALMotion.getAngles", ["HeadYaw"], False) == [pytest.approx(0.4)]


@pytest.fixture
def bus(tmp_path: Path) -> Iterator[SimBus]:
    with closing(SimBus(4, tmp_path / "tty")) as bus:
        yield bus


@pytest.mark.promise("or your own servos** behind the same interfaces")
def test_a_server_of_own_servos_holds_the_joints_at_the_start_and_lets_them_go_at_the_end(
    bus: SimBus, tmp_path: Path
) -> None:
    endpoint = free_endpoint()
    environment = {**STEADY, "PYTHONPATH": str(ROOT), "XDG_STATE_HOME": str(tmp_path)}
    server = str(ROOT / "visualhfsm/_commands/template_hardware/server.py")
    options = ("--bus", str(bus.path), "--listen", endpoint, "--realm", "own")

    def stiffnesses() -> list[float]:
        with initialize(realm="own", connect=[endpoint], clock="wall") as communicator:
            body = JointsPrx.checkedCast(communicator.stringToProxy("Body"))
            return list(body.getJointState().stiffnesses)

    holding = [sys.executable, server, *options, "--start", "stiffen", "--end", "limp"]
    with ComponentProcess(holding, environment) as process:
        process.wait_for("^ready")
        until(lambda: stiffnesses() == [1.0] * 4, MOVE_LIMIT)
        process.process.terminate()
        assert process.wait(END_LIMIT) == 143
    with ComponentProcess([sys.executable, server, *options], environment) as process:
        process.wait_for("^ready")
        assert stiffnesses() == [0.0] * 4


@pytest.mark.promise("with limits, a lease and an emergency stop")
def test_who_holds_the_robot_moves_it_within_its_limits_and_everybody_stops_it(
    simulated: ServedRobot,
) -> None:
    with simulated.client() as mine, simulated.client() as other:
        body = JointsPrx.checkedCast(mine.stringToProxy("Body"))
        safety = SafetyPrx.checkedCast(mine.stringToProxy("Safety"))
        motors = MotorsPrx.checkedCast(mine.stringToProxy("Motors"))
        safety.acquireLease("Ann", 60.0)
        with pytest.raises(CommandRefusedException, match="Ann"):
            MotorsPrx.checkedCast(other.stringToProxy("Motors")).setV(0.05)
        body.setJointPositions({"HeadYaw": 9.0}, 1.0)
        limit = H25.joints[YAW].upper
        eventually(lambda: body.getJointState().positions[YAW] > limit - 0.05)
        assert body.getJointState().positions[YAW] < limit + 0.05

        with at(simulated.endpoint, "nao"):
            assert "stopped: the robot refuses commands" in nao("stop", "stairs ahead").out
            assert safety.getSafetyState().reason == "stairs ahead"
            with pytest.raises(CommandRefusedException):
                motors.setV(0.05)
            assert "reset: the robot accepts commands" in nao("stop", "--reset").out
        safety.releaseLease()
        assert not safety.getSafetyState().stopped


@pytest.mark.promise("[a lab](docs/how-to/lab.md)")
def test_a_laboratory_starts_in_order_and_roles_hold(tmp_path: Path) -> None:
    keys = Keys(tmp_path / "keys").folder
    environment = os.environ | {"VISUALHFSM_CONFIG": str(keys / "student.toml")}

    def call(*words: str) -> subprocess.CompletedProcess[str]:
        command = module("nao_tools", "call", *words)
        return subprocess.run(command, env=environment, capture_output=True, text=True, timeout=RUN_LIMIT)

    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as systemd:
        systemd.bind(f"{tmp_path}/systemd")
        systemd.settimeout(RUN_LIMIT)
        options = ("--machine", "simulation")
        with stack_in(tmp_path, "lab", *options, NOTIFY_SOCKET=f"{tmp_path}/systemd") as stack:
            stack.wait_for("simulator is ready after", RUN_LIMIT)
            assert [systemd.recv(64) for _ in ("router", "simulator")] == [b"READY=1", b"READY=1"]
            assert "router is ready after" in stack.output
            assert call("Head.getPose").returncode == 0
            refused = call("Head.setPose", "0.3", "0", "0.5")
            assert refused.returncode == 1
            assert "Head.setPose" in refused.stderr
