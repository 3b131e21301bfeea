"""Commands with gains, as clients give them over Zenoh."""

from contextlib import suppress

import pytest

from interfaces.jderobot import CommandRefusedException, InvalidValueException
from interfaces.nao import JointCommand, JointsPrx, SafetyPrx
from naoserver.bodies import find_body
from naoserver.fake import FakeRobot
from tests.support.resets import check_that_a_reset_starts_nothing
from tests.support.robot_server import served_to_client

JOINT = "Left_Elbow_Pitch"
PULL = {JOINT: JointCommand(position=0.4, kp=50.0, kd=2.0)}


@pytest.fixture
def booster(by_environment):
    with served_to_client(FakeRobot(body=find_body("T1"))) as booster:
        yield booster


def place(nao):
    return nao.robot.read().positions[nao.robot.body.joint_names.index(JOINT)]


def test_what_is_limited_is_answered(booster):
    limited = booster.proxy(JointsPrx, "Body").setJointCommands({JOINT: JointCommand(torque=1e6)})
    assert limited == {JOINT: JointCommand(torque=booster.robot.body.joint[JOINT].max_torque)}


def test_a_lease_and_an_emergency_stop_refuse_them(booster):
    body, safety = booster.proxy(JointsPrx, "Body"), booster.proxy(SafetyPrx, "Safety")
    with booster.client() as other:
        other.proxy(SafetyPrx, "Safety").acquireLease("Ann", 60.0)
        with pytest.raises(CommandRefusedException, match="Ann"):
            body.setJointCommands(PULL)
    safety.emergencyStop("enough")
    with pytest.raises(CommandRefusedException, match="enough"):
        body.setJointCommands(PULL)


def test_a_reset_starts_nothing_of_a_client_that_commands_on(booster):
    body = booster.proxy(JointsPrx, "Body")

    def command():
        with suppress(CommandRefusedException):
            body.setJointCommands(PULL)

    check_that_a_reset_starts_nothing(booster.assembly, command, lambda: not booster.is_free(JOINT))


def test_a_nao_refuses_them_with_the_reason(by_environment):
    with served_to_client(FakeRobot()) as nao:
        with pytest.raises(InvalidValueException, match="take no gains by command") as refusal:
            nao.proxy(JointsPrx, "Body").setJointCommands({"HeadYaw": JointCommand(kp=1.0)})
        assert refusal.value.field == "commands"
