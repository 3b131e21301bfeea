"""Keep your programs: those of ROS 2 and of the makers of robots drive ours."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import pytest

from interfaces.jderobot import EncodersPrx, MotorsPrx
from naoserver.bodies import find_body
from naoserver.fake import FakeRobot
from naoserver.options import ServerOptions
from naoserver.protocol.jobs import JobThreads
from naoserver.serving.assembly import Assembly
from tests.doors.conftest import ServedRobot
from tests.support.limits import CALL_LIMIT
from tests.support.plugins import needs
from tests.support.present import present
from tests.support.processes import ComponentProcess, module
from tests.support.robot_server import eventually
from tests.support.waiting import until
from zenoh_ice import Settings, WallClock


@needs("visualhfsm_ros2")
@pytest.mark.promise("the robot is a node of ROS 2, without ROS")
def test_a_velocity_of_ros_drives_the_walk_and_silence_stops_it(fake: ServedRobot) -> None:
    from zenoh_ros2 import Node

    words = ("--connect", fake.endpoint, "--listen", "tcp/127.0.0.1:0")
    settings = Settings(connect=(fake.endpoint,), listen=("tcp/127.0.0.1:0",), lease=CALL_LIMIT)
    with (
        ComponentProcess(module("visualhfsm_ros2.gateway", *words)) as process,
        fake.client() as communicator,
        Node("tester", settings=settings) as node,
    ):
        process.wait_for("^ready: /nao, ")
        motors = MotorsPrx.checkedCast(communicator.stringToProxy("Motors"))
        encoders = EncodersPrx.checkedCast(communicator.stringToProxy("Encoders"))
        start = encoders.getEncodersData().robotx
        velocity = node.create_publisher("geometry_msgs/msg/Twist", "/cmd_vel")

        def commanded() -> tuple[float, float, float]:
            return motors.getV(), motors.getL(), motors.getW()

        def walks() -> bool:
            velocity.publish(linear={"x": 0.1, "y": 0.05}, angular={"z": 0.3})
            moved = encoders.getEncodersData().robotx > start + 0.01
            return moved and commanded() == pytest.approx((0.1, 0.05, 0.3))

        eventually(walks)
        eventually(lambda: commanded() == (0.0, 0.0, 0.0))


@needs("visualhfsm_naoqi")
@pytest.mark.promise(
    "the simulated Nao, G1 and T1 answer programs that were written for their makers' packages"
)
def test_a_program_of_naoqi_turns_the_head_and_memory_reports_it(simulated: ServedRobot) -> None:
    pytest.importorskip("qi", reason="libqi has no package for this Python")
    from plugins.naoqi.tests.support.naoqi import connected, eventually_near

    url = simulated.process.wait_for(r"(tcp://127\.0\.0\.1:\d+)")[1]
    with connected(url) as session:
        motion, memory = session.service("ALMotion"), session.service("ALMemory")
        motion.setAngles("HeadYaw", 0.5, 1.0)
        reading = "Device/SubDeviceList/HeadYaw/Position/Sensor/Value"
        eventually_near(lambda: memory.getData(reading), 0.5, 0.05)
        assert motion.getAngles(["HeadYaw"], False) == pytest.approx([0.5])


@contextmanager
def served_to_programs(body: str, entrance: Any, domain: int) -> Iterator[FakeRobot]:
    """Serve a robot without physics to the programs of its maker."""
    clock = WallClock()
    robot = FakeRobot(clock, body=find_body(body))
    assembly = Assembly(robot, ServerOptions(), clock)
    watchdog, *_ = assembly.jobs
    try:
        with JobThreads([watchdog]), present(entrance.serve)(robot, assembly, {"dds_domain": domain}):
            yield robot
    finally:
        assembly.close()
        robot.close()


def check_that_the_walk_ends_with_its_program(robot: FakeRobot, begin: Callable[[], object]) -> None:
    walker = present(robot.walker)
    program = begin()
    assert walker.commanded().forward > 0.0
    del program
    until(lambda: walker.commanded().forward == 0.0)


@needs("visualhfsm_makers")
@pytest.mark.promise(
    "the simulated Nao, G1 and T1 answer programs that were written for their makers' packages"
)
def test_a_program_of_unitree_walks_until_it_ends() -> None:
    pytest.importorskip("cyclonedds", reason="the extra unitree is not installed")
    from plugins.makers.tests.support.dds import free_domain
    from plugins.makers.tests.support.unitree import CONTINUOUS, Program
    from visualhfsm_makers import UNITREE

    domain = free_domain()

    def begin() -> Program:
        program = Program(domain)
        program.call(7105, CONTINUOUS)
        return program

    with served_to_programs("G1", UNITREE, domain) as robot:
        check_that_the_walk_ends_with_its_program(robot, begin)


@needs("visualhfsm_makers")
@pytest.mark.promise(
    "the simulated Nao, G1 and T1 answer programs that were written for their makers' packages"
)
def test_a_program_of_booster_walks_until_it_ends() -> None:
    pytest.importorskip("cyclonedds", reason="the extra booster is not installed")
    from plugins.makers.tests.support.booster import MOVE, Program
    from plugins.makers.tests.support.dds import free_domain
    from visualhfsm_makers import BOOSTER

    domain = free_domain()

    def begin() -> Program:
        program = Program(domain)
        program.call(*MOVE)
        return program

    with served_to_programs("T1", BOOSTER, domain) as robot:
        check_that_the_walk_ends_with_its_program(robot, begin)
