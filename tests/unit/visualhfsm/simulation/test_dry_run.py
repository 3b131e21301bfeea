"""A dry run: a component without a robot, whose time passes by itself."""

from __future__ import annotations

import math
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest

from hfsm_runtime import Automaton, Component, Proxy, State
from hfsm_runtime.virtual import PacedExecution
from interfaces.nao import HeadPose, PoseHeadPrx, SpeechPrx
from naoserver.bodies import DEFAULT_BODY, find_body
from naoserver.bodies.parts import Axis
from tests.support.automata import automaton
from tests.support.limits import START_LIMIT
from tests.support.waiting import until
from visualhfsm.simulation._dry_run import dry_run
from zenoh_ice import initialize

pytestmark = pytest.mark.slow


class Looks(Component):
    """A component that turns its head, with other proxies: of the robot, and of what the robot has not."""

    Head = Proxy("Head", PoseHeadPrx)
    OtherHead = Proxy("OtherHead", PoseHeadPrx)
    Leds = Proxy("Leds", SpeechPrx)

    def automaton(self) -> Automaton:
        return automaton(1, "looks", [State(id=1, name="look", entry=lambda: self.look())])

    def look(self) -> None:
        self.Head.setPose(0.5, 0.1, 1.0)


class Turns(Looks):
    def look(self) -> None:
        self.Head.setSpeed(1.0, 0.0)


@contextmanager
def tried(component: Any, body: str = DEFAULT_BODY) -> Iterator[PacedExecution]:
    """Try a component for the time of a `with` block."""
    with (
        initialize(connect=[], listen=[], clock="wall") as realm,
        dry_run(realm, body=find_body(body)) as world,
    ):
        world.connect(component)
        run = world.runtime(component, world.communicator.clock)
        assert isinstance(run, PacedExecution)
        try:
            yield run
        finally:
            run.stop()


def test_the_fake_robot_moves_as_its_servants_are_called() -> None:
    with tried(Looks()) as run:
        assert run.joints()["HeadYaw"] == 0.0
        run.start()
        until(lambda: math.isclose(run.joints()["HeadYaw"], 0.5, abs_tol=1e-3))


def test_a_dry_run_has_the_body_that_was_chosen() -> None:
    with tried(Looks(), "T1") as run:
        run.start()
        pan = find_body("T1").hinges["Neck"][Axis.PAN].joint
        until(lambda: math.isclose(run.joints()[pan], 0.5, abs_tol=1e-3))


@pytest.mark.slow
def test_a_command_expires_by_the_time_of_the_dry_run() -> None:
    with tried(Turns()) as run:
        run.set_speed(0.2)
        run.start()
        until(lambda: run.joints()["HeadYaw"] > 0.05)
        run.set_speed(100.0)
        run.clock.sleep(2.0)
        assert run.joints()["HeadYaw"] < 0.7  # it turned for half a second of its time


def test_in_a_pause_the_robot_stands_still() -> None:
    with tried(Turns()) as run:
        run.start()
        until(lambda: run.joints()["HeadYaw"] > 0.01)
        run.pause()
        joints = run.joints()
        run.step(0)
        assert run.joints()["HeadYaw"] == pytest.approx(joints["HeadYaw"] + 0.1, abs=0.05)


def test_what_the_robot_does_not_serve_answers_with_blank_values() -> None:
    component = Looks()
    with tried(component):
        assert component.OtherHead.getPose() == HeadPose()
        component.Leds.say("hello")  # the robot serves another interface under this name


@pytest.mark.slow
def test_a_dry_run_needs_no_pytest() -> None:
    code = (
        "import sys, visualhfsm.simulation._dry_run, visualhfsm.simulation._behavior; "
        "sys.exit(bool({'pytest', 'hypothesis'} & set(sys.modules)))"
    )
    subprocess.run([sys.executable, "-c", code], check=True, timeout=START_LIMIT)
