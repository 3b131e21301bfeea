"""Behaviors of several documents in virtual time, each with a robot in one world."""

import pytest

from hfsm_runtime.virtual.errors import BehaviorFailed, UnknownName
from interfaces.nao import SafetyPrx, TeamPrx
from naoserver_sim.world import RobotPlace, World
from tests.support.places import ROOT
from tests.support.present import present
from visualhfsm.simulation import simulate_team

pytestmark = pytest.mark.sim

DANCE = ROOT / "behaviors" / "dance.xml"
WORLD = World(
    robots=(
        RobotPlace(name="left", position=(0.0, 1.0)),
        RobotPlace(name="right", position=(0.0, -1.0), body="T1"),
    )
)


def test_each_behavior_drives_its_robot():
    with simulate_team([DANCE, DANCE], world=WORLD, camera="drawn") as team:
        assert [robot.name for robot in team.arena.robots] == ["left", "right"]
        assert [behavior.robot.device.body.name for behavior in team.behaviors] == ["H25", "T1"]
        before = [behavior.robot.joints for behavior in team.behaviors]
        team.advance(5.0)
        assert team.time == pytest.approx(5.0)
        for behavior, joints in zip(team.behaviors, before, strict=True):
            assert behavior.time == pytest.approx(5.0)
            assert behavior.robot.joints != joints
        assert team["right"] is team.behaviors[1]
        with pytest.raises(UnknownName, match="no behavior drives a robot 'middle'; there are left, right"):
            team["middle"]


def test_a_stop_of_one_stops_one():
    with simulate_team([DANCE, DANCE], world="match", camera="drawn", on_error="continue") as team:
        team.advance(1.0)
        red, blue = team.behaviors
        SafetyPrx.uncheckedCast(red.world.communicator.stringToProxy("Safety")).emergencyStop("test")
        team.advance(1.0)
        held = red.robot.joints
        moving = blue.robot.joints
        team.advance(2.0)
        assert red.robot.joints == pytest.approx(held, abs=0.01)
        assert blue.robot.joints != pytest.approx(moving, abs=0.1)


def test_robots_hear_those_that_play_for_their_team():
    with simulate_team([DANCE] * 3, world="match", camera="drawn") as team:
        team.advance(0.5)
        heard = {}
        for robot, behavior in zip(team.arena.robots, team.behaviors, strict=False):
            its = TeamPrx.uncheckedCast(behavior.world.communicator.stringToProxy("Team"))
            heard[robot.name] = [mate.name for mate in its.getTeamState().mates]
    assert heard == {"red1": ["red2"], "red2": ["red1"], "blue1": []}


def test_the_same_seed_gives_the_same_states_bit_by_bit():
    def states(seed):
        with simulate_team([DANCE] * 3, camera="drawn", seed=seed, noise=True) as team:
            team.advance(3.0)
            robots = [behavior.robot.device for behavior in team.behaviors]
            return [repr((robot.read(), present(robot.senses).read())) for robot in robots]

    first = states(1)
    assert states(1) == first
    assert states(2) != first


def test_a_team_runs_until_something_happens():
    with simulate_team([DANCE], world=WORLD, camera="drawn") as team:
        assert team.run_until(lambda: team.time >= 0.5) == pytest.approx(0.5)
        with pytest.raises(BehaviorFailed, match="it did not happen within"):
            team.run_until(lambda: False, 0.1)


def test_more_documents_than_robots_are_refused():
    with pytest.raises(ValueError, match="3 documents for 2 robots"):
        simulate_team([DANCE] * 3, world=WORLD)
