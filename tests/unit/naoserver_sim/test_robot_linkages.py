"""The simulation keeps passive joints, couplings, closed chains and hulls, in virtual time."""

from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
import pytest
from msgspec.structs import replace

from naoserver.bodies.parts import Gear, Joint, Link, Loop, Shape
from naoserver.body import Body
from naoserver_sim._motors import AMBIENT
from naoserver_sim.robot import SimulatedRobot
from naoserver_sim.world import load_world
from tests.support.linkage import LINKAGE
from zenoh_ice import VirtualClock

pytestmark = pytest.mark.sim

NAMES = LINKAGE.joint_names


@dataclass
class Rig:
    robot: SimulatedRobot
    clock: VirtualClock

    def run(self, seconds=1.0):
        """Let time pass; return the angles of the joints by name."""
        self.clock.advance(seconds)
        return self.angles()

    def angles(self):
        return dict(zip(NAMES, self.robot.read().positions, strict=True))

    def move(self, **targets):
        self.robot.command_positions(targets, dict.fromkeys(targets, 2.0))
        return self.run()


@pytest.fixture
def rig():
    clock = VirtualClock()
    robot = SimulatedRobot(clock=clock, body=LINKAGE, world=load_world("empty"))
    robot.start()
    yield Rig(robot, clock)
    robot.close()


def test_a_closed_chain_moves_as_one_motor_drives_it(rig):
    angles = rig.move(drive=0.5)
    assert angles["drive"] == pytest.approx(0.5, abs=0.02)
    assert angles["swing"] == pytest.approx(angles["drive"], abs=0.005)
    assert angles["pin"] == pytest.approx(-angles["drive"], abs=0.005)


def test_a_passive_joint_has_no_motor_and_is_read_as_any_other(rig):
    assert mujoco.mj_name2id(rig.robot._model.mj, mujoco.mjtObj.mjOBJ_ACTUATOR, "swing") == -1
    rig.move(drive=0.5)
    reading, place = rig.robot.read(), NAMES.index("swing")
    assert reading.commands[place] == reading.positions[place] != 0.0
    assert (reading.torques[place], reading.stiffnesses[place]) == (0.0, 0.0)
    assert reading.temperatures[place] == AMBIENT


@pytest.mark.parametrize("command", ["positions", "velocities", "stiffnesses"])
def test_a_command_to_a_passive_joint_is_refused(rig, command):
    more: dict[str, list[object]] = {"positions": [{"swing": 1.0}], "velocities": [], "stiffnesses": [0.1]}
    with pytest.raises(KeyError, match="swing"):
        getattr(rig.robot, f"command_{command}")({"swing": 0.5}, *more[command])


@pytest.mark.parametrize("target", [{"grip": 0.4}, {"pinch": -0.7}, {"grip": 0.4, "pinch": 0.0}])
def test_a_follower_is_where_its_leader_takes_it_whoever_is_commanded(rig, target):
    angles = rig.move(**target)
    assert angles["grip"] == pytest.approx(0.4, abs=0.01)
    assert angles["pinch"] == pytest.approx(0.1 - 2.0 * angles["grip"], abs=0.002)
    commands = dict(zip(NAMES, rig.robot.read().commands, strict=True))
    assert (commands["grip"], commands["pinch"]) == (pytest.approx(0.4), pytest.approx(-0.7))


def test_a_velocity_of_a_follower_is_that_of_its_leader_by_the_ratio(rig):
    rig.robot.command_velocities({"pinch": -0.4})
    angles = rig.run()
    assert angles["grip"] == pytest.approx(0.2, abs=0.01)


def test_followers_begin_where_their_leaders_take_them(rig):
    assert rig.angles()["pinch"] == pytest.approx(0.1, abs=0.002)


