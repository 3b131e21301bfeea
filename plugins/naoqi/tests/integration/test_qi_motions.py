"""Key-frame motions of a standing robot, as Choregraphe exports them: the simulated robot stays on its feet."""

from __future__ import annotations

import math
import threading

import pytest

pytest.importorskip("qi")

from naoserver.errors import RobotError
from naoserver_sim.robot import SimulatedRobot
from naoserver_sim.world import load_world
from plugins.naoqi.tests.support.rig import Rig
from tests.support.limits import EVENT_LIMIT
from tests.support.soak import cases
from tests.support.stepped_clock import SteppedClock

pytestmark = pytest.mark.sim

MIRRORED = ("Roll", "Yaw")
"""Joints that turn the other way on the other side."""


def both(joint, *angles):
    """Return the keys of a joint of both sides."""
    sign = -1.0 if joint.endswith(MIRRORED) else 1.0
    return {f"L{joint}": angles, f"R{joint}": tuple(sign * angle for angle in angles)}


def squat(*depths):
    """Return the keys of both legs for bending the knees by angles in rad, the soles flat."""
    return {
        **both("HipPitch", *(-0.45 - depth / 2 for depth in depths)),
        **both("KneePitch", *(0.7 + depth for depth in depths)),
        **both("AnklePitch", *(-0.35 - depth / 2 for depth in depths)),
    }


def sway(*angles):
    """Return the keys of both legs for shifting the weight sideways by angles in rad, the soles flat."""
    return {
        **{f"{side}HipRoll": angles for side in "LR"},
        **{f"{side}AnkleRoll": tuple(-angle for angle in angles) for side in "LR"},
    }


OUT = both("ShoulderRoll", 0.9, 0.1, 0.9, 0.2)
UP = both("ShoulderPitch", -0.6, 1.4, -0.6, 1.4)
# A motion: seconds between two keys, and the angles of each joint at the keys.
MOTIONS = {
    "look left and right": (0.6, {"HeadYaw": (0.8, -0.8, 0.8, 0.0)}),
    "nod": (0.4, {"HeadPitch": (0.3, -0.2, 0.3, 0.0)}),
    "wave": (0.5, {"RShoulderPitch": (-1.0, -1.0, -1.0, 1.4), "RElbowRoll": (1.2, 0.3, 1.2, 0.4)}),
    "wave fast": (0.25, {"RShoulderPitch": (0.0, -1.0, -1.0, -1.0, 0.0, 1.4), "RElbowRoll": (0.9, 0.3, 0.9, 0.3, 0.9, 0.4)}),
    "point ahead": (0.8, {"LShoulderPitch": (0.0, 0.0, 1.4), "LElbowRoll": (-0.1, -0.1, -0.4)}),
    "clap": (0.5, {**both("ShoulderPitch", 0.4, 0.4, 0.4, 1.4), **both("ShoulderRoll", 0.3, -0.1, 0.3, 0.2)}),
    "arms out": (0.8, OUT),
    "arms up": (0.8, UP),
    "wings": (0.5, OUT),
    "arms in turn": (0.6, {"LShoulderPitch": (-0.4, 1.4, -0.4, 1.4), "RShoulderPitch": (1.4, -0.4, 1.4, 1.4)}),
    "arms in turn, fast": (0.35, {"LShoulderPitch": (0.4, 1.4, 0.4, 1.4), "RShoulderPitch": (1.4, 0.4, 1.4, 1.4)}),
    "elbows": (0.4, {**both("ElbowRoll", -1.3, -0.2, -1.3, -0.5), **both("ElbowYaw", -1.2, -0.6, -1.2, -0.8)}),
    "hands": (0.4, {"LHand": (1.0, 0.0, 1.0, 0.3), "RHand": (0.0, 1.0, 0.0, 0.3)}),
    "bow": (0.8, {**both("HipPitch", -0.75, -0.75, -0.45), "HeadPitch": (0.3, 0.3, 0.0)}),
    "squat": (0.7, squat(0.3, 0.0, 0.3, 0.0)),
    "squat fast": (0.35, squat(0.2, 0.0, 0.2, 0.0)),
    "sway": (0.7, sway(0.1, -0.1, 0.1, 0.0)),
    "sway with arms": (0.7, {**sway(0.08, -0.08, 0.08, 0.0), "LShoulderRoll": (0.8, 0.1, 0.8, 0.2)}),
    "dance": (0.5, {**squat(0.15, 0.0, 0.15, 0.0), **UP, "HeadYaw": (0.5, -0.5, 0.5, 0.0)}),
    "disco": (0.5, {**sway(0.06, -0.06, 0.06, 0.0), "RShoulderPitch": (-0.8, 1.2, -0.8, 1.4), "HeadYaw": (0.6, -0.6, 0.6, 0.0)}),
}  # fmt: skip


QUICK = ("wave", "squat fast", "dance")


@pytest.mark.parametrize("name", cases(QUICK, (name for name in MOTIONS if name not in QUICK)))
def test_it_stands_after_a_motion(name):
    step, keys = MOTIONS[name]
    rig = Rig(lambda clock: SimulatedRobot(clock=clock, skin=False, world=load_world("empty")))
    try:
        angles = [list(values) for values in keys.values()]
        times = [[step * (i + 1) for i in range(len(values))] for values in angles]
        took = rig.complete(rig.motion.angleInterpolation, list(keys), angles, times, True)
        rig.advance(1.0)
        assert took == pytest.approx(max(times)[-1], abs=0.6)
        assert rig.robot.state().torso_tilt < math.radians(15)
    finally:
        rig.close()


class LateClock(SteppedClock):
    """A clock whose threads always wake up late: those of calls, whatever they wait for."""

    def wait(self, event, timeout):
        super().wait(threading.Event(), timeout + 0.3)
        return event.is_set()


def test_a_late_thread_of_a_call_changes_nothing_of_its_motion():
    def path(clock):
        rig = Rig(lambda clock: SimulatedRobot(clock=clock, skin=False, world=load_world("empty")), clock)
        try:
            keys = squat(0.3, 0.0, 0.3)
            times = [[0.3, 0.6, 0.9]] * len(keys)
            call = rig.begin(rig.motion.angleInterpolation, list(keys), list(keys.values()), times, True)
            readings = []
            for _ in range(60):
                rig.advance(0.02)
                readings.append(rig.robot.read())
            rig.advance(1.0)
            assert call.ended
            return readings
        finally:
            rig.close()

    assert path(LateClock(limit=EVENT_LIMIT)) == path(SteppedClock(limit=EVENT_LIMIT))


def test_a_motion_that_would_hurt_is_refused():
    rig = Rig(lambda clock: SimulatedRobot(clock=clock, skin=False, world=load_world("empty")))
    try:
        with pytest.raises(RobotError, match="finite"):
            rig.complete(rig.motion.angleInterpolation, ["HeadYaw"], [[math.nan]], [[1.0]], True)
    finally:
        rig.close()
