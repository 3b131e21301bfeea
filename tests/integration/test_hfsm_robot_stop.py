"""A component that ends stops the operations that it has started."""

from __future__ import annotations

import importlib
import logging
from pathlib import Path
from typing import Any

import pytest

from hfsm_runtime import Automaton, Component, Proxy, State
from hfsm_runtime._robot import connect
from hfsm_runtime._stop import stop_robot
from interfaces.jderobot import MotorsPrx, Pose3DEncodersPrx, Pose3DMotorsData, Pose3DMotorsPrx
from interfaces.nao import PoseHeadPrx, SpeechPrx
from naoserver.fake import FakeRobot
from tests.support.gripper import GripperI, GripperPrx
from tests.support.robot_server import eventually, served_to_client
from tests.support.slice_compiler import imported
from zenoh_ice import Current

ARM = """
module arms {
  exception Jammed { string why; };
  interface Arm { void lift(double height); ["stop"] idempotent void halt(optional(1) double seconds); };
  interface Hand { void grip(double force); ["stop"] idempotent void from(); };
  interface Robot extends Arm, Hand { ["stop"] idempotent void freeze() throws Jammed; };
};
"""


class _Idle(Component):
    def automaton(self) -> Automaton:
        return Automaton(id=1, name="nothing", states=(State(id=1, name="idle", initial=True),))


class Busy(_Idle):
    Head = Proxy("Head", PoseHeadPrx)
    Walk = Proxy("Motors", MotorsPrx)
    Voice = Proxy("Speech", SpeechPrx)
    Arm = Proxy("LeftShoulderMotors", Pose3DMotorsPrx)
    Place = Proxy("LeftShoulderEncoders", Pose3DEncodersPrx)


class Gripping(_Idle):
    Gripper = Proxy("Gripper", GripperPrx)


def test_a_component_that_ends_stops_head_walk_voice_and_arm() -> None:
    with served_to_client(FakeRobot()) as nao:
        component = Busy()
        connect(component, nao.communicator)
        start = component.Place.getPose3DEncodersData().tilt
        # So slowly that they are still on their way whenever the machine gets to stopping them.
        component.Head.setPose(1.5, 0.0, 0.01)
        component.Arm.setPose3DMotorsData(Pose3DMotorsData(0, 0, 0, 0, start - 1.0, 0, 0.05, 0.05))
        component.Walk.setV(0.1)
        component.Voice.say("This takes quite some time to be said. " * 20)
        assert component.Voice.getSpeech().speaking
        eventually(lambda: component.Place.getPose3DEncodersData().tilt < start - 0.02)
        stop_robot(component)
        assert component.Walk.getV() == 0.0
        assert not component.Voice.getSpeech().speaking
        eventually(lambda: abs(component.Head.getPose().panSpeed) < 0.01)
        assert component.Head.getPose().pan < 1.4
        held = component.Arm.getPose3DMotorsData().tilt
        assert held > start - 0.9
        eventually(lambda: component.Place.getPose3DEncodersData().tilt == pytest.approx(held, abs=1e-3))
        assert component.Arm.getPose3DMotorsData().tilt == held


def test_a_component_that_ends_stops_what_the_user_serves() -> None:
    with served_to_client(FakeRobot()) as nao:
        servant = GripperI()
        adapter = nao.communicator.createObjectAdapter("User")
        adapter.add(servant, "Gripper")
        adapter.activate()
        component = Gripping()
        connect(component, nao.communicator)
        stop_robot(component)
        assert servant.stopped == 1


def test_an_interface_that_extends_others_is_stopped_by_its_own_and_theirs(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    with imported(tmp_path, "made", {"arms.idl": ARM}), served_to_client(FakeRobot()) as nao:
        arms: Any = importlib.import_module("made.arms")
        calls: list[tuple[str, float | None]] = []

        class RobotI(arms.Robot):  # type: ignore[misc]
            def lift(self, height: float, current: Current) -> None: ...
            def grip(self, force: float, current: Current) -> None: ...
            def halt(self, seconds: float | None, current: Current) -> None:
                calls.append(("halt", seconds))

            def _from(self, current: Current) -> None:
                calls.append(("from", None))

            def freeze(self, current: Current) -> None:
                calls.append(("freeze", None))
                raise arms.Jammed("the belt is off")

        class Armed(_Idle):
            Robot: Any = Proxy("Robot", arms.RobotPrx)

        adapter = nao.communicator.createObjectAdapter("User")
        adapter.add(RobotI(), "Robot")
        adapter.activate()
        component = Armed()
        connect(component, nao.communicator)
        with caplog.at_level(logging.WARNING):
            stop_robot(component)
        assert sorted(calls) == [("freeze", None), ("from", None), ("halt", None)]
        assert "self.Robot could not be stopped" in caplog.text
        assert "the belt is off" in caplog.text