def test_joints_are_placed_and_held_there_unless_they_are_passive(rig):
    rig.robot.place({"drive": 0.3, "pin": -0.3, "swing": 0.3, "pinch": -0.3, "grip": 0.2})
    assert rig.angles() == pytest.approx(
        {"drive": 0.3, "pin": -0.3, "swing": 0.3, "grip": 0.2, "pinch": -0.3}
    )
    assert rig.run()["drive"] == pytest.approx(0.3, abs=0.02)
    assert rig.angles()["pinch"] == pytest.approx(-0.3, abs=0.02)


def test_with_noise_and_after_a_reset_it_moves_alike():
    clock = VirtualClock()
    robot = SimulatedRobot(clock=clock, body=LINKAGE, world=load_world("empty"), noise=True)
    rig = Rig(robot, clock)
    rig.move(drive=0.5)
    robot.stage.reset()
    assert rig.run()["drive"] == pytest.approx(0.0, abs=0.05)
    angles = rig.move(drive=0.5)
    assert angles["swing"] == pytest.approx(angles["drive"], abs=0.01)
    robot.close()


def settled(body, seconds=2.0):
    """Return a robot of a body in an empty world some seconds after its start."""
    clock = VirtualClock()
    robot = SimulatedRobot(clock=clock, body=body, world=load_world("empty"))
    clock.advance(seconds)
    return robot


def hanging(gear, *, loops=()):
    """Return a mounted body with a rod that hangs ahead on a passive joint, and a driven one below it."""
    inertia = LINKAGE.links[0].inertia
    facts: dict[str, Any] = {"axis": (0.0, 1.0, 0.0), "lower": -2.0, "upper": 2.0, "max_velocity": 1.0}
    return Body(
        name="Hanging",
        links=tuple(
            Link(name=name, mass=0.2, com=(at, 0.0, 0.0), inertia=inertia)
            for name, at in (("base", 0.0), ("rod", 0.1), ("foot", 0.0))
        ),
        joints=(
            Joint(name="hinge", parent="base", child="rod", origin=(0.0, 0.0, 1.0), max_torque=0.0, gear="g", **facts),
            Joint(name="foot", parent="base", child="foot", origin=(0.1, 0.0, 0.0), max_torque=9.0, gear="f", **facts),
        ),
        gears={"g": gear, "f": Gear(stiffness=200.0, damping=5.0, inertia=0.01)},
        loops=loops,
        shapes=(Shape(link="base", kind="box", size=(0.1, 0.1, 0.1)),),
        mounted=True,
    )  # fmt: skip


def test_the_spring_of_a_passive_joint_pulls_it_to_its_rest():
    stiff = Gear(stiffness=20.0, friction_damping=0.5, rest=-0.5)
    angle = settled(hanging(stiff)).read().positions[0]
    assert angle == pytest.approx(-0.5 + 0.2 * 9.81 * 0.1 * np.cos(angle) / 20.0, abs=0.002)


def test_a_passive_joint_without_a_spring_falls():
    assert settled(hanging(Gear(stiffness=0.0, friction_damping=0.1))).read().positions[0] > 1.4


def test_a_weld_holds_the_rotation_too():
    quarter = (0.5**0.5, 0.0, 0.5**0.5, 0.0)
    weld = Loop(first="rod", second="base", place=(0.0, 0.0, 0.0), other=(0.0, 0.0, 1.0), turn=quarter)
    held = settled(hanging(Gear(stiffness=0.0, friction_damping=0.5), loops=(weld,)))
    assert held.read().positions[0] == pytest.approx(-np.pi / 2, abs=0.02)


def test_a_hull_touches_with_its_own_form():
    wedge = [(x, y, z) for x in (-0.1, 0.1) for y in (-0.1, 0.1) for z in (0.0, 0.1)]
    keel = tuple((x, y if z else 0.08, z) for x, y, z in wedge)  # an edge below, left of the middle
    body = replace(
        LINKAGE,
        joints=(),
        loops=(),
        couplings=(),
        links=LINKAGE.links[:1],
        shapes=(Shape(link="base", kind="hull", points=keel),),
        mounted=False,
    )
    robot = settled(body)
    _, x, *_ = robot.stage.truth().torso.orientation
    assert abs(x) > 0.2, "it falls off its edge, as the box around it would not"
