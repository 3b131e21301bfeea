"""A walk to a place: where it leads, and what ends it."""

import math

import pytest

from interfaces.nao import ActionStatus
from naoserver.bodies import find_body
from naoserver.bodies.capabilities import STILL, Odometry, WalkVelocity
from naoserver.errors import CommandRefused
from naoserver.fake.robot import LIMITS
from naoserver.moves.walk import PERIOD, WalkTo, way_to
from naoserver.options import ServerOptions
from naoserver.serving.assembly import Assembly
from naoserver_sim.robot import SimulatedRobot
from tests.unit.naoserver.moves.test_walk import Rig
from zenoh_ice import VirtualClock

START = Odometry(0.0, 0.0, 0.0, 0.0)


class WalkRig(Rig):
    """A guarded walk, and walks to places over it."""

    def __init__(self):
        super().__init__()
        self.walk_to = WalkTo(self.walk, self.clock.now, lambda: None)


@pytest.fixture
def rig():
    return WalkRig()


def go(rig, seconds=60.0):
    """Let time pass until the walk has come to its end."""
    for _ in range(round(seconds / PERIOD)):
        if not rig.walk_to.busy:
            return
        rig.clock.advance(PERIOD)
        rig.walk_to.tick()
        rig.walker.ending = False


def begin(rig, x=1.0, y=0.0, heading=0.0, client="anna"):
    rig.walk_to.begin(way_to((x, y, heading), rig.walk.read(), LIMITS), client)


@pytest.mark.parametrize("place", [(1.0, 0.0, 0.0), (-0.3, 0.2, 1.0), (0.0, 0.0, -3.0), (0.5, -0.5, 0.0)])
def test_it_stands_there_with_the_heading_in_the_frame_in_which_it_stood(rig, place):
    begin(rig, 0.4, 0.2, 0.5)
    go(rig)
    here = rig.walk.read()
    begin(rig, *place)
    go(rig)
    x, y, heading = place
    there = rig.walk.read()
    assert rig.walk_to.state().status is ActionStatus.Done
    assert rig.walk_to.state().progress == 1.0
    assert rig.walk.commanded() == STILL
    assert there.x == pytest.approx(
        here.x + x * math.cos(here.heading) - y * math.sin(here.heading), abs=0.03
    )
    assert there.y == pytest.approx(
        here.y + x * math.sin(here.heading) + y * math.cos(here.heading), abs=0.03
    )
    assert math.remainder(there.heading - here.heading - heading, math.tau) == pytest.approx(0.0, abs=0.05)


@pytest.mark.sim
@pytest.mark.parametrize("place", [(0.3, 0.4, 0.0), (-0.5, 0.1, 0.0), (0.0, 0.0, 3.0)])
def test_a_simulated_cart_stands_there_too(place):
    clock = VirtualClock()
    robot = SimulatedRobot(clock=clock, skin=False, body=find_body("Cart"))
    walker, walk_to = robot.walker, Assembly(robot, ServerOptions(), clock).walk_to
    assert walker is not None
    assert walk_to is not None
    walk_to.begin(way_to(place, walker.odometry(), walker.limits), "anna")
    while walk_to.busy:
        clock.advance(PERIOD)
    there = walker.odometry()
    assert walk_to.state().status is ActionStatus.Done
    assert (there.x, there.y) == pytest.approx(place[:2], abs=0.07)
    assert there.heading == pytest.approx(place[2], abs=0.06)
    robot.close()


@pytest.mark.sim
def test_it_has_failed_when_a_joint_does_not_follow():
    clock = VirtualClock()
    robot = SimulatedRobot(clock=clock, skin=False, posture="StandInit")
    walker, walk_to = robot.walker, Assembly(robot, ServerOptions(), clock).walk_to
    assert walker is not None
    assert walk_to is not None
    walk_to.begin(way_to((1.0, 0.0, 0.0), walker.odometry(), walker.limits), "anna")
    clock.advance(1.0)
    robot.faults.inject("LKneePitch", "stuck")
    while walk_to.busy:
        clock.advance(PERIOD)
    assert walk_to.state().status is ActionStatus.Failed
    assert "LKneePitch does not follow" in walk_to.state().message
    robot.close()


def test_it_goes_on_when_the_machine_stalls_and_ends_when_nobody_corrects_it(rig):
    begin(rig)
    rig.clock.advance(PERIOD)
    rig.walk_to.tick()
    rig.wall += 1.9
    rig.walk.watch()
    assert rig.walk.commanded() != STILL
    rig.wall += 0.2
    rig.walk.watch()
    assert rig.walk.commanded() == STILL
    assert "not renewed in time" in rig.reported()[-1]


