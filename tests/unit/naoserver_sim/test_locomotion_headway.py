"""Robots that do not get on: walls, slopes and edges end the walk, and everybody is told."""

import math

import pytest

from hfsm_runtime import Automaton, Component, Proxy, State
from interfaces.jderobot import MotorsPrx
from interfaces.nao import ActionStatus, HealthPrx, PosturesPrx, WalkPrx
from naoserver.bodies import find_body
from naoserver.bodies.capabilities import STILL, Odometry, WalkVelocity
from naoserver_sim._locomotion import Headway
from naoserver_sim.robot import SimulatedRobot
from naoserver_sim.world import load_world
from tests.support.present import present
from tests.support.soak import cases
from zenoh_ice import VirtualClock

SPEEDS = {"H25": 0.15, "T1": 0.3, "G1": 0.3}
TICK = 0.1


def verdicts(headway, velocity, share, seconds, start=0.0):
    """Return what it says in each tick of a motion that makes a share of its way from a place on."""
    said = []
    for tick in range(round(seconds / TICK)):
        place = start + velocity.forward * share * TICK * (tick + 1)
        said.append(headway.tick(TICK, velocity, Odometry(0.0, place, 0.0, 0.0)))
    return said


@pytest.mark.parametrize(("share", "gets_on"), [(1.0, True), (0.6, True), (0.2, False), (-0.5, False)])
def test_it_gets_on_that_makes_half_of_its_way(share, gets_on):
    said = verdicts(Headway(), WalkVelocity(forward=0.3), share, 6.0)
    assert said[-1] is gets_on
    assert all(said[:10]), "it may still be starting"


def test_a_turn_on_the_spot_gets_on():
    assert all(verdicts(Headway(), WalkVelocity(turn=0.5), 0.0, 6.0))


def test_a_turn_that_drifts_gets_on_at_a_crawl():
    """The feet step around a point that is none of the body's, and so it goes back by more than it is to go."""
    assert all(verdicts(Headway(), WalkVelocity(forward=0.011, turn=0.5), -3.0, 6.0))


def test_a_robot_that_turns_round_gets_on():
    headway = Headway()
    verdicts(headway, WalkVelocity(forward=0.3), 1.0, 6.0)
    assert all(verdicts(headway, WalkVelocity(forward=-0.3), 1.0, 6.0, start=1.8))


class Walking(Component):
    Motors = Proxy("Motors", MotorsPrx)
    Walk = Proxy("Walk", WalkPrx)
    Health = Proxy("Health", HealthPrx)
    Postures = Proxy("Postures", PosturesPrx)

    def automaton(self) -> Automaton:
        return Automaton(id=1, name="nothing", states=(State(id=1, name="idle", initial=True),))


@pytest.fixture
def wall(tmp_path):
    """A world with a wall half a metre away."""
    path = tmp_path / "wall.toml"
    path.write_text('[[boxes]]\nname = "Wall"\nposition = [0.7, 0.0]\nsize = [0.4, 4.0, 1.2]\n')
    return str(path)


@pytest.fixture(params=cases(["H25", "T1"], ["G1"]))
def before_a_wall(request, behavior, wall):
    """A robot before a wall."""
    body = request.param
    b = behavior(Walking, robot="sim", body=body, world=wall, noise=True, seed=0)
    b.advance(1.0)
    return b, SPEEDS[body]


def drive(b, speed, seconds):
    """Renew a velocity; return whether it was limited at the end."""
    limited = 0
    for _ in range(round(seconds / TICK)):
        limited = b.component.Motors.setV(speed)
        b.advance(TICK)
    return limited == 1


@pytest.mark.sim
def test_a_wall_ends_the_walk_of_a_robot_that_stays_upright_until_its_client_lets_go(before_a_wall):
    b, speed = before_a_wall
    assert drive(b, speed, 10.0)
    health = b.component.Health.getHealth()
    assert not health.fallen
    assert any("the robot ended the walk: it does not get on" in event.message for event in health.events)
    assert b.component.Motors.getV() == 0.0
    b.component.Motors.stop()
    assert not drive(b, -speed / 2, 1.0)


@pytest.mark.sim
def test_a_walk_to_a_place_behind_a_wall_says_that_it_does_not_get_there(before_a_wall):
    b, _ = before_a_wall
    walk = b.component.Walk
    walk.walkTo(2.0, 0.0, 0.0)
    for _ in range(60):
        if walk.getWalkState().status is not ActionStatus.Moving:
            break
        b.advance(0.2)
    state = walk.getWalkState()
    assert state.status is ActionStatus.Stopped
    assert "it does not get on" in state.message
    b.component.Postures.goToPosture("StandInit", 1.0)  # it stands: nothing else moves its legs
    b.component.Postures.stop()
    walk.walkTo(-0.2, 0.0, 0.0)


def put(body, degrees=0.0, world="empty"):
    """Return a robot that stands on a floor, uphill by some degrees: gravity is turned."""
    clock = VirtualClock()
    robot = SimulatedRobot(clock=clock, skin=False, world=load_world(world), body=find_body(body), seed=2)
    slope = math.radians(degrees)
    clock.advance(1.0)
    robot._simulator.mj.opt.gravity[:] = -9.81 * math.sin(slope), 0.0, -9.81 * math.cos(slope)
    return robot, clock


@pytest.mark.sim
@pytest.mark.parametrize(("body", "degrees"), [("G1", 5.0), ("T1", 5.0)])
def test_a_slope_that_is_too_steep_ends_the_walk(body, degrees):
    robot, clock = put(body, degrees)
    walker = present(robot.walker)
    walker.command(WalkVelocity(forward=0.3))
    for _ in range(80):
        if walker.ended:
            break
        clock.advance(TICK)
    assert "it does not get on" in walker.ended
    clock.advance(4.0)
    assert not robot.state().fallen


@pytest.mark.sim
@pytest.mark.parametrize(("velocity", "heading"), [(WalkVelocity(left=0.1), -0.5), (WalkVelocity(-0.2), 1.0)])
def test_a_nao_that_marches_on_the_spot_before_a_wall_sideways_or_backwards_ends_the_walk(
    velocity, heading, wall
):
    robot, clock = put("H25", world=wall)
    robot.stage.place_robot(0.25, 0.0, heading * math.pi)
    walker = present(robot.walker)
    walker.command(velocity)
    clock.advance(7.0)
    assert "it does not get on" in walker.ended
    assert not robot.state().fallen


@pytest.mark.sim
@pytest.mark.parametrize("body", cases(["H25", "G1"], ["T1"]))
def test_a_free_walk_with_turns_and_changes_gets_on(body):
    robot, clock = put(body)
    walker = present(robot.walker)
    half = SPEEDS[body] / 2
    for velocity in (
        WalkVelocity(forward=2 * half),
        WalkVelocity(-half, 0.0, 0.3),
        WalkVelocity(left=-0.08),
    ):
        walker.command(velocity)
        clock.advance(3.0)
        assert walker.ended == ""
    walker.command(STILL)
