"""What tests of eyes share: worlds that are drawn, and what is seen of them."""

from __future__ import annotations

import msgspec
import pytest

from naoserver.eyes._pictures import PictureEyes
from naoserver.eyes.looks import read_looks
from naoserver_sim.arena import Arena
from naoserver_sim.world import RobotPlace, load_world
from tests.support.local_camera import local_cameras
from zenoh_ice import VirtualClock

SOCCER = load_world("soccer")
HERE = RobotPlace(name="red", position=(-1.5, 0.0), shirt=(0.9, 0.1, 0.1))


@pytest.fixture
def drawn():
    """Return a function that returns the first robot of a world, and what it sees in pictures."""
    made = []

    def see(*places, world=SOCCER):
        clock = VirtualClock()
        arena = Arena(msgspec.structs.replace(world, robots=places or (HERE,)), clock=clock, skin=False)
        made.append(arena)
        arena.start()
        clock.advance(0.5)
        return arena.robots[0], PictureEyes(local_cameras(arena.robots[0]), read_looks()).look()

    yield see
    for arena in made:
        arena.close()
