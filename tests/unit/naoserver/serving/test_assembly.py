"""Everything between a robot and its clients as a whole: how its parts interact."""

import pytest
from msgspec.structs import replace

from interfaces.nao import ActionStatus
from naoserver.body import Body
from naoserver.errors import HardwareFailure, RobotError
from naoserver.fake import FakeRobot
from naoserver.options import ServerOptions
from naoserver.safety.latch import Latch
from naoserver.serving.assembly import Assembly
from naoserver_sim.robot import SimulatedRobot
from tests.support.bodies import CART
from tests.support.motion_rig import MotionRig
from zenoh_ice import VirtualClock, WallClock


class Stubborn:
    """A part that cannot be stopped."""

    name = "stubborn"

    def watch(self):
        return None

    def moves_for(self, client):
        return False

    def drop_client(self, client):
        raise HardwareFailure(f"cannot stop what {client} drives")

    def close(self):
        pass


def test_what_cannot_be_stopped_keeps_neither_the_lease_nor_the_joints_of_a_lost_client():
    clock = VirtualClock()
    robot = FakeRobot(clock)
    assembly = Assembly(robot, ServerOptions(), clock)
    assembly.watched.insert(0, Stubborn())
    assembly.watched.append(Stubborn())
    assembly.gate.acquire("client", "Anna", 60.0)
    assembly.body.drive({"HeadYaw": 0.5}, "client")
    with pytest.raises(HardwareFailure):
        assembly.drop_client("client")
    assert assembly.gate.state().holder == ""
    assert assembly.body.velocity("HeadYaw") == 0.0


@pytest.mark.parametrize(
    ("part", "identity"),
    [
        ({"cameras": [replace(CART.cameras[0], name="Safety")]}, "Safety"),
        ({"hinges": CART.hinges | {"": CART.hinges["Neck"]}}, "Encoders and Motors"),
        ({"hinges": CART.hinges | {"BallRed": CART.hinges["Neck"]}}, "BallRedEncoders and BallRedMotors"),
    ],
)
def test_no_part_takes_the_place_of_another_one(part, identity):
    clock = VirtualClock()
    robot = FakeRobot(clock, body=replace(CART, **part))
    with pytest.raises(RobotError, match=f"two parts of the robot Cart would be served as {identity}"):
        Assembly(robot, ServerOptions(), clock)


def test_a_body_without_a_single_joint_is_served():
    clock = VirtualClock()
    eye = Body(name="eye", links=CART.links[:1], cameras=(replace(CART.cameras[0], link="chassis"),))
    assembly = Assembly(FakeRobot(clock, body=eye), ServerOptions(), clock)
    assembly.gate.stop("test")
    assembly.body.hold()
    assert {"Body", "Camera", "Safety"} <= assembly.servants.keys()
    assembly.close()


def test_what_a_killed_server_left_on_its_way_is_held_by_the_next_one(tmp_path):
    Latch(tmp_path / "nao.json").__enter__().release()
    clock = VirtualClock()
    robot = FakeRobot(clock)
    robot.command_positions({"LShoulderPitch": -1.0}, {"LShoulderPitch": 0.1})
    clock.advance(0.5)
    with Latch(tmp_path / "nao.json") as latch:
        Assembly(robot, ServerOptions(), clock, latch)
        there = robot.read().commands
        clock.advance(5.0)
        assert robot.read().commands == there


@pytest.mark.sim
@pytest.mark.parametrize(
    "put", [lambda scene: scene.reset(None), lambda scene: scene.placeRobot(0.2, 0.0, 1.0, None)]
)
def test_a_robot_that_is_put_elsewhere_does_not_go_on_with_its_motion_there(put):
    clock = VirtualClock()
    rig = MotionRig(SimulatedRobot(clock=clock, skin=False), clock)
    start = rig.commands()
    rig.begin("wave")
    rig.let_go(1.0)
    assert rig.commands() != pytest.approx(start, abs=0.1)
    put(rig.assembly.servants["Scene"])
    rig.let_go(0.5)
    assert rig.player.progress("motion").status is ActionStatus.Stopped
    assert rig.commands() == pytest.approx(start)


def test_nothing_delays_the_watchdog_and_no_camera_anything_else():
    wall = WallClock()
    jobs = Assembly(FakeRobot(VirtualClock()), ServerOptions(), wall).jobs
    names = {job.thread: {other.name for other in jobs if other.thread == job.thread} for job in jobs}
    assert names == {
        "watchdog": {"watchdog"},
        "state": {"state", "motions", "walk", "paths", "places of the body", "team"},
        "reports": {"reports", "clock", "link"},
        "images of Camera": {"images of Camera"},
        "images of CameraBottom": {"images of CameraBottom"},
    }
    assert next(job for job in jobs if job.name == "watchdog").clock is wall
    for job in jobs:
        assert {other.clock for other in jobs if other.thread == job.thread} == {job.clock}
