"""ALMemory and ALAutonomousLife over a fake robot, in virtual time."""

import pytest

pytest.importorskip("qi")

from naoserver.bodies.capabilities import BatteryReading, FootReading, InertialReading
from naoserver.errors import InvalidCommand
from visualhfsm_naoqi.programs._memory import ALAutonomousLife

KEYS = {
    "InertialSensor/AccelerometerZ": -9.8,
    "InertialSensor/GyroscopeX": 0.3,
    "InertialSensor/GyrX": 0.3,
    "InertialSensor/AngleY": 0.02,
    "LFoot/FSR/FrontRight": 2.0,
    "LFoot/FSR/TotalWeight": 3.0,
    "RFoot/FSR/RearLeft": 0.5,
    "Battery/Charge": 0.75,
    "Head/Touch/Front": 1.0,
    "Head/Touch/Rear": 0.0,
    "LFoot/Bumper/Right": 1.0,
    "LHand/Touch/Back": 0.0,
    "ChestBoard/Button": 0.0,
}


@pytest.mark.parametrize(("key", "value"), KEYS.items())
def test_memory_reports_the_senses(rig, memory, key, value):
    rig.robot.senses.feel(
        inertial=InertialReading((0.1, 0.2, 9.8), (0.3, 0.4, 0.5), 0.01, 0.02),
        left_foot=FootReading(9.81, 19.62, 0.0, 0.0),
        right_foot=FootReading(0.0, 0.0, 4.905, 4.905),
        touched=frozenset({"HeadFront", "LFootBumperRight"}),
        battery=BatteryReading(0.75, -1.5, 30.0, plugged=False),
    )
    assert memory.getData(f"Device/SubDeviceList/{key}/Sensor/Value") == pytest.approx(value)


def test_memory_reports_which_foot_stands(rig, memory):
    keys = ["leftFootTotalWeight", "leftFootContact", "rightFootContact", "footContact"]
    rig.robot.senses.feel(
        left_foot=FootReading(9.81, 19.62, 0.0, 0.0), right_foot=FootReading(0.0, 0.0, 0.0, 0.0)
    )
    assert memory.getListData(keys) == pytest.approx([3.0, 1.0, 0.0, 1.0])


def test_memory_reports_the_posture(rig, memory):
    rig.complete(rig.postures.goToPosture, "Crouch", 1.0)
    assert memory.getListData(["PostureChanged", "PostureFamilyChanged"]) == ["Crouch", "Crouching"]


def test_memory_of_what_is_not_there(memory):
    with pytest.raises(InvalidCommand, match="no data under 'Nose'"):
        memory.getData("Nose")
    assert memory.getListData(["Nose"]) == [None]


def test_a_change_of_a_value_is_waited_for(rig, memory):
    memory.insertData("Mine", 1)
    call = rig.begin(memory.getDataOnChange, "Mine", 0)
    rig.advance(1.0)
    assert not call.ended
    memory.insertData("Mine", 2)
    rig.advance(0.1)
    call.join()
    assert call.result == 2
    assert rig.complete(memory.getDataOnChange, "Mine", 3.0) == pytest.approx(3.0, abs=0.1)


def test_abilities_of_autonomous_life_are_remembered(rig):
    life = rig.access.service(ALAutonomousLife)
    life.setAutonomousAbilityEnabled("BasicAwareness", False)
    assert not life.getAutonomousAbilityEnabled("BasicAwareness")
    assert life.getAutonomousAbilityEnabled("AutonomousBlinking")
    with pytest.raises(InvalidCommand, match="no ability 'Flying'"):
        life.setAutonomousAbilityEnabled("Flying", True)


def test_what_is_measured_cannot_be_overwritten(rig, memory):
    key = "Device/SubDeviceList/HeadYaw/Position/Sensor/Value"
    memory.insertData(key, 7.0)
    assert memory.getData(key) == rig.positions("HeadYaw")[0]


NEVER = "'{}' never happens here unless a program raises it"


@pytest.mark.parametrize(
    ("name", "warned"),
    [
        ("SoundDetected", [NEVER.format("SoundDetected")]),
        ("WordRecognized", []),
        ("FrontTactilTuched", [NEVER.format("FrontTactilTuched")]),
        ("FrontTactilTouched", []),
        ("TouchChanged", []),
        ("redBallDetected", []),
        ("ALTextToSpeech/TextDone", []),
        ("Program/Event", []),
    ],
)
def test_a_subscription_that_nothing_answers_is_logged_once(memory, caplog, name, warned):
    memory.insertData("Program/Event", 0)
    for _ in range(2):
        memory.subscriber(name)
    assert caplog.messages == warned
