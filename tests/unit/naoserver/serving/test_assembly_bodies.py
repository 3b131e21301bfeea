"""Every body that is known by name is served by what it has, as the fake robot and as the simulated one."""

from types import SimpleNamespace
from typing import Any

import pytest

from interfaces.jderobot import Pose3DMotorsData
from naoserver.bodies import BODY_NAMES, find_body
from naoserver.fake import FakeRobot
from naoserver.moves.motion_file import load_motions
from naoserver.options import ServerOptions
from naoserver.serving.assembly import Assembly
from naoserver_sim.robot import SimulatedRobot
from zenoh_ice import VirtualClock

CLIENT: Any = SimpleNamespace(client="anna")
ALWAYS = {"Body", "Clock", "Description", "Health", "Safety", "Team"}


def expected(body):
    """Return what a robot of a body serves, whether it is simulated, real or fake."""
    hinges = {f"{name}{part}" for name in body.hinges for part in ("Motors", "Encoders")}
    parts = {
        "InertialUnit": body.inertial_unit,
        "FootPressure": any(sole.pressure for sole in body.soles),
        "Sonar": body.sonar,
        "Sight": body.cameras,
        "Touch": body.touch,
        "Battery": body.battery,
        "Leds": body.lights,
        **dict.fromkeys(("Speech", "Sounds"), body.voice),
        "Motions": load_motions(body),
        "Postures": body.postures,
        **dict.fromkeys(("Head", "NeckSpeed"), {"pan", "tilt"} <= body.hinges.get("Neck", {}).keys()),
        **dict.fromkeys(("Motors", "Encoders", "Walk"), body.walk),
        **dict.fromkeys((camera.name for camera in body.cameras), True),
    }
    return ALWAYS | hinges | {name for name, part in parts.items() if part}


def served(robot, clock):
    names = Assembly(robot, ServerOptions(), clock).servants
    return {name for name in names if not name.startswith("Ball")}


@pytest.mark.parametrize("name", BODY_NAMES)
def test_the_fake_robot_serves_what_its_body_has(name):
    body, clock = find_body(name), VirtualClock()
    assert served(FakeRobot(clock, body=body), clock) == expected(body) | {"Faults"}


@pytest.mark.sim
@pytest.mark.parametrize("name", BODY_NAMES)
def test_the_simulated_robot_serves_what_its_body_has(name):
    body, clock = find_body(name), VirtualClock()
    robot = SimulatedRobot(clock=clock, skin=False, body=body)
    stage = {"Faults", "GroundTruth", "Hearing", "Scene", "CameraOutside"}
    assert served(robot, clock) == expected(body) | stage
    robot.close()


@pytest.mark.parametrize("name", BODY_NAMES)
def test_every_axis_of_every_hinge_goes_where_it_is_sent_and_says_that_it_is_there(name):
    body, clock = find_body(name), VirtualClock()
    robot = FakeRobot(clock, body=body)
    assembly = Assembly(robot, ServerOptions(), clock)
    servants: dict[str, Any] = dict(assembly.servants)
    for hinge, axes in body.hinges.items():
        motors, encoders = servants[f"{hinge}Motors"], servants[f"{hinge}Encoders"]
        params = motors.getPose3DMotorsParams(CLIENT)
        goals = {}
        for axis in axes:
            lower, upper = (getattr(params, f"{end}{axis.capitalize()}") for end in ("min", "max"))
            assert lower < upper, f"{hinge} {axis}"
            goals[str(axis)] = lower + 0.4 * (upper - lower)
        rest = dict.fromkeys(Pose3DMotorsData.__struct_fields__, 0.0)
        motors.setPose3DMotorsData(
            Pose3DMotorsData(**(rest | goals | {"panSpeed": 5.0, "tiltSpeed": 5.0})), CLIENT
        )
        for _ in range(100):
            clock.advance(0.05)
            assembly.body.watch()
        there = encoders.getPose3DEncodersData(CLIENT)
        sent = motors.getPose3DMotorsData(CLIENT)
        for axis in axes:
            assert getattr(there, axis) == pytest.approx(getattr(sent, axis), abs=1e-6), f"{hinge} {axis}"
            joint = axes[axis].joint
            angle = robot.read().positions[body.joint_names.index(joint)]
            assert axes[axis].joint_angle(getattr(there, axis)) == pytest.approx(angle), f"{hinge} {axis}"
