"""The keys of ALMemory that the robot itself keeps, over a fake robot in virtual time."""

from dataclasses import replace

import pytest

pytest.importorskip("qi")

from naoserver.bodies.capabilities import FootReading, SonarReading
from naoserver.bodies.nao import H25
from naoserver.errors import InvalidCommand
from naoserver.fake import FakeRobot
from plugins.naoqi.tests.support.rig import Rig
from tests.support.present import present
from visualhfsm_naoqi.programs._leds import LAMPS, ALLeds
from visualhfsm_naoqi.programs._memory import ALMemory
from visualhfsm_naoqi.programs._sensors import ALSonar
from visualhfsm_naoqi.programs._speech import ALTextToSpeech

DEVICES = "Device/SubDeviceList/"


class LabouringRobot(FakeRobot):
    """A robot whose left knee pushes, and whose other joints have different temperatures."""

    def read(self):
        reading = super().read()
        knee = H25.joint_names.index("LKneePitch")
        torques = [0.0] * len(reading.torques)
        torques[knee] = -2.0
        temperatures = [30.0, 75.0, 80.9, 81.1, 95.0, *reading.temperatures[5:]]
        return replace(reading, torques=tuple(torques), temperatures=tuple(temperatures))


@pytest.fixture
def labouring():
    rig = Rig(LabouringRobot)
    yield rig.access.service(ALMemory)
    rig.close()


def test_the_current_of_a_motor_is_that_of_its_torque(labouring):
    motor, battery = present(H25.joint["LKneePitch"].motor), present(H25.battery)
    # The winding takes the same power as the battery's model: the loss of a motor that stands.
    resistance = battery.voltage**2 / (motor.no_load_speed * motor.stall_torque)
    loss = motor.no_load_speed / motor.stall_torque * 2.0**2
    current = labouring.getData(f"{DEVICES}LKneePitch/ElectricCurrent/Sensor/Value")
    assert resistance * current**2 == pytest.approx(loss)
    assert labouring.getData(f"{DEVICES}RKneePitch/ElectricCurrent/Sensor/Value") == 0.0


def test_every_joint_has_a_current_and_a_status(memory):
    keys = [
        f"{DEVICES}{joint}/{what}"
        for joint in H25.joint_names
        for what in ("ElectricCurrent/Sensor/Value", "Temperature/Sensor/Status")
    ]
    assert None not in memory.getListData(keys)


def test_the_status_of_a_motor_rises_with_its_temperature(labouring):
    keys = [f"{DEVICES}{joint}/Temperature/Sensor/Status" for joint in H25.joint_names[:5]]
    assert labouring.getListData(keys) == [0, 1, 1, 2, 3]


@pytest.mark.parametrize(
    ("forces", "center"),
    [
        ({"front_left": 10.0, "front_right": 10.0}, (0.07025, 0.0034)),
        ({"rear_left": 5.0}, (-0.03025, 0.0299)),
        ({"front_left": 5.0, "rear_left": 5.0}, (0.02, 0.0299)),
        ({}, (0.0, 0.0)),
    ],
    ids=["toes", "a corner", "the outer edge", "lifted"],
)
def test_the_center_of_pressure_is_where_the_foot_is_loaded(rig, memory, forces, center):
    none = dict.fromkeys(("front_left", "front_right", "rear_left", "rear_right"), 0.0)
    rig.robot.senses.feel(left_foot=FootReading(**none | forces))
    keys = [f"{DEVICES}LFoot/FSR/CenterOfPressure/{axis}/Sensor/Value" for axis in "XY"]
    assert memory.getListData(keys) == pytest.approx(center)


def test_the_sonar_has_keys_of_each_echo_and_of_the_nearest(rig, memory):
    rig.robot.senses.feel(sonar=SonarReading(0.7, 0.5))
    rig.access.service(ALSonar).subscribe("me")
    assert memory.getData(f"{DEVICES}US/Sensor/Value") == 0.5
    assert memory.getListData([f"{DEVICES}US/Left/Sensor/Value{i}" for i in range(1, 10)]) == [5.0] * 9


@pytest.mark.parametrize(
    ("group", "key", "value"),
    [
        ("FaceLeds", "Face/Led/Red/Left/0Deg", 1.0),
        ("FaceLeds", "Face/Led/Blue/Right/315Deg", 0.5),
        ("ChestLeds", "ChestBoard/Led/Green", 0.25),
        ("RightFootLeds", "RFoot/Led/Red", 1.0),
        ("LeftEarLeds", "Ears/Led/Left/324Deg", 1.0),
        ("BrainLeds", "Head/Led/Rear/Right/2", 1.0),
    ],
)
def test_memory_shows_the_lamps(rig, memory, group, key, value):
    leds = rig.access.service(ALLeds)
    leds.off("AllLeds")
    rig.complete(leds.fadeRGB, group, 1.0, 0.25, 0.5, 0.0)
    assert memory.getData(f"{DEVICES}{key}/Actuator/Value") == pytest.approx(value)


def test_every_lamp_can_be_set_by_its_name(rig, memory):
    leds = rig.access.service(ALLeds)
    for lamp in LAMPS:
        leds.off("AllLeds")
        leds.on(lamp)
        rig.advance(0.02)
        assert memory.getData(f"{DEVICES}{lamp}") == 1.0


def test_a_robot_without_lights_has_no_lamps(rig):
    rig.robot.lights = None
    with pytest.raises(InvalidCommand, match="no data"):
        rig.access.service(ALMemory).getData(f"{DEVICES}ChestBoard/Led/Green/Actuator/Value")


def test_the_facts_of_the_body_are_those_of_a_nao(memory):
    keys = ["RobotConfig/Body/Type", "RobotConfig/Body/BaseVersion"]
    assert memory.getListData(keys) == ["Nao", "V6.0"]
    assert memory.getData("Device/DeviceList/ChestBoard/BodyId")
    assert memory.getData(f"{DEVICES}InertialSensor/GyrRef/Sensor/Value") == 0.0


def test_the_posture_has_its_former_name_too(rig, memory):
    rig.complete(rig.postures.goToPosture, "SitRelax", 1.0)
    assert memory.getData("robotPoseChanged") == "Sit"


def test_a_text_has_a_status_from_its_queue_to_its_end(rig, memory):
    speech = rig.access.service(ALTextToSpeech)
    assert memory.getData("ALTextToSpeech/Status") == [0, "done"]
    first = rig.begin(speech.say, "a long text " * 20)
    assert memory.getData("ALTextToSpeech/Status") == [1, "started"]
    speech.stopAll()
    rig.advance(0.2)
    first.join()
    assert memory.getData("ALTextToSpeech/Status") == [1, "stopped"]
    rig.complete(speech.say, "Hello")
    assert memory.getData("ALTextToSpeech/Status") == [2, "done"]
