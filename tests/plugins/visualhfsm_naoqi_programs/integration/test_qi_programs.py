"""Programs as people write them for NAOqi run to their end on a robot that is served as one."""

from __future__ import annotations

import math
import queue
from collections.abc import Callable
from functools import wraps
from typing import Any

import pytest

pytest.importorskip("qi")
pytest.importorskip("cv2")

from tests.support.limits import EVENT_LIMIT
from tests.support.naoqi import connected
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
            module("visualhfsm_naoqi_programs", "--qi", "tcp://127.0.0.1:0", "--faults", "--speed", "20")
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
def says_hello(service):
    service("ALTextToSpeech").say("Hello, my name is Nao")


@program
def says_something_slowly(service):
    speech = service("ALTextToSpeech")
    speech.setParameter("speed", 60)
    speech.say("\\rspd=70\\ I speak \\pau=300\\ slowly")
    speech.resetSpeed()


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
def speaks_while_it_moves(service):
    speech, motion = service("ALTextToSpeech"), service("ALMotion")
    task = speech.pCall(["say", "I can speak and move at the same time"])
    motion.angleInterpolation("HeadYaw", [0.5, -0.5, 0.0], [0.5, 1.0, 1.5], True)
    speech.wait(task, 0)
    assert not speech.isRunning(task)


@program
def stops_talking(service):
    speech = service("ALTextToSpeech")
    task = speech.pCall(["say", "a story without an end " * 40])
    speech.stopAll()
    assert not speech.wait(task, 5000)


@program
def turns_the_volume_down_and_up(service):
    device = service("ALAudioDevice")
    before = device.getOutputVolume()
    device.setOutputVolume(30)
    assert device.getOutputVolume() == 30
    device.setOutputVolume(before)


@program
def plays_a_song(service):
    service("ALAudioPlayer").playFile("/home/nao/song.wav")


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
def listens_for_words_as_a_box_of_choregraphe_does(service):
    recognition, memory = service("ALSpeechRecognition"), service("ALMemory")
    recognition.pushContexts()
    recognition.setVocabulary(["yes", "no"], True)
    memory.subscribeToEvent("WordRecognized", "Box", "onWordRecognized")
    assert service("Faults").say("Oh yes") == "yes"
    memory.unsubscribeToEvent("WordRecognized", "Box")
    recognition.popContexts()
    assert service("Faults").say("Oh yes") == ""


@program
def asks_for_a_dialogue_and_goes_on_without(service):
    with pytest.raises(RuntimeError, match="holds no dialogues"):
        service("ALDialog").loadTopic("/home/nao/greeting.top")


@program
def waits_for_a_word(service):
    recognition, memory = service("ALSpeechRecognition"), service("ALMemory")
    recognition.setLanguage("English")
    recognition.setVocabulary(["yes", "no"], False)
    recognition.subscribe("program")
    word, _ = memory.getData("WordRecognized")
    assert word == ""
    service("Faults").say("Yes.")
    word, confidence = memory.getData("WordRecognized")
    assert (word, confidence > 0.5) == ("yes", True)
    recognition.unsubscribe("program")


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


@program
def turns_its_head_to_a_place_in_the_picture(service):
    video, motion = service("ALVideoDevice"), service("ALMotion")
    width, height = video.getHorizontalAperture(0), video.getVerticalAperture(0)
    assert video.getAngularPositionFromImagePosition(0, [0.0, 1.0]) == pytest.approx([width / 2, height / 2])
    yaw, pitch = video.getAngularPositionFromImagePosition(0, [0.25, 0.6])
    motion.angleInterpolation(["HeadYaw", "HeadPitch"], [yaw, pitch], [0.4, 0.4], False)
    x, y = video.getImagePositionFromAngularPosition(0, [yaw, pitch])
    assert [x, y] == pytest.approx([0.25, 0.6])
    size = video.getAngularSizeFromImageSize(0, [0.2, 0.1])
    assert video.getImageSizeFromAngularSize(0, size) == pytest.approx([0.2, 0.1])
    face = [yaw, pitch, *size]
    assert video.getImageInfoFromAngularInfo(0, face) == pytest.approx([0.25, 0.6, 0.2, 0.1])
    pixels = video.getImageInfoFromAngularInfoWithResolution(0, face, 1)
    assert pixels == pytest.approx([80.0, 144.0, 64.0, 24.0])


