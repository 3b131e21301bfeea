"""Programs as people write them for NAOqi run to their end on a robot that is served as one.

A program or two for each service, over genuine libqi: what each operation does is tested without its network.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import wraps
from typing import Any

import pytest

pytest.importorskip("qi")
pytest.importorskip("cv2")

from plugins.naoqi.tests.support.naoqi import connected
from tests.support.processes import ComponentProcess, module
from tests.support.waiting import until

PROGRAMS: list[Callable[[Any], None]] = []
DEVICES = "Device/SubDeviceList/"


def program(function: Callable[[Any], None]) -> Callable[[Any], None]:
    """Run a function as a program; it is given what looks up a service by its name."""
    PROGRAMS.append(function)
    return function


def upright(function: Callable[[Any], None]) -> Callable[[Any], None]:
    """Let the robot stand and look as at its start before a program that walks, leans or looks for something."""

    @wraps(function)
    def run(service: Any) -> None:
        service("ALRobotPosture").goToPosture("StandInit", 1.0)
        function(service)

    return run


@pytest.fixture(scope="module")
def session():
    with (
        ComponentProcess(
            module("plugins.naoqi.tests.support.faulty", "--qi", "tcp://127.0.0.1:0", "--speed", "20")
        ) as server,
        connected(server.wait_for(r"^ready: (\S+)")[1]) as session,
    ):
        yield session


@pytest.fixture
def service(session):
    if not session.service("ALMotion").robotIsWakeUp():
        session.service("ALMotion").wakeUp()
    yield session.service
    session.service("Faults").clear()
    session.service("Faults").touch([])
    session.service("ALMotion").killAll()


# -- voice and sound -----------------------------------------------------------------------------------------


@program
def says_it_in_every_language(service):
    speech = service("ALTextToSpeech")
    before = speech.getLanguage()
    for language in speech.getAvailableLanguages():
        speech.setLanguage(language)
        speech.say("Nao")
    speech.setLanguage(before)


@program
@upright
def says_it_with_gestures(service):
    hey = "animations/Stand/Gestures/Hey_1"
    service("ALAnimatedSpeech").say(f"^start({hey}) Hello ^wait({hey})", {"bodyLanguageMode": "disabled"})
    assert service("ALBehaviorManager").getRunningBehaviors() == []


@program
def plays_music_in_the_background(service):
    player = service("ALAudioPlayer")
    music = player.loadFile("/home/nao/music.mp3")
    task = player.pCall(["playInLoop", music])
    until(lambda: player.getCurrentPosition(music) > 0.0)
    player.setVolume(music, 0.4)
    player.stop(music)
    assert not player.wait(task, 5000)
    player.unloadAllFiles()


@program
def records_and_plays_it_back(service):
    recorder, player = service("ALAudioRecorder"), service("ALAudioPlayer")
    recorder.startMicrophonesRecording("/home/nao/recordings/test.wav", "wav", 16000, (0, 0, 1, 0))
    service("ALTextToSpeech").say("Say something")
    recorder.stopMicrophonesRecording()
    player.playFile("/home/nao/recordings/test.wav")


@program
def listens_how_loud_it_is(service):
    device = service("ALAudioDevice")
    device.enableEnergyComputation()
    assert device.getFrontMicEnergy() == device.getRearMicEnergy() == 0.0
    device.disableEnergyComputation()


@program
def switches_off_what_moves_by_itself(service):
    for each in ("AutonomousBlinking", "BackgroundMovement", "ListeningMovement", "SpeakingMovement"):
        service(f"AL{each}").setEnabled(False)
        assert service(f"AL{each}").isEnabled() is False
    service("ALAutonomousMoves").setExpressiveListeningEnabled(False)
    service("ALBasicAwareness").stopAwareness()


@program
def chooses_a_camera_before_it_has_subscribed(service):
    video = service("ALVideoDevice")
    assert video.setCameraParameter("test", 18, 1) is False
    handle = video.subscribe("test", 1, 11, 5)
    assert video.setCameraParameter(handle, 18, 1) is True
    assert video.getActiveCamera(handle) == 1
    video.unsubscribe(handle)


# -- joints --------------------------------------------------------------------------------------------------


@program
def plays_a_motion_of_choregraphe(service):
    handles = [[3, -0.33, 0.0], [3, 0.33, 0.0]]
    keys = [[0.2, *handles], [-0.2, *handles], [0.0, *handles]]
    service("ALMotion").angleInterpolationBezier(["HeadYaw"], [[1.0, 2.0, 3.0]], [keys])


@program
def opens_and_closes_its_hands(service):
    motion = service("ALMotion")
    for hand in ("LHand", "RHand"):
        motion.openHand(hand)
        motion.closeHand(hand)


@program
def lists_the_limits_of_its_joints(service):
    motion = service("ALMotion")
    names = motion.getBodyNames("Body")
    limits = motion.getLimits("Body")
    assert len(names) == len(limits) == 26
    assert all(low < high for low, high, *_ in limits)


@program
def prints_a_summary(service):
    assert "HeadYaw" in service("ALMotion").getSummary()


# -- postures and behaviors ------------------------------------------------------------------------------------


@program
def goes_through_postures(service):
    posture = service("ALRobotPosture")
    posture.setMaxTryNumber(3)
    assert "Stand" in posture.getPostureList()
    for name in ("StandInit", "StandZero", "Crouch", "Stand"):
        assert posture.goToPosture(name, 1.0)
        assert posture.getPosture() == name, service("ALMotion").getSummary()


@program
@upright
def runs_an_animation(service):
    animations = [each for each in service("ALBehaviorManager").getInstalledBehaviors() if "Yes" in each]
    service("ALAnimationPlayer").run(animations[0])
    future = service("ALAnimationPlayer").run("animations/Stand/Gestures/Explain_10", _async=True)
    future.cancel()


@program
def switches_autonomous_life_off(service):
    life = service("ALAutonomousLife")
    if life.getState() != "disabled":
        life.setState("disabled")
    assert life.getState() == "disabled"


# -- walk ------------------------------------------------------------------------------------------------------


@program
@upright
def walks_forward(service):
    motion = service("ALMotion")
    motion.moveInit()
    x, y, _ = motion.getRobotPosition(True)
    assert motion.moveTo(0.2, 0.0, 0.0)
    ahead, aside, _ = motion.getRobotPosition(True)
    assert math.hypot(ahead - x, aside - y) == pytest.approx(0.2, abs=0.05)


@program
@upright
def walks_with_parameters_of_its_own(service):
    config = [["Frequency", 0.8], ["MaxStepX", 0.03], ["StepHeight", 0.02]]
    motion = service("ALMotion")
    motion.setWalkTargetVelocity(0.5, 0.0, 0.1, 1.0, config)
    motion.stopMove()


@program
@upright
def walks_by_the_names_of_naoqi_1(service):
    motion = service("ALMotion")
    motion.setWalkArmsEnabled(True, True)
    motion.walkInit()
    motion.walkTo(0.1, 0.0, 0.0)
    motion.waitUntilWalkIsFinished()
    assert not motion.walkIsActive()


@program
@upright
def takes_foot_steps(service):
    motion = service("ALMotion")
    motion.setFootStepsWithSpeed(["LLeg", "RLeg"], [[0.06, 0.1, 0.0], [0.06, -0.1, 0.0]], [0.8, 0.8], False)
    motion.waitUntilMoveIsFinished()


@program
@upright
def asks_how_fast_it_walks(service):
    motion = service("ALMotion")
    motion.move(0.03, 0.0, 0.0)
    assert motion.getRobotVelocity()[0] > 0.0
    motion.stopMove()
    assert dict(motion.getMoveConfig("Default"))["MaxStepX"] == pytest.approx(0.04)


# -- space and balance -------------------------------------------------------------------------------------------


@program
@upright
def reaches_with_a_hand(service):
    motion = service("ALMotion")
    x, y, z, *turns = motion.getPosition("LArm", 0, False)
    motion.positionInterpolation("LArm", 0, [x, y + 0.03, z + 0.03, *turns], 7, 1.0, True)
    assert motion.getPosition("LArm", 0, False)[1] == pytest.approx(y + 0.03, abs=0.01)


@program
def switches_reflexes(service):
    motion = service("ALMotion")
    motion.setFallManagerEnabled(True)
    motion.setCollisionProtectionEnabled("Arms", True)
    motion.setBreathEnabled("Body", False)
    assert motion.getFallManagerEnabled()


# -- lights ------------------------------------------------------------------------------------------------------


@program
def runs_through_colors(service):
    leds = service("ALLeds")
    leds.fadeListRGB("FaceLeds", [0xFF0000, 0x00FF00, 0x0000FF], [0.3, 0.6, 0.9])
    leds.reset("AllLeds")


@program
def makes_a_group_of_lamps(service):
    leds = service("ALLeds")
    leds.createGroup("Mine", ["ChestLeds", "LeftFootLeds"])
    leds.fade("Mine", 1.0, 0.2)


# -- memory and senses ---------------------------------------------------------------------------------------------


@program
def reads_its_feet_battery_and_temperatures(service):
    memory = service("ALMemory")
    keys = ["LFoot/FSR/TotalWeight/Sensor/Value", "Battery/Charge/Sensor/Value"]
    assert None not in memory.getListData([DEVICES + key for key in keys])
    assert memory.getData(f"{DEVICES}HeadYaw/Temperature/Sensor/Value") > 0
    assert 0 <= service("ALBattery").getBatteryCharge() <= 100


# -- sight ---------------------------------------------------------------------------------------------------------


@program
def takes_a_picture(service):
    video = service("ALVideoDevice")
    handle = video.subscribeCamera("snapshot", 0, 2, 11, 5)
    width, height, layers, *_ = picture = video.getImageRemote(handle)
    assert len(picture[6]) == width * height * layers == 640 * 480 * 3
    video.releaseImage(handle)
    video.unsubscribe(handle)


@program
@upright
def tracks_a_red_ball(service):
    tracker, motion = service("ALTracker"), service("ALMotion")
    tracker.registerTarget("RedBall", 0.06)
    tracker.setMode("Head")
    tracker.track("RedBall")
    position = []
    for _ in range(100):
        motion.wait(motion.pCall(["angleInterpolation", "LElbowYaw", -0.8, 0.2, True]), 0)
        if not tracker.isTargetLost() and (position := tracker.getTargetPosition(0)):
            break
    assert tracker.getActiveTarget() == "RedBall"
    assert position[0] > 0.3
    tracker.stopTracker()
    tracker.unregisterAllTargets()


@program
@upright
def looks_for_faces_and_landmarks(service):
    memory = service("ALMemory")
    for name, key in (("ALFaceDetection", "FaceDetected"), ("ALLandMarkDetection", "LandmarkDetected")):
        detector = service(name)
        detector.subscribe("MyApp", 500, 0.0)
        assert memory.getData(key) == []
        detector.unsubscribe("MyApp")


# -- the robot itself ------------------------------------------------------------------------------------------------


@program
def tracks_a_red_ball_as_naoqi_1_does(service):
    tracker = service("ALRedBallTracker")
    tracker.startTracker()
    assert tracker.isActive()
    tracker.stopTracker()


@program
def says_who_it_is(service):
    system = service("ALSystem")
    assert system.robotName()
    assert system.systemVersion().startswith("2.")
    config = dict(zip(*service("ALMotion").getRobotConfig(), strict=True))
    assert config["Model Type"] == "naoH25"


@pytest.mark.parametrize("run", PROGRAMS, ids=lambda function: function.__name__)
def test_a_program_runs_to_its_end(run, service):
    run(service)
