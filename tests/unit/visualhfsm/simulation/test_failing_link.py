"""A robot under test whose server hangs, or the link to which fails: in virtual time, without threads."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest

from hfsm_runtime import Automaton, Component, Proxy, State
from interfaces.jderobot import EncodersPrx, MotorsPrx
from interfaces.nao import FaultsPrx, HealthPrx, PoseHeadPrx, SafetyPrx
from naoserver.errors import InvalidCommand
from visualhfsm.simulation import Behavior
from visualhfsm.testing import MakeBehavior
from zenoh_ice import Settings, TimeoutException

LIMIT = Settings().timeout
"""s of the calls of a behavior."""
VELOCITY_LIMIT = 0.5
"""s after which a walk ends that is not renewed."""


class Whole(Component):
    Walk = Proxy("Motors", MotorsPrx)
    Odometry = Proxy("Encoders", EncodersPrx)
    Head = Proxy("Head", PoseHeadPrx)
    Safety = Proxy("Safety", SafetyPrx)
    Health = Proxy("Health", HealthPrx)
    Faults = Proxy("Faults", FaultsPrx)

    def automaton(self) -> Automaton:
        return Automaton(id=1, name="nothing", states=(State(id=1, name="idle", initial=True),))


@pytest.fixture(params=["fake", pytest.param("sim", marks=pytest.mark.sim)])
def b(request, behavior: MakeBehavior):
    return behavior(Whole, robot=request.param)


def taken(b: Behavior, call: Callable[[], object]) -> float:
    """Return how many s of virtual time a call took."""
    before = b.clock.now()
    call()
    return b.clock.now() - before


def limit_of(b: Behavior, call: Callable[[], object]) -> float:
    """Return after how many s of virtual time a call gave up."""

    def give_up() -> None:
        with pytest.raises(TimeoutException):
            call()

    return taken(b, give_up)


def walked(b: Behavior) -> float:
    walker = b.robot.device.walker
    assert walker is not None
    return walker.odometry().x


# -- late -----------------------------------------------------------------------------------------------------------


def test_over_a_late_link_a_call_and_its_answer_take_their_time(b) -> None:
    assert taken(b, b.component.Head.getPose) == 0.0
    b.robot.fail("Link", "late", 0.3)
    assert taken(b, b.component.Head.getPose) == pytest.approx(0.6, abs=0.02)
    b.robot.heal()
    assert taken(b, b.component.Head.getPose) == 0.0


def test_over_a_late_link_a_sample_says_how_old_it_is(b) -> None:
    pose = b.component.Head.getPose
    pose.latest()
    b.advance(0.5)
    assert pose.latest().age < 0.05
    b.robot.fail("Link", "late", 0.3)
    b.advance(1.0)
    sample = pose.latest()
    assert 0.3 <= sample.age < 0.35
    assert b.clock.now() - sample.time == pytest.approx(sample.age, abs=0.02)


def test_a_link_that_is_later_than_the_limit_of_a_call_looks_like_a_timeout(b) -> None:
    b.robot.fail("Link", "late", 0.6 * LIMIT)
    assert limit_of(b, b.component.Head.getPose) == pytest.approx(LIMIT, abs=0.02)


# -- lossy ----------------------------------------------------------------------------------------------------------


def outcomes(b) -> list[bool]:
    """Return which of some calls are answered."""
    found = []
    for _ in range(20):
        try:
            b.component.Head.getPose()
        except TimeoutException:
            found.append(False)
        else:
            found.append(True)
    return found


def test_a_lossy_link_loses_its_share_of_calls_and_answers(b) -> None:
    b.robot.fail("Link", "lossy", 0.3)
    answered = outcomes(b).count(True)
    assert 4 <= answered <= 16  # 0.7**2 of 20 is about 10


def test_a_lossy_link_loses_the_same_each_time(behavior: MakeBehavior) -> None:
    found = []
    for _ in range(2):
        b = behavior(Whole, robot="fake")
        b.robot.fail("Link", "lossy", 0.5)
        found.append(outcomes(b))
    assert found[0] == found[1]


def test_a_lossy_link_leaves_gaps_in_streams(b) -> None:
    pose = b.component.Head.getPose
    lost = []
    pose.subscribe(lambda sample: lost.append(sample.lost))
    b.advance(1.0)
    assert sum(lost) == 0
    b.robot.fail("Link", "lossy", 0.5)
    b.advance(2.0)
    assert 25 <= sum(lost) <= 75  # of 100


# -- cut one way ----------------------------------------------------------------------------------------------------


def test_to_a_deaf_robot_no_command_comes(b) -> None:
    b.component.Head.getPose.latest()
    b.robot.fail("Link", "deaf")
    assert limit_of(b, lambda: b.component.Head.setPose(0.5, 0.0, 1.0)) == pytest.approx(LIMIT, abs=0.02)
    b.advance(1.0)
    assert abs(b.robot.head[0]) < 0.01
    assert b.component.Head.getPose.latest().age < 0.05  # it is heard


def test_from_a_mute_robot_comes_nothing_but_it_hears(b) -> None:
    pose = b.component.Head.getPose
    pose.latest()
    b.advance(0.5)
    b.robot.fail("Link", "mute")
    assert limit_of(b, lambda: b.component.Head.setPose(0.5, 0.0, 1.0)) == pytest.approx(LIMIT, abs=0.02)
    b.advance(1.0)
    assert b.robot.head[0] == pytest.approx(0.5, abs=0.05)
    assert pose.latest().age == pytest.approx(LIMIT + 1.0, abs=0.1)
    b.robot.heal()
    b.advance(0.1)
    assert pose.latest().age < 0.05


@pytest.mark.parametrize("fault", [("Link", "deaf"), ("Server", "hung")])
def test_a_robot_stands_once_it_hears_no_commands(b, fault) -> None:
    for _ in range(15):
        b.component.Walk.setV(0.1)
        b.advance(0.2)
    assert walked(b) > 0.1
    b.robot.fail(*fault)
    b.advance(VELOCITY_LIMIT + 1.5)
    stood = walked(b)
    b.advance(2.0)
    assert walked(b) == pytest.approx(stood, abs=0.01)
    b.robot.heal()
    for _ in range(10):
        b.component.Walk.setV(0.1)
        b.advance(0.2)
    assert walked(b) > stood + 0.05


def test_what_fails_can_be_healed_over_a_link_that_is_cut(b) -> None:
    b.robot.fail("Link", "deaf")
    b.robot.fail("Link", "mute")
    b.component.Faults.heal("Link")
    assert taken(b, b.component.Head.getPose) == 0.0


def test_a_link_that_fails_for_a_time_needs_no_healing(b) -> None:
    b.robot.fail("Link", "mute", seconds=1.0)
    b.advance(1.1)
    assert taken(b, b.component.Head.getPose) == 0.0


# -- a server that hangs --------------------------------------------------------------------------------------------


def test_a_server_that_hangs_answers_those_who_still_wait_at_its_end(b) -> None:
    b.robot.fail("Server", "hung", seconds=1.0)
    assert taken(b, b.component.Head.getPose) == pytest.approx(1.0, abs=0.1)


def test_a_server_that_hung_executes_no_command_that_was_given_up(b) -> None:
    b.robot.fail("Server", "hung", seconds=2 * LIMIT)
    assert limit_of(b, lambda: b.component.Head.setPose(0.5, 0.0, 1.0)) == pytest.approx(LIMIT, abs=0.02)
    b.advance(2 * LIMIT)
    assert abs(b.robot.head[0]) < 0.01
    b.component.Head.setPose(0.5, 0.0, 1.0)
    b.advance(1.0)
    assert b.robot.head[0] == pytest.approx(0.5, abs=0.05)


def test_a_server_that_hangs_answers_nobody_for_five_seconds_not_even_who_would_heal_it(b) -> None:
    b.robot.fail("Server", "hung")
    began = b.clock.now()
    for _ in range(2):
        assert limit_of(b, b.component.Faults.heal) == pytest.approx(LIMIT, abs=0.02)
    b.component.Faults.getFaults()
    assert b.clock.now() - began == pytest.approx(5.0, abs=0.1)


def test_a_server_may_not_hang_for_ever(b) -> None:
    with pytest.raises(InvalidCommand, match="at most 600"):
        b.robot.fail("Server", "hung", seconds=math.inf)


def test_a_server_in_the_process_of_a_behavior_cannot_be_restarted(b) -> None:
    with pytest.raises(InvalidCommand, match="its process is not its own"):
        b.robot.fail("Server", "restarted")
