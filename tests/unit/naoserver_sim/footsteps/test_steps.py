"""The plan of the footsteps, for a pendulum that obeys it."""

import cmath
import random

import pytest

from naoserver.bodies.capabilities import STILL, WalkVelocity
from naoserver.bodies.footsteps import Footsteps
from naoserver_sim._footsteps.steps import Phase, Steps

TICK = 0.01
MOST_STEPS = 20
"""Steps within which every walk ends."""
FOOTSTEPS = Footsteps(
    com_height=0.6,
    width=0.22,
    sole_middle=(0.0, 0.0, 0.0),
    sole_half=(0.1, 0.045),
    lift=0.05,
    limits=WalkVelocity(0.5, 0.15, 0.6),
)


class Rig:
    """Steps whose feet land where they are planned, and a capture point that moves as the pendulum says."""

    def __init__(self):
        self.steps = Steps(
            FOOTSTEPS, lambda foot: (self.steps.feet[foot].place, self.steps.feet[foot].heading)
        )
        self.point = 0j
        self.highest = 0.0
        self.landed = []

    def go(self, seconds, velocity=STILL):
        for _ in range(round(seconds / TICK)):
            count = self.steps.count
            self.steps.tick(TICK, self.point, velocity)
            zmp, growth = self.steps.zmp, cmath.exp(FOOTSTEPS.frequency * TICK).real
            self.point = zmp + growth * (self.point - zmp)
            self.highest = max(self.highest, *(foot.height for foot in self.steps.feet))
            if self.steps.count > count:
                self.landed.append(self.steps.middle)


@pytest.fixture
def rig():
    return Rig()


def test_it_stands_until_it_is_to_walk(rig):
    rig.go(2.0)
    assert rig.steps.phase is Phase.STANDING
    assert rig.steps.shares == (0.5, 0.5)
    assert rig.steps.count == 0


@pytest.mark.parametrize(
    "velocity", [WalkVelocity(forward=0.3), WalkVelocity(forward=-0.2), WalkVelocity(left=-0.1)]
)
def test_it_walks_as_fast_as_commanded(rig, velocity):
    rig.go(4.0, velocity)
    begin, steps = rig.landed[-1], rig.steps.count
    rig.go(4.5, velocity)
    way = rig.landed[-1] - begin
    seconds = FOOTSTEPS.step_time * (rig.steps.count - steps)
    assert way / seconds == pytest.approx(complex(velocity.forward, velocity.left), abs=0.03)
    assert rig.highest == pytest.approx(FOOTSTEPS.lift, rel=0.05)


def test_it_turns_beyond_half_a_turn(rig):
    rig.go(12.0, WalkVelocity(turn=0.5))
    assert rig.steps.heading == pytest.approx(0.5 * 12.0, rel=0.15)


@pytest.mark.parametrize("aside", [0.0, 0.01, -0.01])
def test_it_ends_with_both_feet_side_by_side_also_when_it_sways(rig, aside):
    rig.go(3.0, WalkVelocity(0.3, 0.02, 0.1))
    rig.go(1.2)
    rig.point += aside * cmath.rect(1.0, rig.steps.heading + 1.57)
    rig.go(2.8)
    left, right = rig.steps.feet
    assert rig.steps.phase is Phase.STANDING
    between = (left.place - right.place) * cmath.rect(1.0, -rig.steps.heading)
    assert between == pytest.approx(1j * FOOTSTEPS.width, abs=0.002)
    assert left.height == right.height == 0.0


class Disturbed:
    """Steps that believe each capture point, and each place of a foot, to be off by up to `distance` in m."""

    def __init__(self, distance, seed):
        self.random = random.Random(seed)
        self.distance = distance
        self.steps = Steps(FOOTSTEPS, self.locate)

    def error(self):
        return self.distance * complex(self.random.uniform(-1.0, 1.0), self.random.uniform(-1.0, 1.0))

    def locate(self, foot):
        seen = self.steps.feet[foot]
        return seen.place + self.error(), seen.heading + self.error().real

    def tick(self, velocity=STILL):
        self.steps.tick(TICK, self.steps.middle + self.error(), velocity)

    def seconds_until(self, stands):
        """Let time pass until it stands, or no more does, and return how long that took."""
        for tick in range(2000):
            if (self.steps.phase is Phase.STANDING) is stands:
                return tick * TICK
            self.tick()
        pytest.fail("it goes on without end")


@pytest.mark.parametrize("distance", [0.02, 0.1, 0.3, 1.0, 100.0])
@pytest.mark.parametrize("seed", range(5))
def test_every_walk_ends_whatever_is_believed(distance, seed):
    rig = Disturbed(distance, seed)
    for _ in range(300):
        rig.tick(WalkVelocity(0.5, 0.1, -0.6))
    begun = rig.steps.count
    assert rig.seconds_until(True) <= MOST_STEPS * 1.25 * FOOTSTEPS.step_time
    assert rig.steps.count - begun <= MOST_STEPS
    if distance < 0.3:
        return
    # Nothing calms it: it steps again in order not to fall, but others see that the walk has ended.
    assert rig.seconds_until(False) >= 0.49
    before = rig.steps.count
    rig.seconds_until(True)
    assert rig.steps.count - before <= MOST_STEPS


def test_after_a_calm_end_it_catches_itself_at_once(rig):
    rig.go(2.0, WalkVelocity(0.3))
    while rig.steps.phase is not Phase.STANDING:
        rig.go(TICK)
    rig.point += 0.15
    rig.go(3 * TICK)
    assert rig.steps.phase is not Phase.STANDING


def test_a_push_that_the_soles_cannot_answer_makes_it_step(rig):
    rig.go(0.5)
    rig.point += 0.15
    rig.go(0.1)
    assert rig.steps.phase is not Phase.STANDING
    rig.go(5.0)
    assert rig.steps.phase is Phase.STANDING
    assert abs(rig.point - rig.steps.middle) < 0.02
    assert rig.steps.middle.real > 0.1


def test_one_that_is_not_firm_does_not_step(rig):
    rig.steps.tick(TICK, 0.15 + 0j, WalkVelocity(0.3), firm=False)
    assert rig.steps.phase is Phase.STANDING


def test_feet_never_cross(rig):
    rig.go(1.0, WalkVelocity(forward=0.2))
    rig.point += 0.1j if rig.steps.support == 0 else -0.1j
    for _ in range(300):
        rig.go(TICK)
        left, right = rig.steps.feet
        if not rig.steps.on_one_foot or left.height + right.height > 0.0:
            continue
        assert ((left.place - right.place) * cmath.rect(1.0, -right.heading)).imag > 0.1
