"""ALLeds, ALTextToSpeech and ALMemory over a fake robot, in virtual time."""

import pytest

pytest.importorskip("qi")

from naoserver.capabilities import BatteryReading, FootReading, InertialReading, SonarReading
from naoserver.errors import HardwareFailure, InvalidCommand
from naoserver.qi.leds import ALLeds
from naoserver.qi.memory import ALAutonomousLife
from naoserver.qi.sensors import ALSonar, ALSystem, ALTouch
from naoserver.qi.speech import ALAnimatedSpeech, ALTextToSpeech

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


@pytest.fixture
def leds(rig):
    return rig.access.service(ALLeds)


@pytest.mark.parametrize(
    "color", [(1.0, 0.0, 0.0), (0xFF0000,), ("red",)], ids=["three parts", "a number", "a name"]
)
def test_a_fade_to_a_colour_ends_when_it_is_shown(rig, leds, color):
    assert rig.complete(leds.fadeRGB, "FaceLeds", *color, 0.5) == pytest.approx(0.5, abs=0.03)
    assert rig.robot.lights.colors()["LeftEye"] == pytest.approx((1.0, 0.0, 0.0))
    assert rig.robot.lights.colors()["RightEye"] == pytest.approx((1.0, 0.0, 0.0))


def test_one_part_of_a_colour(rig, leds):
    rig.complete(leds.fadeRGB, "ChestLeds", 0.2, 0.4, 0.6, 0.0)
    leds.setIntensity("ChestLedsGreen", 1.0)
    rig.advance(0.1)
    assert rig.robot.lights.colors()["Chest"] == pytest.approx((0.2, 1.0, 0.6))


@pytest.mark.parametrize(
    ("name", "lights"),
    [
        ("FaceLed3", ["LeftEye", "RightEye"]),
        ("FaceLedLeft0", ["LeftEye"]),
        ("FaceLedsRightTop", ["RightEye"]),
        ("LeftEarLedsOdd", ["LeftEar"]),
        ("RightFaceLed1", ["RightEye"]),
        ("LeftEarLed10", ["LeftEar"]),
        ("BrainLed0", ["Head"]),
        ("Face/Led/Red/Left/45Deg/Actuator/Value", ["LeftEye"]),
        ("RFoot/Led/Green/Actuator/Value", ["RightFoot"]),
        ("ChestBoard/Led/Blue/Actuator/Value", ["Chest"]),
    ],
)
def test_a_single_lamp_stands_for_its_group(leds, name, lights):
    assert leds.listGroup(name) == lights


def test_one_color_of_a_single_lamp(rig, leds):
    leds.off("ChestLeds")
    leds.setIntensity("ChestBoard/Led/Blue/Actuator/Value", 0.5)
    rig.advance(0.1)
    assert rig.robot.lights.colors()["Chest"] == pytest.approx((0.0, 0.0, 0.5))


def test_groups_of_ones_own(rig, leds):
    leds.createGroup("Mine", ["ChestLeds", "FeetLeds"])
    leds.off("AllLeds")
    leds.on("Mine")
    rig.advance(0.1)
    assert leds.listGroup("Mine") == ["Chest", "LeftFoot", "RightFoot"]
    assert leds.getIntensity("Mine") == [1.0, 1.0, 1.0]


def seen(rig, call, seconds):
    """Return the colours that the left eye shows until a call ends."""
    colors = set()
    for _ in range(round(seconds / 0.02)):
        rig.advance(0.02)
        colors.add(tuple(round(part, 1) for part in rig.robot.lights.colors()["LeftEye"]))
    call.join()
    return colors


@pytest.mark.parametrize(
    ("effect", "arguments", "shown"),
    [
        ("rasta", (3.0,), {(0.0, 1.0, 0.0), (1.0, 1.0, 0.0), (1.0, 0.0, 0.0)}),
        ("rotateEyes", (0xFF0000, 0.5, 2.0), {(1.0, 0.0, 0.0), (0.0, 0.0, 0.0)}),
        ("randomEyes", (2.0,), set()),
    ],
)
def test_an_effect_lasts_as_long_as_it_should(rig, leds, effect, arguments, shown):
    start = rig.clock.now()
    call = rig.begin(getattr(leds, effect), *arguments)
    colors = seen(rig, call, arguments[-1] + 0.2)
    assert shown <= colors
    assert len(colors) > 5
    assert rig.complete(getattr(leds, effect), *arguments) == pytest.approx(arguments[-1], abs=0.1)
    assert rig.clock.now() - start < 3 * arguments[-1]


