"""What Health tells of a simulated robot that nothing holds, and of a joint that something holds."""

import pytest
from msgspec.structs import replace

from interfaces.nao import Severity
from naoserver.bodies.parts import Shape
from naoserver.safety._event_log import ConditionWatch, EventLog, JointWatch
from naoserver_sim.robot import SimulatedRobot
from naoserver_sim.world import load_world
from tests.support.linkage import LINKAGE
from zenoh_ice import VirtualClock

pytestmark = pytest.mark.sim


class Rig:
    """A simulated robot, whose condition and joints are watched once a second."""

    def __init__(self, body):
        self.clock = VirtualClock()
        self.robot = SimulatedRobot(clock=self.clock, body=body, world=load_world("empty"))
        self.events = EventLog(self.clock.now, self.clock.now)
        self.watch = ConditionWatch(self.robot, self.events)
        self.joints = JointWatch(self.robot, self.events)
        self.told = 0

    def run(self, seconds):
        """Let time pass; return the new events."""
        for _ in range(seconds):
            self.clock.advance(1.0)
            self.watch.poll(self.robot.state())
            self.joints.poll(self.robot.read())
        events = self.events.snapshot()[0][self.told :]
        self.told += len(events)
        return [(event.level, event.source, event.message.split(":")[0]) for event in events]


LOOSE = replace(LINKAGE, mounted=False)


def test_a_robot_that_falls_through_the_floor_is_told_once():
    assert Rig(replace(LOOSE, shapes=())).run(4) == [(Severity.Error, "Linkage", "under the floor")]


def test_a_robot_that_is_flung_away_is_told():
    rig = Rig(LOOSE)
    rig.robot.stage.push((0.0, 0.0, 300.0), 0.3)
    assert (Severity.Error, "Linkage", "flung away") in rig.run(1)


def test_a_robot_that_stands_has_nothing_to_tell():
    assert Rig(LOOSE).run(8) == []


def test_a_robot_without_any_motor_is_not_called_limp():
    passive = tuple(replace(joint, max_torque=0.0) for joint in LINKAGE.joints)
    assert Rig(replace(LINKAGE, joints=passive)).run(2) == []


def test_a_mounted_robot_may_be_anywhere():
    below = replace(
        LINKAGE, shapes=(Shape(link="base", kind="box", size=(0.1, 0.1, 0.1), position=(0, 0, 2)),)
    )
    assert Rig(below).run(2) == []


def test_a_joint_that_is_held_at_its_limit_is_told_until_it_moves():
    weak = tuple(
        replace(joint, max_torque=0.001) if joint.name == "grip" else joint for joint in LINKAGE.joints
    )
    rig = Rig(replace(LINKAGE, joints=weak, couplings=()))
    rig.robot.place({"grip": 0.6})
    rig.robot.command_positions({"grip": 0.0}, {"grip": 2.0})
    assert rig.run(10) == [(Severity.Warning, "grip", "does not follow")]
    assert rig.events.snapshot()[0][-1].message.endswith(", at its limit 0.6")
    rig.robot.place({"grip": 0.0})
    assert rig.run(1) == [(Severity.Info, "grip", "follows again")]
