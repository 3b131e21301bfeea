"""Lights that fade over the robot's time."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from naoserver.expression import SINGLE_COLORED, START, FadingLights
from zenoh_ice import VirtualClock

RED, BLACK = (1.0, 0.0, 0.0), (0.0, 0.0, 0.0)
part = st.floats(0.0, 1.0)


@pytest.fixture
def clock():
    return VirtualClock()


@pytest.fixture
def lights(clock):
    return FadingLights(clock.now)


def test_it_starts_with_the_lights_of_the_start_and_returns_to_them(lights):
    assert lights.colors() == START
    for name in lights.names:
        lights.set(name, (0.2, 0.4, 0.3), 0.0)
    lights.reset()
    assert lights.colors() == START


def test_a_group_takes_a_color_at_once_and_the_others_keep_theirs(lights):
    lights.set("Chest", RED, 0.0)
    assert lights.colors() == dict(START) | {"Chest": RED}


def test_a_fade_goes_evenly_and_stays_at_its_end(lights, clock):
    lights.set("Chest", RED, 2.0)
    seen = []
    for _ in range(5):
        seen.append(lights.colors()["Chest"][0])
        clock.advance(0.5)
    assert seen == pytest.approx([0.0, 0.25, 0.5, 0.75, 1.0])
    clock.advance(10.0)
    assert lights.colors()["Chest"] == RED


def test_a_new_fade_begins_where_the_one_before_was(lights, clock):
    lights.set("Chest", RED, 2.0)
    clock.advance(1.0)
    lights.set("Chest", BLACK, 1.0)
    clock.advance(0.5)
    assert lights.colors()["Chest"] == pytest.approx((0.25, 0.0, 0.0))


@given(st.sampled_from(sorted(SINGLE_COLORED)), part, part, part)
def test_of_a_group_with_one_color_only_the_brightest_part_counts(name, red, green, blue):
    lights = FadingLights(lambda: 0.0)
    lights.set(name, (red, green, blue), 0.0)
    assert lights.colors()[name] == (0.0, 0.0, max(red, green, blue))


@given(part, part, st.floats(0.0, 60.0), st.floats(0.0, 100.0))
def test_no_color_leaves_the_way_from_one_to_the_other(before, after, seconds, later):
    now = 0.0
    lights = FadingLights(lambda: now)
    lights.set("Chest", (before, 0.0, 0.0), 0.0)
    lights.set("Chest", (after, 0.0, 0.0), seconds)
    now = later
    assert min(before, after) - 1e-9 <= lights.colors()["Chest"][0] <= max(before, after) + 1e-9
