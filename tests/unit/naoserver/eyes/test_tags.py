"""Tags in pictures."""

import pytest

from naoserver_sim.world import Sign, World


def of(reading, kind):
    return [thing for thing in reading.things if (thing.kind, thing.camera) == (kind, "Camera")]


@pytest.mark.sim
@pytest.mark.gl
def test_a_tag_is_seen_by_its_number(drawn):
    world = World(signs=(Sign(position=(0.0, 0.2), landmark=7),))
    robot, reading = drawn(world=world)
    (seen,), (there,) = of(reading, "tag"), of(robot.eyes.look(), "tag")
    assert (seen.name, there.name) == ("7", "7")
    assert (seen.pan, seen.tilt) == pytest.approx((there.pan, there.tilt), abs=0.01)
    assert seen.distance == pytest.approx(there.distance, rel=0.06)
