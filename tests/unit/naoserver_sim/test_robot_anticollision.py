"""The anti-collision tables hold in the simulation, during motions and at their end."""

from __future__ import annotations

import math
from contextlib import closing

import pytest

from naoserver.bodies.nao import H25
from naoserver.options import ServerOptions
from naoserver.serving.assembly import Assembly
from naoserver_sim.robot import SimulatedRobot
from naoserver_sim.world import load_world
from zenoh_ice import VirtualClock

pytestmark = pytest.mark.sim

SPEED = 1.5
PERIOD = 0.02
OFF = 0.03
"""Radians by which a joint may lag behind its command."""


@pytest.mark.parametrize("table", H25.tables, ids=lambda table: table.dependent)
@pytest.mark.parametrize("side", ["lowest", "highest"])
def test_a_joint_stays_within_its_table_while_the_other_sweeps(table, side):
    clock = VirtualClock()
    joints = {joint.name: joint for joint in H25.joints}
    independent, dependent = joints[table.independent], joints[table.dependent]
    widest = max(independent.upper - independent.lower, dependent.upper - dependent.lower)
    seconds = widest / SPEED + 0.2  # until both are there
    places = [H25.joint_names.index(name) for name in (table.independent, table.dependent)]
    with closing(SimulatedRobot(clock=clock, skin=False, world=load_world("empty"))) as robot:
        body = Assembly(robot, ServerOptions(), clock).body
        for end in (independent.lower, independent.upper):
            targets = {
                table.independent: end,
                table.dependent: dependent.lower if side == "lowest" else dependent.upper,
            }
            body.move(targets, dict.fromkeys(targets, SPEED))
            for _ in range(math.ceil(seconds / PERIOD)):
                clock.advance(PERIOD)
                body.watch()  # as the server's watchdog does
                angle, other = (robot.read().positions[place] for place in places)
                lower, upper = table.at(angle)
                assert lower - OFF < other < upper + OFF