# -- joints --------------------------------------------------------------------------------------------------


@program
def nods(service):
    times = [0.4, 0.8, 1.2, 1.6]
    service("ALMotion").angleInterpolation("HeadPitch", [0.3, -0.1, 0.3, 0.0], times, True)


@program
def shakes_its_head(service):
    motion = service("ALMotion")
    for yaw in (0.5, -0.5, 0.0):
        motion.angleInterpolationWithSpeed("HeadYaw", yaw, 0.6)
    until(lambda: abs(motion.getAngles("HeadYaw", True)[0]) < 0.05)  # the joint lags behind its setpoint


@program
def looks_around(service):
    motion = service("ALMotion")
    motion.setAngles(["HeadYaw", "HeadPitch"], [0.8, -0.2], 0.3)
    motion.changeAngles("HeadYaw", -0.4, 0.3)


@program
def waves(service):
    motion = service("ALMotion")
    names = ["RShoulderPitch", "RShoulderRoll", "RElbowRoll"]
    angles = [[-1.0, -1.0, 1.4], [-0.3, -0.6, -0.1], [1.0, 0.3, 0.5]]
    motion.angleInterpolation(names, angles, [[1.0, 2.0, 3.0]] * 3, True)


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
def lets_an_arm_hang_and_holds_it_again(service):
    motion = service("ALMotion")
    motion.setStiffnesses("LArm", 0.0)
    assert max(motion.getStiffnesses("LArm")) == 0.0
    motion.stiffnessInterpolation("LArm", 1.0, 0.5)
    assert min(motion.getStiffnesses("LArm")) == 1.0


@program
def stiffens_several_chains(service):
    service("ALMotion").stiffnessInterpolation(["Head", "LArm"], [[1.0], [1.0]], [[0.2], [0.2]])


@program
def lists_the_limits_of_its_joints(service):
    motion = service("ALMotion")
    names = motion.getBodyNames("Body")
    limits = motion.getLimits("Body")
    assert len(names) == len(limits) == 26
    assert all(low < high for low, high, *_ in limits)


@program
def copies_one_arm_to_the_other(service):
    motion = service("ALMotion")
    left = motion.getAngles("LArm", True)
    mirrored = [left[0], -left[1], -left[2], -left[3], -left[4], left[5]]
    motion.setAngles("RArm", mirrored, 0.2)


@program
def moves_both_arms_in_the_background(service):
    motion = service("ALMotion")
    tasks = [motion.pCall(["angleInterpolation", f"{side}ElbowRoll", sign * -0.8, 1.0, True])
             for side, sign in (("L", 1), ("R", -1))]  # fmt: skip
    assert not any(motion.wait(task, 0) for task in tasks)


@program
def kills_what_it_began(service):
    motion = service("ALMotion")
    motion.pCall(["angleInterpolation", "HeadYaw", 1.0, 20.0, True])
    for name, number, *_ in motion.getTaskList():
        assert name
        motion.killTask(number)


@program
def prints_a_summary(service):
    assert "HeadYaw" in service("ALMotion").getSummary()


# -- postures and behaviors ------------------------------------------------------------------------------------


@program
def stands_up_and_rests(service):
    motion = service("ALMotion")
    motion.wakeUp()
    assert motion.robotIsWakeUp()
    motion.rest()
    assert not motion.robotIsWakeUp()


@program
def goes_through_postures(service):
    posture = service("ALRobotPosture")
    posture.setMaxTryNumber(3)
    for name in ("StandInit", "StandZero", "Crouch", "Stand"):
        assert posture.goToPosture(name, 1.0)
        assert posture.getPosture() == name


@program
def stands_only_if_it_does_not(service):
    posture = service("ALRobotPosture")
    if posture.getPostureFamily() != "Standing":
        posture.goToPosture("Stand", 0.8)
    assert "Stand" in posture.getPostureList()


@program
@upright
def runs_a_behavior(service):
    manager = service("ALBehaviorManager")
    if manager.isBehaviorInstalled("wave") and not manager.isBehaviorRunning("wave"):
        manager.runBehavior("wave")
    assert manager.getRunningBehaviors() == []


@program
@upright
def runs_an_animation(service):
    animations = [each for each in service("ALBehaviorManager").getInstalledBehaviors() if "Yes" in each]
    service("ALAnimationPlayer").run(animations[0])
    future = service("ALAnimationPlayer").run("animations/Stand/Gestures/Explain_10", _async=True)
    future.cancel()