def test_it_is_never_reported_as_limited(rig):
    begin(rig, 0.7, -0.7, 1.1)
    go(rig)
    assert rig.reported() == []


def test_it_reports_its_progress_and_is_done_once_it_stands(rig):
    begin(rig)
    first = rig.walk_to.state()
    go(rig, 2.0)
    under_way = rig.walk_to.state()
    assert (first.status, first.count, first.progress) == (ActionStatus.Moving, 1, 0.0)
    assert 0.1 < under_way.progress < 0.9
    while not rig.walker.ending:
        rig.clock.advance(PERIOD)
        rig.walk_to.tick()
    rig.walk_to.tick()
    assert rig.walk_to.state().status is ActionStatus.Moving  # on its last step
    go(rig)
    assert rig.walk_to.state().status is ActionStatus.Done


@pytest.mark.parametrize(
    ("end", "says"),
    [
        (lambda rig: rig.walk_to.stop(), "stopped"),
        (lambda rig: rig.walk.stop(), "stopped"),
        (lambda rig: rig.walk.drop_client("anna"), "stopped"),
        (lambda rig: rig.gate.stop("a test"), "stopped"),
        (lambda rig: rig.gate.acquire("berta", "Berta", 10.0), "Berta"),
        (lambda rig: rig.walker.fall(), "stopped"),
    ],
    ids=["its stop", "a stop of the walk", "the client is gone", "emergency stop", "lease", "fall"],
)
def test_it_ends_and_does_not_begin_again(rig, end, says):
    begin(rig)
    go(rig, 1.0)
    end(rig)
    go(rig, 1.0)
    state = rig.walk_to.state()
    assert not rig.walk_to.busy
    assert rig.walker.commanded() == STILL
    assert state.status is ActionStatus.Stopped
    assert says in state.message


def test_at_its_end_nothing_is_left_to_say(rig):
    begin(rig)
    go(rig)
    assert (rig.walk_to.state().message, rig.walk_to.state().progress) == ("", 1.0)
    begin(rig)
    go(rig, 2.0)
    rig.walk_to.stop()
    go(rig, 1.0)
    assert 0.1 < rig.walk_to.state().progress < 0.9


def test_it_says_that_another_command_took_its_place(rig):
    begin(rig)
    go(rig, 1.0)
    rig.walk.drive({"turn": 0.5}, "berta")
    go(rig, 1.0)
    assert rig.walk_to.state().message == "another command of the walk ended it, of berta"


def test_it_was_stopped_only_if_it_was_on_its_way(rig):
    rig.walk_to.stop()
    assert rig.walk_to.state().message == ""
    begin(rig)
    go(rig, 1.0)
    rig.walk_to.stop()
    assert rig.walk_to.state().message == "stopped"
    assert rig.walk_to.state().time == rig.clock.now()


def test_it_yields_to_another_command(rig):
    begin(rig)
    go(rig, 1.0)
    rig.walk.drive({"forward": 0.0, "turn": 0.5}, "berta")
    go(rig, 1.0)
    assert rig.walk_to.state().status is ActionStatus.Stopped
    assert rig.walker.commanded() == WalkVelocity(turn=0.5)


def test_a_new_place_takes_the_place_of_the_one_before(rig):
    begin(rig)
    go(rig, 1.0)
    begin(rig, -0.2)
    go(rig)
    assert rig.walk_to.state().count == 2
    assert rig.walk.read().x < 0.3


def test_it_gives_up_a_place_that_it_does_not_come_to(rig):
    begin(rig)
    rig.walker.odometry = lambda: START
    rig.walk.read = lambda: START
    go(rig)
    assert rig.walk_to.state().status is ActionStatus.Stopped
    assert "within 20 s" in rig.walk_to.state().message
    assert rig.walker.commanded() == STILL


def test_it_is_moving_until_the_robot_stands_though_it_gave_up(rig):
    begin(rig)
    rig.walk.read = lambda: START
    for _ in range(round(21.0 / PERIOD)):
        rig.clock.advance(PERIOD)
        rig.walk_to.tick()
    assert rig.walker.commanded() == STILL
    assert rig.walk_to.state().status is ActionStatus.Moving  # its joints are not free yet
    rig.walker.ending = False
    rig.walk_to.tick()
    assert rig.walk_to.state().status is ActionStatus.Stopped
    assert "within 20 s" in rig.walk_to.state().message


def test_it_is_refused_while_another_holds_the_robot(rig):
    rig.gate.acquire("berta", "Berta", 10.0)
    with pytest.raises(CommandRefused):
        begin(rig)
    assert not rig.walk_to.busy
    assert rig.walk_to.state().status is ActionStatus.Idle
