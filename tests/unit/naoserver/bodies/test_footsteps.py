"""The parameters of a walk by footsteps."""

import math
from typing import Any

import msgspec
import pytest

from naoserver.bodies.capabilities import WalkVelocity
from naoserver.bodies.footsteps import Footsteps
from naoserver.errors import RobotError

USUAL: dict[str, Any] = {
    "com_height": 0.56,
    "width": 0.22,
    "sole_middle": (0.01, 0.0, -0.03),
    "sole_half": (0.1, 0.045),
    "lift": 0.05,
    "limits": WalkVelocity(0.5, 0.1, 0.6),
}


def test_they_are_read_from_a_file_of_json():
    written = msgspec.json.encode(Footsteps(**USUAL))
    assert msgspec.json.decode(written, type=Footsteps) == Footsteps(**USUAL)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("com_height", 0.0),
        ("com_height", math.inf),
        ("width", 0.1),
        ("sole_middle", (0.0, math.nan, 0.0)),
        ("sole_half", (0.1, 0.0)),
        ("lift", -0.05),
        ("limits", WalkVelocity(-0.1, 0.0, 0.0)),
        ("backward", 0.0),
        ("step_time", 0.06),
        ("step_time", math.nan),
        ("shortest_step", 0.5),
        ("pull", 1.5),
        ("acceleration_share", 2.0),
        ("walking_gain", -1.0),
    ],
)
def test_figures_with_which_nobody_can_walk_are_refused_by_name(name, value):
    with pytest.raises(RobotError, match=name):
        Footsteps(**(USUAL | {name: value}))


def test_the_highest_velocities_share_a_step():
    possible = Footsteps(**USUAL).possible
    assert possible(WalkVelocity(0.5)) == WalkVelocity(0.5)
    assert possible(WalkVelocity(0.5, 0.1)) == WalkVelocity(0.25, 0.05)
    assert possible(WalkVelocity(0.1, 0.0, -0.1)) == WalkVelocity(0.1, 0.0, -0.1)


def test_backwards_it_is_slower():
    assert Footsteps(**USUAL).possible(WalkVelocity(-0.5)).forward == pytest.approx(-0.25)


def test_a_kind_of_velocity_that_it_lacks_is_left_out():
    cannot = Footsteps(**(USUAL | {"limits": WalkVelocity(0.5, 0.0, 0.6)}))
    assert cannot.possible(WalkVelocity(0.2, 0.3, 0.0)) == WalkVelocity(0.2)
