"""A trial: a component without a robot, in its own time."""

from __future__ import annotations

import math
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from hfsm_runtime import Automaton, Component, Proxy, Ros, State
from hfsm_runtime.errors import ValueTypeError
from interfaces.nao import HeadPose, PoseHeadPrx, SpeechPrx
from tests.support.automata import after, automaton, component
from tests.support.gripper import GripperPrx
from tests.support.limits import START_LIMIT
from tests.support.running import eventually, running
from visualhfsm.testing.trial import Trial, trial
from zenoh_ice import RobotClock
from zenoh_ros2 import CallTimeoutError


class Nothing(Component):
    """A component that only has proxies: of the robot, of something else, and of what the robot has not."""

    Head = Proxy("Head", PoseHeadPrx)
    Hand = Proxy("Hand", GripperPrx)
    OtherHead = Proxy("OtherHead", PoseHeadPrx)
    Leds = Proxy("Leds", SpeechPrx)

    def automaton(self) -> Automaton:
        return automaton(1, "nothing", [State(id=1, name="idle")])


def two_states(seconds: float) -> Automaton:
    """Return an automaton that leaves its first state after a time."""
    return automaton(1, "root", [State(id=1, name="a"), State(id=2, name="b")], [after(seconds, 1, 2)])


@contextmanager
def tried(root: Automaton) -> Iterator[Trial]:
    """Try automata for the time of a `with` block."""
    with trial() as world:
        runtime = world.runtime(component(root), world.communicator.clock)
        assert runtime.joints()["HeadYaw"] == 0.0
        assert isinstance(runtime, Trial)
        runtime.start()
        try:
            yield runtime
        finally:
            runtime.stop()


def test_the_fake_robot_moves_as_its_servants_are_called() -> None:
    tested = Nothing()
    with trial() as world:
        world.connect(tested)
        tested.Head.setPose(0.5, 0.1, 1.0)
        eventually(lambda: math.isclose(tested.Head.getPose().pan, 0.5, abs_tol=1e-3))


@pytest.mark.slow
def test_a_command_expires_by_the_time_of_the_trial() -> None:
    tested = Nothing()
    with trial() as world:
        world.connect(tested)
        clock = world.communicator.clock
        assert isinstance(clock, RobotClock)
        clock.update(clock.now(), 0.2, simulated=True)
        tested.Head.setSpeed(1.0, 0.0)
        eventually(lambda: tested.Head.getPose().pan > 0.25)  # by wall time it would stop before


@pytest.mark.slow
def test_a_trial_needs_no_pytest() -> None:
    code = "import sys, visualhfsm.testing.trial; sys.exit(bool({'pytest', 'hypothesis'} & set(sys.modules)))"
    subprocess.run([sys.executable, "-c", code], check=True, timeout=START_LIMIT)


def test_what_the_robot_does_not_serve_answers_with_blank_values() -> None:
    tested = Nothing()
    with trial() as world:
        world.connect(tested)
        hand = tested.Hand
        assert [hand.close(2.0), hand.text(3), hand.positions(), hand.stop()] == [0.0, "", [0.0], None]
        assert tested.OtherHead.getPose() == HeadPose()


def test_a_servant_of_the_robot_with_another_interface_is_replaced() -> None:
    tested = Nothing()
    with trial() as world:
        world.connect(tested)
        tested.Leds.say("hello")


def test_the_streams_of_a_stand_in_yield_samples() -> None:
    tested = Nothing()
    with trial() as world:
        world.connect(tested)
        eventually(
            lambda: (sample := tested.OtherHead.getPose.latest()) is not None and sample.value == HeadPose()
        )


class UsesRos(Component, document="uses.xml"):
    scan = Ros("subscribe", "/scan", "sensor_msgs/msg/LaserScan")
    drive = Ros("publish", "/cmd_vel", "geometry_msgs/msg/Twist", stop=True)
    switch = Ros("service", "/switch", "std_srvs/srv/SetBool")
    count = Ros("action", "/count", "example_interfaces/action/Fibonacci")


def test_of_ros_everything_is_a_stand_in() -> None:
    with trial() as world:
        component = UsesRos()
        world.connect(component)
        assert component.scan.latest() is None
        component.drive.publish(linear={"x": 1.0})
        assert component.switch.call(data=True).success is False
        goal = component.count.send(order=3)
        assert goal.done
        with pytest.raises(CallTimeoutError):
            component.scan.next(0.05)


@pytest.mark.slow
def test_time_passes_as_fast_as_it_is_set() -> None:
    with tried(two_states(1000.0)) as runtime:
        assert runtime.speed == 1.0
        runtime.set_speed(100.0)
        began = time.monotonic()
        eventually(lambda: runtime.timeline.now() > 50e9)
        assert time.monotonic() - began < 50.0
        assert runtime.tree.root.current.name == "a"


def test_in_a_pause_all_time_stands_still_and_a_step_moves_it_by_a_period() -> None:
    with tried(two_states(1000.0)) as runtime:
        runtime.pause()
        now, robot = runtime.timeline.now(), runtime.clock.now()
        runtime.set_speed(100.0)
        time.sleep(0.02)
        assert (runtime.timeline.now(), runtime.clock.now()) == (now, robot)
        runtime.step(0)
        assert runtime.timeline.now() == now + 100_000_000
        assert runtime.clock.now() == pytest.approx(robot + 0.1)
        runtime.resume()
        assert runtime.clock.rate == 100.0


@pytest.mark.parametrize("speed", [0.0, -1.0, 101.0, math.inf, math.nan])
def test_what_is_no_speed_is_refused(speed: float) -> None:
    with tried(two_states(1.0)) as runtime:
        with pytest.raises(ValueTypeError, match="at most 100"):
            runtime.set_speed(speed)
        assert runtime.clock.rate == runtime.speed == 1.0


def test_the_time_of_a_run_with_a_robot_is_not_changed() -> None:
    with running(two_states(1.0)) as runtime, pytest.raises(ValueTypeError, match="is no trial"):
        runtime.set_speed(2.0)
