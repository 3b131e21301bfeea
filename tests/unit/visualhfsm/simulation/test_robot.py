"""Walk, motions and emergency stop of a robot under test: in virtual time, without threads."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from hfsm_runtime import Automaton, Component, Proxy, State
from hfsm_runtime.virtual.errors import UnknownName
from interfaces.jderobot import CommandRefusedException, EncodersPrx, InvalidValueException, MotorsPrx
from interfaces.nao import ActionStatus, HealthPrx, JointsPrx, PoseHeadPrx, PosturesPrx, SafetyPrx
from naoserver.bodies import BODY_NAMES
from naoserver.errors import RobotError
from tests.support.arm import ARM, ARM_TOML
from tests.support.plugins import OWN_ROBOTS
from visualhfsm.simulation import RobotKind
from visualhfsm.testing import MakeBehavior


class Whole(Component):
    Walk = Proxy("Motors", MotorsPrx)
    Odometry = Proxy("Encoders", EncodersPrx)
    Postures = Proxy("Postures", PosturesPrx)
    Safety = Proxy("Safety", SafetyPrx)
    Health = Proxy("Health", HealthPrx)

    def automaton(self) -> Automaton:
        return Automaton(id=1, name="nothing", states=(State(id=1, name="idle", initial=True),))


class Stands(Component):
    Body = Proxy("Body", JointsPrx)
    Postures = Proxy("Postures", PosturesPrx)

    def automaton(self) -> Automaton:
        return Automaton(id=1, name="nothing", states=(State(id=1, name="idle", initial=True),))


class Looks(Component):
    Head = Proxy("Head", PoseHeadPrx)

    def automaton(self) -> Automaton:
        return Automaton(id=1, name="nothing", states=(State(id=1, name="idle", initial=True),))


@pytest.fixture
def b(behavior: MakeBehavior):
    return behavior(Whole, robot="fake")


def test_a_posture_is_reached_and_reported(b) -> None:
    b.component.Postures.getPostureState.latest()
    b.component.Postures.goToPosture("Crouch", 1.0)
    b.advance(0.2)
    assert b.component.Postures.getPostureState.latest().value.status == ActionStatus.Moving
    b.advance(10.0)
    assert b.component.Postures.getPostureState().status == ActionStatus.Done
    assert b.component.Postures.getPosture() == "Crouch"


@pytest.mark.parametrize("robot", ["fake", pytest.param("sim", marks=pytest.mark.sim)])
def test_a_run_repeats_with_what_fails_in_it(behavior: MakeBehavior, robot: RobotKind) -> None:
    def course() -> list[tuple[float, ...]]:
        settings: dict[str, Any] = {"seed": 7} if robot == "sim" else {}
        b = behavior(Looks, robot=robot, camera="drawn", **settings)
        seen = []
        for tenth in range(12):
            if tenth == 2:
                b.robot.fail("HeadYaw", "noisy", 0.1)
            elif tenth == 4:
                b.robot.fail("HeadPitch", "weak" if robot == "sim" else "slow", seconds=0.4)
            elif tenth == 9:
                b.robot.heal("HeadYaw")
            b.component.Head.setSpeed(0.5, 0.3)
            b.advance(0.1)
            seen.append(tuple(b.robot.device.read().positions))
        return seen

    first = course()
    assert len(set(first)) == 12
    assert course() == first


def test_it_walks_for_as_long_as_that_is_renewed(b) -> None:
    for _ in range(10):
        b.component.Walk.setV(0.1)
        b.advance(0.2)
    walked = b.component.Odometry.getEncodersData().robotx
    assert walked > 0.1
    b.advance(5.0)
    stopped = b.component.Odometry.getEncodersData().robotx
    b.advance(5.0)
    assert b.component.Odometry.getEncodersData().robotx == stopped


def test_an_emergency_stop_ends_all_of_it_and_is_reported(b) -> None:
    b.component.Safety.getSafetyState.latest()
    b.component.Health.getHealth.latest()
    b.component.Postures.goToPosture("Crouch", 0.2)
    b.advance(0.5)
    b.component.Safety.emergencyStop("enough")
    b.advance(1.0)
    assert b.component.Postures.getPostureState().status == ActionStatus.Stopped
    assert b.component.Safety.getSafetyState.latest().value.reason == "enough"
    assert "emergency stop: enough" in [e.message for e in b.component.Health.getHealth.latest().value.events]
    with pytest.raises(CommandRefusedException, match="enough"):
        b.component.Walk.setV(0.1)


class Commanding(Whole):
    Head = Proxy("Head", PoseHeadPrx)

    def automaton(self) -> Automaton:
        only = State(id=1, name="only", initial=True, code=lambda: self.Head.setPose(0.1, 0.0, 0.5))
        return Automaton(id=1, name="commanding", states=(only,))


@pytest.mark.parametrize("resume", [None, True])
def test_a_behavior_pauses_at_an_emergency_stop_until_somebody_lets_it_go_on(
    behavior: MakeBehavior, resume: bool | None
) -> None:
    b = behavior(Commanding, robot="fake")
    b.advance(0.5)
    b.component.Safety.emergencyStop("enough")
    b.advance(10.0)
    assert b.time == pytest.approx(0.6)
    assert len(b.calls("Head.setPose")) == 7, "the one that was refused, and then none"
    b.component.Safety.resetEmergencyStop(resume)
    if not resume:
        b.advance(10.0)
        assert b.time == pytest.approx(0.6), "the reset alone starts nothing"
        b.resume()
    b.advance(2.0)
    assert b.time > 1.5


def test_a_person_who_lets_a_behavior_go_on_before_the_reset_can_do_so_again(
    behavior: MakeBehavior,
) -> None:
    b = behavior(Commanding, robot="fake")
    b.advance(0.5)
    b.component.Safety.emergencyStop("enough")
    for _ in range(3):
        b.advance(0.3)
        b.resume()
    b.advance(0.3)
    b.component.Safety.resetEmergencyStop()
    before = b.time
    b.advance(1.0)
    assert b.time == before
    b.resume()
    b.advance(2.0)
    assert b.time > before + 1.5


@pytest.mark.sim
@pytest.mark.parametrize("name", ["T1", "G1"])
def test_the_legs_of_a_humanoid_that_stands_obey_postures_but_no_commands(
    name: str, behavior: MakeBehavior
) -> None:
    b = behavior(Stands, robot="sim", body=name, world="empty")
    body, legs = b.component.Body, b.robot.device.body.groups.legs
    b.advance(0.5)
    for joint in legs:
        with pytest.raises(InvalidValueException, match=f"{joint} keeps the robot upright"):
            body.setJointPositions({joint: 1.0}, 0.1)
    b.component.Postures.goToPosture("Crouch", 1.0)
    b.advance(4.0)
    assert b.component.Postures.getPostureState().status == ActionStatus.Done
    assert not b.robot.device.state().fallen
    body.setStiffnesses(dict.fromkeys(legs, 0.0), 0.0)
    b.advance(0.1)
    body.setJointPositions({legs[0]: 0.1}, 0.1)


@pytest.mark.parametrize("name", BODY_NAMES)
def test_any_known_body_turns_what_carries_its_camera(name: str, behavior: MakeBehavior) -> None:
    b = behavior(Looks, robot="fake", body=name)
    assert b.robot.device.body.name == name
    b.component.Head.setPose(0.3, 0.1, 1.0)
    b.advance(2.0)
    assert b.robot.head == pytest.approx((0.3, 0.1), abs=0.01)


@OWN_ROBOTS
@pytest.mark.sim
@pytest.mark.parametrize("name", ["arm.toml", "arm.urdf"])
def test_a_body_of_ones_own_is_given_by_its_file_or_its_model(
    name: str, tmp_path: Path, behavior: MakeBehavior
) -> None:
    (tmp_path / "arm.toml").write_text(ARM_TOML)
    (tmp_path / "arm.urdf").write_text(ARM)
    b = behavior(Whole, robot="fake", body=tmp_path / name)
    assert [*b.robot.joints] == ["turn", "elbow"]
    with pytest.raises(UnknownName, match="has no neck"):
        _ = b.robot.head


def test_a_body_that_is_not_there_is_named(tmp_path: Path, behavior: MakeBehavior) -> None:
    with pytest.raises(RobotError, match=r"there is no body 'R2D2'; there are H25"):
        behavior(Whole, robot="fake", body="R2D2")
    with pytest.raises(FileNotFoundError, match=r"there is no robot robots/none\.toml; looked for"):
        behavior(Whole, robot="fake", body="robots/none.toml")
