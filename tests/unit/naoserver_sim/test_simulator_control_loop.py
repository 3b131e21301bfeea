"""Motions belong to the control ticks of the simulation: no thread that is late changes what the robot does."""

import hashlib
import threading
import time
from contextlib import closing

import pytest

from interfaces.nao import ActionStatus
from naoserver.bodies import find_body
from naoserver.moves.routes import MotionRoute
from naoserver.moves.walk import way_to
from naoserver.options import ServerOptions
from naoserver.protocol.jobs import JobThreads, Periodic
from naoserver.serving.assembly import Assembly
from naoserver_sim.robot import SimulatedRobot
from tests.support.limits import RUN_LIMIT
from tests.support.motion_rig import MOTIONS
from tests.support.soak import cases
from zenoh_ice import VirtualClock, WallClock

pytestmark = pytest.mark.sim

SECONDS = 5.0


class Recorder:
    """Commands a robot at a tick, and records its states until it has moved for some seconds."""

    def __init__(self, robot, begin):
        self.robot = robot
        self.begin = begin
        self.ended = threading.Event()
        self.digest = hashlib.sha256()
        robot.control_loop.add(Periodic("recorder", robot.clock, lambda: 0.01, self.record))

    def record(self):
        reading = self.robot.read()
        if reading.time == pytest.approx(0.5):
            self.begin()
        if reading.time <= SECONDS:
            self.digest.update(repr(reading).encode())  # of a float, all its digits
        else:
            self.ended.set()


def wave(robot, assembly):
    assembly.player.begin(
        "motion", "wave", MotionRoute(assembly.player.body, MOTIONS["wave"], MOTIONS.values())
    )


def walk(robot, assembly):
    assembly.walk_to.begin(way_to((0.1, 0.05, 0.3), robot.walker.odometry(), robot.walker.limits), "a client")


def virtual(what, body):
    """Return the digest of the states in virtual time."""
    clock = VirtualClock()
    with closing(SimulatedRobot(clock=clock, skin=False, noise=True, seed=1, body=body)) as robot:
        assembly = Assembly(robot, ServerOptions(), clock)
        recorder = Recorder(robot, lambda: what(robot, assembly))
        clock.advance(SECONDS + 0.1)
        assert recorder.ended.is_set()
        return recorder.digest.hexdigest()


def live(what, body, *jobs):
    """Return the digest of the states of a robot with threads; `jobs` make jobs for them."""
    with closing(SimulatedRobot(speed=10.0, skin=False, noise=True, seed=1, body=body)) as robot:
        assembly = Assembly(robot, ServerOptions(), WallClock())
        recorder = Recorder(robot, lambda: what(robot, assembly))
        with JobThreads([*assembly.jobs, *(make(robot.clock) for make in jobs)]):
            robot.start()
            assert recorder.ended.wait(RUN_LIMIT)
        assembly.close()
        return recorder.digest.hexdigest()


def late(clock):
    """Return a job that keeps the thread of the robot's time busy."""
    return Periodic("late", clock, lambda: 0.02, lambda: time.sleep(0.05), thread="state")


@pytest.mark.parametrize(
    ("what", "name"),
    cases([(wave, "H25"), (walk, "H25"), (walk, "T1"), (walk, "Cart")], [pytest.param(walk, "G1")]),
)
def test_late_threads_change_nothing_and_live_is_as_in_virtual_time(what, name):
    body = find_body(name)
    assert live(what, body, late) == virtual(what, body)


def test_a_job_that_fails_does_not_end_the_physics(caplog):
    def fail():
        raise RuntimeError("a slip")

    with closing(SimulatedRobot(speed=10.0, skin=False)) as robot:
        robot.control_loop.add(Periodic("broken", robot.clock, lambda: 0.02, fail))
        robot.start()
        robot.clock.sleep(2.5)
        robot.check()
        assert robot.clock.now() > 2.0
    assert caplog.text.count("broken is tried again") >= 2


def test_a_closed_server_leaves_the_control_loop():
    """So its next one, on the same robot, is the only one that moves it."""
    clock = VirtualClock()
    with closing(SimulatedRobot(clock=clock, skin=False)) as robot:
        before, after = (Assembly(robot, ServerOptions(), clock) for _ in range(2))
        before.close()
        wave(robot, after)
        clock.advance(1.5)
        assert after.player.progress("motion").status is ActionStatus.Moving