@program
@upright
def starts_and_stops_a_behavior(service):
    manager = service("ALBehaviorManager")
    manager.startBehavior("wave")
    manager.stopBehavior("wave")
    manager.stopAllBehaviors()


@program
def keeps_its_default_behaviors(service):
    manager = service("ALBehaviorManager")
    before = manager.getDefaultBehaviors()
    manager.addDefaultBehavior("wave")
    assert "wave" in manager.getDefaultBehaviors()
    manager.setDefaultBehaviors(before)


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
def turns_round(service):
    motion = service("ALMotion")
    before = motion.getRobotPosition(False)[2]
    motion.moveTo(0.0, 0.0, math.pi / 2)
    turned = math.remainder(motion.getRobotPosition(False)[2] - before, math.tau)
    assert turned == pytest.approx(math.pi / 2, abs=0.1)


@program
@upright
def walks_through_several_places(service):
    assert service("ALMotion").moveTo([[0.1, 0.0, 0.0], [0.1, 0.1, 0.5]])


@program
@upright
def walks_until_it_is_stopped(service):
    motion = service("ALMotion")
    motion.moveToward(1.0, 0.0, 0.0)
    assert motion.moveIsActive()
    motion.stopMove()
    motion.waitUntilMoveIsFinished()
    assert not motion.moveIsActive()


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
def walks_a_square(service):
    motion = service("ALMotion")
    for _ in range(4):
        motion.moveTo(0.1, 0.0, 0.0)
        motion.moveTo(0.0, 0.0, math.pi / 2)


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
@upright
def moves_its_hips_in_a_circle(service):
    motion = service("ALMotion")
    start = motion.getPosition("Torso", 2, False)
    path = [[start[0] + 0.01 * math.cos(a), start[1] + 0.01 * math.sin(a), *start[2:]] for a in range(4)]
    motion.positionInterpolations(["Torso"], 2, [path], [7], [[1.0, 2.0, 3.0, 4.0]])


@program
@upright
def looks_at_where_its_hand_is(service):
    motion, tracker = service("ALMotion"), service("ALTracker")
    tracker.lookAt(motion.getPosition("LArm", 0, True)[:3], 0, 0.3, False)


@program
def knows_its_center_of_mass(service):
    motion = service("ALMotion")
    assert motion.getMass("Body") > 5.0
    assert len(motion.getCOM("Body", 0, False)) == 3


@program
def switches_whole_body_balance_on_and_off(service):
    motion = service("ALMotion")
    motion.wbEnable(True)
    motion.wbFootState("Fixed", "Legs")
    motion.wbEnableBalanceConstraint(True, "Legs")
    motion.wbEnable(False)


@program
def switches_reflexes(service):
    motion = service("ALMotion")
    motion.setFallManagerEnabled(True)
    motion.setCollisionProtectionEnabled("Arms", True)
    motion.setBreathEnabled("Body", False)
    assert motion.getFallManagerEnabled()


# -- lights ------------------------------------------------------------------------------------------------------


@program
def makes_its_eyes_red(service):
    service("ALLeds").fadeRGB("FaceLeds", 0x00FF0000, 0.5)


@program
def blinks(service):
    leds = service("ALLeds")
    for _ in range(2):
        leds.off("FaceLeds")
        leds.on("FaceLeds")


@program
def runs_through_colors(service):
    leds = service("ALLeds")
    leds.fadeListRGB("FaceLeds", [0xFF0000, 0x00FF00, 0x0000FF], [0.3, 0.6, 0.9])
    leds.reset("AllLeds")


@program
def lights_the_lamps_of_an_eye(service):
    leds = service("ALLeds")
    for lamp in range(8):
        leds.setIntensity(f"FaceLed{lamp}", 0.5)
    leds.reset("FaceLeds")


@program
def makes_a_group_of_lamps(service):
    leds = service("ALLeds")
    leds.createGroup("Mine", ["ChestLeds", "LeftFootLeds"])
    leds.fade("Mine", 1.0, 0.2)


# -- memory and senses ---------------------------------------------------------------------------------------------