def test_an_effect_can_be_stopped(rig, leds):
    call = rig.begin(leds.randomEyes, 60.0)
    call.call.stop()
    rig.advance(0.1)
    call.join()


def test_lights_that_are_none(rig, leds):
    with pytest.raises(InvalidCommand, match="no group of lights 'Nose'"):
        leds.on("Nose")
    rig.robot.lights = None
    with pytest.raises(HardwareFailure, match="no lights"):
        leds.on("FaceLeds")


@pytest.fixture
def speech(rig):
    return rig.access.service(ALTextToSpeech)


def test_a_text_is_said_without_its_tags(rig, memory, speech):
    rig.complete(speech.say, "Hello \\pau=300\\ you")
    assert rig.robot.voice.utterance().text == "Hello   you"
    assert memory.getData("ALTextToSpeech/TextDone") == 1


def test_animations_are_left_out(rig):
    rig.complete(rig.access.service(ALAnimatedSpeech).say, "^start(animations/Stand/Gestures/Hey_1) Hey")
    assert rig.robot.voice.utterance().text == "Hey"


def test_stop_all_ends_what_is_being_said(rig, speech):
    call = rig.begin(speech.say, "a long text " * 20)
    speech.stopAll()
    rig.advance(0.2)
    call.join()


def test_stop_all_forgets_what_was_not_begun_yet(rig, speech):
    late = rig.arrive(speech.say, "a long text " * 20)
    speech.stopAll()
    speech.say(late, "a long text " * 20)
    assert rig.robot.voice.utterance().count == 0
    rig.complete(speech.say, "Hello")
    assert rig.robot.voice.utterance().text == "Hello"


def test_a_voice_goes_with_its_language(speech):
    speech.setVoice("naofrf")
    assert (speech.getLanguage(), speech.getVoice()) == ("French", "naofrf")
    with pytest.raises(InvalidCommand, match="no voice 'Nobody'; there are naoenu"):
        speech.setVoice("Nobody")


def test_parameters_of_the_voice_are_remembered(speech):
    speech.setParameter("speed", 80)
    assert (speech.getParameter("speed"), speech.getParameter("pitchShift")) == (80.0, 0.0)
    speech.resetSpeed()
    assert speech.getParameter("speed") == 0.0


def test_of_many_values_without_effect_the_newest_are_kept(speech):
    for i in range(1001):
        speech.setParameter(f"parameter {i}", i + 1)
    speech.setVolume(0.3)
    assert speech.getVolume() == 0.3
    assert [speech.getParameter(f"parameter {i}") for i in (1000, 0)] == [1001.0, 0.0]


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


def test_touch_lists_its_sensors(rig):
    touch = rig.access.service(ALTouch)
    rig.robot.senses.feel(touched=frozenset({"LHandBack"}))
    assert [name for name, touched, _ in touch.getStatus() if touched] == ["LHand/Touch/Back"]
    assert [name for name, _, _ in touch.getStatus()] == touch.getSensorList()
    rig.robot.senses = None
    with pytest.raises(HardwareFailure, match="feels no touch"):
        touch.getStatus()


def test_the_sonar_stands_still_unless_somebody_wants_it(rig, memory):
    rig.robot.senses.feel(sonar=SonarReading(0.5))
    sonar = rig.access.service(ALSonar)
    keys = ["Device/SubDeviceList/US/Left/Sensor/Value", "Device/SubDeviceList/US/Right/Sensor/Value"]
    assert memory.getListData(keys) == [0.0, 0.0]
    sonar.subscribe("me")
    assert memory.getListData(keys) == [0.5, 5.0]
    rig.robot.senses.feel(sonar=SonarReading(0.7))
    sonar.unsubscribe("me")
    rig.robot.senses.feel(sonar=SonarReading(0.9))
    assert memory.getListData(keys) == [0.7, 5.0]


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


def test_the_mode_of_body_language_is_remembered(rig):
    speech = rig.access.service(ALAnimatedSpeech)
    speech.setBodyLanguageMode(0)
    assert speech.getBodyLanguageMode() == 0


def test_the_system_says_what_it_is(rig):
    assert ["body", "H25"] in rig.access.service(ALSystem).systemInfo()


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
