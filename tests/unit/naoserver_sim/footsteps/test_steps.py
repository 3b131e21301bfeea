"""The plan of the footsteps, for a pendulum that obeys it."""

import cmath

import pytest

from naoserver.capabilities import WalkVelocity
from naoserver.footsteps import Footsteps
from naoserver_sim._footsteps.steps import STILL, Phase, Steps

TICK = 0.01
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


def test_it_ends_with_both_feet_side_by_side(rig):
    rig.go(3.0, WalkVelocity(0.3, 0.02, 0.1))
    rig.go(4.0)
    left, right = rig.steps.feet
    assert rig.steps.phase is Phase.STANDING
    between = (left.place - right.place) * cmath.rect(1.0, -rig.steps.heading)
    assert between == pytest.approx(1j * FOOTSTEPS.width, abs=0.03)
    assert left.height == right.height == 0.0


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
