"""Emergency stop and lease as clients use them: over Zenoh, for every command of the robot."""

from contextlib import closing
from queue import SimpleQueue

import pytest

from interfaces.jderobot import CommandRefusedException, InvalidValueException, MotorsPrx, Pose3DMotorsPrx
from interfaces.nao import JointsPrx, MotionsPrx, PoseHeadPrx, PosturesPrx, SafetyPrx
from naoserver.fake import FakeRobot
from naoserver.options import SafetyOptions, ServerOptions
from naoserver.safety._gate import LONGEST_LEASE
from tests.support.carriers import is_used, over_both
from tests.support.limits import EVENT_LIMIT, FOREVER
from tests.support.robot_server import eventually, served_to_client, wait_for
from tests.support.stranger import stranger
from zenoh_ice.data.keys import client_token


@pytest.fixture
def nao(by_environment):
    with served_to_client(FakeRobot()) as nao:
        yield nao


def commands(nao):
    """Every way to command the robot, by name."""
    head, body = nao.proxy(PoseHeadPrx, "Head"), nao.proxy(JointsPrx, "Body")
    knee, neck = nao.proxy(Pose3DMotorsPrx, "LeftKneeMotors"), nao.proxy(Pose3DMotorsPrx, "NeckSpeed")
    walk = nao.proxy(MotorsPrx, "Motors")
    motions, postures = nao.proxy(MotionsPrx, "Motions"), nao.proxy(PosturesPrx, "Postures")
    return {
        "setPose": lambda: head.setPose(0.3, 0.1, 0.5),
        "setSpeed": lambda: head.setSpeed(0.1, 0.0),
        "setJointPositions": lambda: body.setJointPositions({"HeadYaw": 0.3}, 0.5),
        "setStiffnesses": lambda: body.setStiffnesses({"HeadYaw": 0.5}, 0.0),
        "LeftKneeMotors": lambda: knee.setPose3DMotorsData(knee.getPose3DMotorsData()),
        "NeckSpeed": lambda: neck.setPose3DMotorsData(neck.getPose3DMotorsData()),
        "setV": lambda: walk.setV(0.05),
        "play": lambda: motions.play(motions.getMotions()[0].name, 1.0),
        "goToPosture": lambda: postures.goToPosture("StandInit", 0.5),
    }


def stop_everything(nao):
    """Call every stop operation of every servant of the robot's."""
    stopped = set()
    for identity, servant in nao.assembly.servants.items():
        for operation in servant.ice_interface.stop_operations:
            nao.communicator.stringToProxy(identity).ice_invoke(operation)
            stopped.add(identity)
    assert {"Head", "Body", "Motors", "LeftKneeMotors", "NeckSpeed", "Motions", "Postures"} <= stopped


def refused(nao):
    """The names of the commands that are refused."""
    names = set()
    for name, command in commands(nao).items():
        try:
            command()
        except CommandRefusedException:
            names.add(name)
        except InvalidValueException:
            pass  # the gate let it through; something else moves the joints
    return names


@over_both
def test_an_emergency_stop_holds_the_robot_and_refuses_every_command_until_it_is_reset(carrier, nao):
    safety, body = nao.proxy(SafetyPrx, "Safety"), nao.proxy(JointsPrx, "Body")
    body.setJointPositions({"HeadYaw": 1.5}, 0.02)
    safety.emergencyStop("enough")
    state = body.getJointState()
    assert abs(state.commands[0]) < 1.0
    assert refused(nao) == commands(nao).keys()
    assert safety.getSafetyState().reason == "enough"
    assert body.getJointState().commands == state.commands
    safety.resetEmergencyStop(True)
    assert refused(nao) == set()
    assert is_used(carrier)


@over_both
def test_everybody_can_stop_while_somebody_else_holds_the_robot(nao):
    with nao.client() as other:
        other.proxy(SafetyPrx, "Safety").acquireLease("Ann", 60.0)
        assert refused(nao) == commands(nao).keys()
        stop_everything(nao)
        nao.proxy(MotorsPrx, "Motors").setV(0.0)
        nao.proxy(SafetyPrx, "Safety").emergencyStop("enough")
        assert refused(other) == commands(nao).keys()


@over_both
def test_everybody_can_stop_after_an_emergency_stop(nao):
    nao.proxy(SafetyPrx, "Safety").emergencyStop("enough")
    stop_everything(nao)
    assert refused(nao) == commands(nao).keys()


def test_the_balls_are_no_part_of_the_robot(nao):
    nao.proxy(SafetyPrx, "Safety").emergencyStop("enough")
    ball = nao.proxy(Pose3DMotorsPrx, "BallRedMotors")
    assert ball.setPose3DMotorsData(ball.getPose3DMotorsData()) == 0


@over_both
def test_a_lease_ends_with_its_holder(nao):
    with nao.client() as other:
        other.proxy(SafetyPrx, "Safety").acquireLease("Ann", 60.0)
        with pytest.raises(CommandRefusedException) as refusal:
            nao.proxy(SafetyPrx, "Safety").acquireLease("Bob", 1.0)
        assert refusal.value.holder == "Ann"
    eventually(lambda: not refused(nao))


def test_who_declares_and_ends_tokens_of_another_client_ends_neither_its_lease_nor_its_walk():
    patient = ServerOptions(safety=SafetyOptions(velocity_timeout=FOREVER))
    with served_to_client(FakeRobot(), patient) as nao, stranger(nao.endpoint) as intruder:
        lost: SimpleQueue[str] = SimpleQueue()
        walk = nao.proxy(MotorsPrx, "Motors")
        nao.proxy(SafetyPrx, "Safety").acquireLease("Ann", 60.0)
        walk.setV(0.2)
        with closing(nao.served_by.onClientLost(lost.put)):
            # After its own end the others have been heard of.
            for client in [*[nao.communicator.client_id] * 5, intruder.id]:
                with intruder.declared(client_token(nao.realm, client)):
                    pass
            assert lost.get(timeout=EVENT_LIMIT) == intruder.id
        assert nao.proxy(SafetyPrx, "Safety").getSafetyState().holder == "Ann"
        assert walk.getV() == pytest.approx(0.2)
        walk.setV(0.1)  # it is still Ann's


def test_what_no_lease_can_be_is_reported(nao):
    with pytest.raises(InvalidValueException) as refusal:
        nao.proxy(SafetyPrx, "Safety").acquireLease("Ann", 61.0)
    assert refusal.value.field == "seconds"


def test_the_stream_reports_each_change(nao):
    safety = nao.proxy(SafetyPrx, "Safety")
    wait_for(safety.getSafetyState, lambda state: not state.stopped)
    safety.emergencyStop("enough")
    wait_for(safety.getSafetyState, lambda state: state.stopped and state.reason == "enough")
    safety.resetEmergencyStop()
    safety.acquireLease("Ann", LONGEST_LEASE)
    wait_for(safety.getSafetyState, lambda state: state.holder == "Ann" and state.remaining > 0.0)
    safety.releaseLease()
    wait_for(safety.getSafetyState, lambda state: not state.holder)
