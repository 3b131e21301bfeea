"""The servant that lets parts of a robot fail."""

import math
from contextlib import closing
from typing import Any

import pytest

from interfaces.jderobot import CommandRefusedException, InvalidValueException
from naoserver.fake import FakeRobot
from naoserver.options import ServerOptions
from naoserver.serving.assembly import Assembly
from naoserver_sim.robot import SimulatedRobot
from tests.support.teams import current
from zenoh_ice import VirtualClock


@pytest.fixture
def clock():
    return VirtualClock()


@pytest.fixture
def assembly(clock):
    return Assembly(FakeRobot(clock), ServerOptions(), clock)


@pytest.fixture
def faults(assembly):
    return assembly.servants["Faults"]


def test_what_is_injected_is_listed_until_it_is_healed(faults, clock):
    clock.advance(2.0)
    fault = faults.inject("HeadYaw", "offset", 0.2, 3.0, current())
    assert (fault.part, fault.kind, fault.amount, fault.end) == ("HeadYaw", "offset", 0.2, 5.0)
    lasting = faults.inject("Camera", "black", None, None, current())
    assert lasting.end == math.inf
    assert faults.getFaults(current()).faults == [fault, lasting]
    faults.heal("Camera", current())
    assert faults.getFaults(current()).faults == [fault]
    faults.heal(None, current())
    assert faults.getFaults(current()).faults == []


def test_each_kind_says_what_it_does_and_how_much(faults):
    kinds = faults.getKinds(current())
    (late,) = (kind for kind in kinds["Camera"] if kind.name == "late")
    assert late.unit == "s"
    assert late.least <= late.usual <= late.greatest
    assert all(kind.text for each in kinds.values() for kind in each)


@pytest.mark.parametrize(
    ("arguments", "field"),
    [
        (("Knee", "stuck", None, None), "part"),
        (("HeadYaw", "bent", None, None), "kind"),
        (("HeadYaw", "offset", 9.0, None), "amount"),
        (("HeadYaw", "offset", math.nan, None), "amount"),
        (("HeadYaw", "stuck", None, math.inf), "seconds"),
    ],
)
def test_what_cannot_fail_so_is_refused_with_its_field(faults, arguments, field):
    with pytest.raises(InvalidValueException) as refusal:
        faults.inject(*arguments, current())
    assert refusal.value.field == field


def test_a_stopped_robot_is_not_made_to_fail(faults, assembly):
    assembly.gate.stop("a hand in the way")
    with pytest.raises(CommandRefusedException, match="a hand in the way"):
        faults.inject("HeadYaw", "limp", None, None, current())
    faults.heal(None, current())


def test_who_does_not_hold_the_robot_does_not_let_it_fail(faults, assembly):
    assembly.gate.acquire("somebody", "Somebody", 10.0)
    with pytest.raises(CommandRefusedException, match="the robot is held by Somebody"):
        faults.inject("HeadYaw", "limp", None, None, current())


def test_its_health_says_what_was_made_to_fail(faults, assembly):
    faults.inject("HeadYaw", "stuck", None, None, current())
    events, _, _ = assembly.events.snapshot()
    assert [(event.source, event.message) for event in events] == [("HeadYaw", "made to fail: stuck")]


@pytest.mark.sim
def test_a_reset_of_the_scene_heals_the_robot(clock):
    with closing(SimulatedRobot(clock=clock, skin=False)) as robot:
        scene: Any = Assembly(robot, ServerOptions(), clock).servants["Scene"]
        robot.faults.inject("HeadYaw", "stuck")
        scene.reset(current())
        assert not robot.faults.current()