@program
def reads_its_inertial_unit(service):
    memory = service("ALMemory")
    unit = f"{DEVICES}InertialSensor"
    assert memory.getData(f"{unit}/AccelerometerZ/Sensor/Value") < -9.0
    assert len(memory.getListData([f"{unit}/Angle{axis}/Sensor/Value" for axis in "XY"])) == 2


@program
def reads_its_feet_battery_and_temperatures(service):
    memory = service("ALMemory")
    keys = ["LFoot/FSR/TotalWeight/Sensor/Value", "Battery/Charge/Sensor/Value"]
    assert None not in memory.getListData([DEVICES + key for key in keys])
    assert memory.getData(f"{DEVICES}HeadYaw/Temperature/Sensor/Value") > 0
    assert 0 <= service("ALBattery").getBatteryCharge() <= 100


@program
def keeps_a_value(service):
    memory = service("ALMemory")
    memory.insertData("MyApp/count", 3)
    assert memory.getData("MyApp/count") == 3
    memory.removeData("MyApp/count")
    assert "MyApp/count" not in memory.getDataList("MyApp")


@program
def measures_distances(service):
    sonar, memory = service("ALSonar"), service("ALMemory")
    sonar.subscribe("MyApp")
    assert memory.getData(f"{DEVICES}US/Left/Sensor/Value") > 0.0
    sonar.unsubscribe("MyApp")


@program
def waits_until_its_head_is_touched(service):
    heard: queue.Queue[float] = queue.Queue()
    subscriber = service("ALMemory").subscriber("FrontTactilTouched")
    subscriber.signal.connect(heard.put)
    service("Faults").touch(["HeadFront"])
    assert heard.get(timeout=EVENT_LIMIT) == 1.0
    service("ALTextToSpeech").say("Ouch")


@program
def asks_which_sensors_are_touched(service):
    service("Faults").touch(["LHandBack", "RFootBumperLeft"])
    touched = [name for name, state, _ in service("ALTouch").getStatus() if state]
    assert touched == ["LHand/Touch/Back", "RFoot/Bumper/Left"]


@program
def reacts_to_an_event_of_its_own(service):
    heard: queue.Queue[str] = queue.Queue()
    memory = service("ALMemory")
    subscriber = memory.subscriber("MyApp/start")
    subscriber.signal.connect(heard.put)
    memory.raiseEvent("MyApp/start", "now")
    assert heard.get(timeout=EVENT_LIMIT) == "now"


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
def takes_photos(service):
    photos = service("ALPhotoCapture")
    photos.setResolution(2)
    photos.setPictureFormat("jpg")
    photos.setCaptureInterval(10)
    assert photos.takePictures(3, "/home/nao/recordings/cameras/", "image") == [
        [f"/home/nao/recordings/cameras/image_{i}.jpg" for i in range(3)]
    ]


@program
def switches_between_its_cameras(service):
    video = service("ALVideoDevice")
    handle = video.subscribe("old", 1, 13, 10)
    video.setParam(18, 1)
    assert video.getImageRemote(handle)[7] == 1
    video.setParam(18, 0)
    video.unsubscribe(handle)


@program
def makes_the_picture_brighter(service):
    video = service("ALVideoDevice")
    video.setParameter(0, 0, 60)
    video.setParameter(0, 11, 0)
    video.setAllParametersToDefault(0)


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
def feels_whether_it_holds_something(service):
    current = service("ALMemory").getData(f"{DEVICES}RHand/ElectricCurrent/Sensor/Value")
    assert current >= 0.0


@program
def lists_what_a_service_can_do(service):
    motion = service("ALMotion")
    for name in motion.getMethodList()[:5]:
        assert motion.getMethodHelp(name)[0] == name


@program
def says_who_it_is(service):
    system = service("ALSystem")
    assert system.robotName()
    assert system.systemVersion().startswith("2.")
    config = dict(zip(*service("ALMotion").getRobotConfig(), strict=True))
    assert config["Model Type"] == "naoH25"


@program
def asks_every_service_whether_it_is_there(service):
    for name in ("ALMotion", "ALMemory", "ALTextToSpeech", "ALLeds", "ALTabletService"):
        assert service(name).ping()


def test_there_are_sixty_of_them():
    assert len(PROGRAMS) >= 60


@pytest.mark.parametrize("run", PROGRAMS, ids=lambda function: function.__name__)
def test_a_program_runs_to_its_end(run, service):
    run(service)
