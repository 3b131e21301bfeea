"""Lines of a field in pictures."""

import math

import pytest


def of(reading, kind):
    return [thing for thing in reading.things if (thing.kind, thing.camera) == (kind, "Camera")]


@pytest.mark.sim
@pytest.mark.gl
def test_places_on_lines_are_on_lines(drawn):
    robot, reading = drawn()
    lines, there = of(reading, "line"), of(robot.eyes.look(), "line")
    assert 5 <= len(lines) <= 30
    for line in lines:
        if line.distance < 2.5:
            assert min(math.hypot(line.x - each.x, line.y - each.y) for each in there) < 0.3
