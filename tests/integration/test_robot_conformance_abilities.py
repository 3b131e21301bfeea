"""Walk, lights, voice, sounds, motions, postures and safety of every robot, with their tolerances."""

import math

import pytest

from interfaces.jderobot import (
    CommandRefusedException,
    EncodersPrx,
    InvalidValueException,
    MotorsPrx,
    Pose3DMotorsPrx,
)
from interfaces.nao import (
    ActionStatus,
    GroundTruthPrx,
    JointsPrx,
    LedColor,
    LedsPrx,
    MotionsPrx,
    PoseHeadPrx,
    PosturesPrx,
    SafetyPrx,
    ScenePrx,
    SoundsPrx,
    SpeechPrx,
    TouchPrx,
    Vector3,
    WalkPrx,
)
from naoserver.bodies.kinematics import kinematics_of
from naoserver.bodies.nao import H21
from naoserver.bodies.parts import Axis
from naoserver.moves.motion_file import load_motions
from tests.support.conformance import (
    FAMILIES,
    PATIENT,
    ROBOTS,
    in_simulation,
    pan_of,
    robots,
    simulated,
)
from tests.support.robot_server import eventually, wait_for

SPEED = 0.08
"""Forward velocity in m/s that every Nao walks at: NAOqi's walk reaches 0.095 m/s."""
POSTURE_TOLERANCE = 0.1
"""In rad, of a joint that carries the body in a posture."""
COLOR_TOLERANCE = 0.01
"""NAOqi has 256 shades."""

WITH_AN_H21 = (*robots(bodies=FAMILIES), *robots(bodies=[H21], ways=[simulated]))
"""Robots of each family, and an H21 in simulation."""

RED = LedColor(red=1.0, green=0.0, blue=0.0)


@pytest.fixture(params=ROBOTS)
def nao(request):
    """A robot that is served, and a client's session."""
    with request.param(None) as nao:
        yield nao


@pytest.fixture(params=robots(lambda body: body.walk, bodies=FAMILIES, weight=True))
def walking(request):
    """A robot that is served, whose velocities need not be renewed, and a client's session."""
    with request.param(PATIENT) as nao:
        yield nao


@pytest.fixture
def body(nao):
    return nao.proxy(JointsPrx, "Body")


def joint(nao, state, name):
    return state.positions[nao.robot.body.joint_names.index(name)]


def joint_of(nao, hinge, axis):
    return nao.robot.body.hinges[hinge][axis].joint


def ended(state):
    return state.status not in (ActionStatus.Idle, ActionStatus.Moving)


# -- the walk ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("walking", robots(lambda body: body.walk, bodies=FAMILIES), indirect=True)
def test_the_velocities_of_a_walk_are_in_si_units_limited_and_end_with_a_stop(walking):
    motors, encoders = walking.proxy(MotorsPrx, "Motors"), walking.proxy(EncodersPrx, "Encoders")

    def stands():
        return not walking.robot.walker.walking

    check_velocities_are_in_si_units_both_ways_and_limited(walking, motors)
    # A stop ends the walk in every direction.
    eventually(stands)
    start = encoders.getEncodersData()
    assert (motors.setV(SPEED), motors.setW(-0.2)) == (0, 0)
    there = wait_for(encoders.getEncodersData, lambda data: data.robottheta < start.robottheta - 0.02)
    assert math.atan2(there.robotsin, there.robotcos) == pytest.approx(there.robottheta, abs=1e-5)
    motors.stop()
    assert (motors.getV(), motors.getW(), motors.getL()) == (0.0, 0.0, 0.0)
    eventually(stands)
    check_while_it_walks_the_head_is_free_and_the_legs_are_not(walking, motors)


def check_velocities_are_in_si_units_both_ways_and_limited(walking, motors):
    limits = walking.robot.walker.limits
    sideways = min(0.04, limits.left)
    assert (motors.setV(SPEED), motors.setW(-0.2), motors.setL(sideways)) == (0, 0, 0)
    assert (motors.getV(), motors.getW(), motors.getL()) == pytest.approx((SPEED, -0.2, sideways), abs=1e-4)
    assert (motors.setV(-9.0), motors.setW(9.0), motors.setL(-9.0)) == (1, 1, 1)
    reached = (motors.getV(), motors.getW(), motors.getL())
    assert reached == pytest.approx((-limits.forward, limits.turn, -limits.left), abs=1e-3)
    assert (motors.setV(0.0), motors.setW(0.0), motors.setL(0.0)) == (0, 0, 0)


def check_while_it_walks_the_head_is_free_and_the_legs_are_not(walking, motors):
    body = walking.proxy(JointsPrx, "Body")
    moved, free_one = walking.robot.walker.joints[0], pan_of(walking.robot.body)
    motors.setV(SPEED)
    with pytest.raises(InvalidValueException, match="the walk") as refusal:
        body.setJointPositions({moved: 0.0}, 0.2)
    assert refusal.value.field == moved
    body.setJointPositions({free_one: 0.3}, 1.0)
    wait_for(body.getJointState, lambda state: abs(joint(walking, state, free_one) - 0.3) < 0.05)
    motors.setV(0.0)

    def free():
        try:
            return bool(body.setJointPositions({moved: 0.0}, 0.2))
        except InvalidValueException:
            return False

    eventually(free)


@pytest.mark.parametrize("walking", WITH_AN_H21, indirect=True)
def test_it_walks_to_a_place(walking):
    walk, encoders = walking.proxy(WalkPrx, "Walk"), walking.proxy(EncodersPrx, "Encoders")
    start = encoders.getEncodersData()
    walk.walkTo(0.15, 0.0, 0.3)
    ended = wait_for(walk.getWalkState, lambda state: state.status is not ActionStatus.Moving)
    assert (ended.status, ended.progress, ended.message) == (ActionStatus.Done, 1.0, "")
    there = encoders.getEncodersData()
    way = math.hypot(there.robotx - start.robotx, there.roboty - start.roboty)
    assert way == pytest.approx(0.15, abs=0.05)
    assert there.robottheta - start.robottheta == pytest.approx(0.3, abs=0.15)


# -- lights, voice and sounds -------------------------------------------------------------------------------


def test_lights_fade_and_a_text_is_begun_reported_and_ended(nao):
    leds = nao.proxy(LedsPrx, "Leds")
    names = leds.getLedNames()
    assert set(names) == nao.robot.body.lights.keys()
    lamp = next(name for name, facts in nao.robot.body.lights.items() if not facts.single_colored)
    leds.reset()
    before = leds.getLeds().colors
    leds.setLed(lamp, RED, 0.2)

    def shows(color):
        def does(state):
            now = state.colors[lamp]
            far = max(abs(now.red - color.red), abs(now.green - color.green), abs(now.blue - color.blue))
            return far < COLOR_TOLERANCE

        return does

    wait_for(leds.getLeds, shows(RED))
    leds.reset()  # back to what they began with
    wait_for(leds.getLeds, shows(before[lamp]))

    speech = nao.proxy(SpeechPrx, "Speech")
    count = speech.getSpeech().count
    speech.say("Hello.")
    said = wait_for(speech.getSpeech, lambda state: state.count > count)
    assert (said.text, said.count) == ("Hello.", count + 1)
    wait_for(speech.getSpeech, lambda state: not state.speaking)
    speech.say("This takes long to be said. " * 40)
    wait_for(speech.getSpeech, lambda state: state.speaking)
    speech.stop()
    wait_for(speech.getSpeech, lambda state: not state.speaking)
    with pytest.raises(InvalidValueException) as refusal:
        speech.say(" ")
    assert refusal.value.field == "text"


def test_a_sound_and_a_tone_are_begun_reported_ended_and_replaced(nao):
    sounds = nao.proxy(SoundsPrx, "Sounds")
    sounds.stop()
    wait_for(sounds.getSound, lambda state: not state.playing)
    assert "fanfare" in [facts.name for facts in sounds.getSounds()]
    count = sounds.getSound().count
    sounds.play("yes", 0.5)
    begun = wait_for(sounds.getSound, lambda state: state.count > count)
    assert (begun.name, begun.loudness, begun.count) == ("yes", 0.5, count + 1)
    assert begun.tones[0].frequency < begun.tones[1].frequency
    wait_for(sounds.getSound, lambda state: not state.playing)
    sounds.playTone(440.0, 10.0, 0.0)
    tone = wait_for(sounds.getSound, lambda state: state.playing)
    assert (tone.name, [each.frequency for each in tone.tones]) == ("tone", [440.0])
    sounds.play("beep", 0.0)  # instead
    beep = wait_for(sounds.getSound, lambda state: state.name == "beep")
    assert beep.count == tone.count + 1
    wait_for(sounds.getSound, lambda state: not state.playing)
    sounds.playTone(440.0, 10.0, 0.0)
    wait_for(sounds.getSound, lambda state: state.playing)
    sounds.stop()
    wait_for(sounds.getSound, lambda state: not state.playing)


# -- postures and motions ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "nao", robots(lambda body: "Crouch" in body.postures, bodies=FAMILIES), indirect=True
)
def test_it_goes_into_a_posture_stops_on_the_way_and_reports_it(nao, body):
    postures = nao.proxy(PosturesPrx, "Postures")
    assert set(postures.getPostures()) >= nao.robot.body.postures.keys()
    bent = joint_of(nao, "LeftKnee", Axis.TILT)
    eventually(lambda: postures.getPosture() == "StandInit")  # a robot with NAOqi is asked twice a second
    for name, fraction, field in (
        ("Handstand", 0.5, "name"),
        ("Crouch", 0.0, "fraction"),
        ("Crouch", 1.5, "fraction"),
    ):
        with pytest.raises(InvalidValueException) as refusal:
            postures.goToPosture(name, fraction)
        assert refusal.value.field == field

    knee = nao.robot.body.postures["StandInit"].angles[bent]
    postures.goToPosture("Crouch", 0.15)  # slowly: the stop is to come in time on a busy machine, too
    wait_for(body.getJointState, lambda state: abs(joint(nao, state, bent) - knee) > 0.1)
    postures.stop()
    stopped = wait_for(postures.getPostureState, ended)
    assert stopped.status in (ActionStatus.Stopped, ActionStatus.Failed)
    assert postures.getPosture() != "Crouch"

    postures.goToPosture("Crouch", 1.0)
    state = wait_for(postures.getPostureState, lambda state: state.count > stopped.count and ended(state))
    assert (state.status, state.name, state.count) == (ActionStatus.Done, "Crouch", stopped.count + 1), (
        state.message
    )
    eventually(lambda: postures.getPosture() == "Crouch")
    knee = nao.robot.body.postures["Crouch"].angles[bent]
    wait_for(body.getJointState, lambda state: abs(joint(nao, state, bent) - knee) < POSTURE_TOLERANCE)


@pytest.mark.parametrize(
    "nao",
    [
        *robots(lambda body: "wave" in load_motions(body), bodies=FAMILIES),
        *robots(bodies=[H21], ways=[simulated]),
    ],
    indirect=True,
)
def test_it_waves_and_the_motion_owns_its_joints_until_it_ends(nao, body):
    motions = nao.proxy(MotionsPrx, "Motions")
    facts = {motion.name: motion for motion in motions.getMotions()}
    assert facts.keys() == load_motions(nao.robot.body).keys()
    with pytest.raises(InvalidValueException) as refusal:
        motions.play("somersault", 1.0)
    assert refusal.value.field == "name"
    motions.play("wave", 0.5)
    wait_for(motions.getMotionState, lambda state: state.progress > 0.05)
    with pytest.raises(InvalidValueException, match="wave"):
        body.setJointPositions(dict.fromkeys(nao.robot.body.joint_names, 0.0), 0.1)
    motions.stop()
    stopped = wait_for(motions.getMotionState, ended)
    assert stopped.status == ActionStatus.Stopped
    wait_for(body.getJointState, lambda state: max(map(abs, state.velocities)) < 0.1)  # it holds them

    motions.play("wave", 2.0)
    state = wait_for(motions.getMotionState, lambda state: state.count > stopped.count and ended(state))
    assert (state.status, state.name, state.progress) == (ActionStatus.Done, "wave", 1.0), state.message
    assert body.setJointPositions({joint_of(nao, "RightShoulder", Axis.TILT): 0.0}, 0.3)


# -- safety --------------------------------------------------------------------------------------------------


def commands(nao):
    """Every way to command the robot."""
    head, body = nao.proxy(PoseHeadPrx, "Head"), nao.proxy(JointsPrx, "Body")
    neck, motors = nao.proxy(Pose3DMotorsPrx, "NeckMotors"), nao.proxy(MotorsPrx, "Motors")
    pan = pan_of(nao.robot.body)
    always = [
        lambda: head.setPose(0.1, 0.0, 0.2),
        lambda: head.setSpeed(0.1, 0.0),
        lambda: body.setJointPositions({pan: 0.1}, 0.2),
        lambda: body.setStiffnesses({pan: 0.9}, 0.0),
        lambda: neck.setPose3DMotorsData(neck.getPose3DMotorsData()),
        lambda: motors.setV(SPEED),
    ]
    if not nao.robot.body.postures:
        return always
    motions, postures = nao.proxy(MotionsPrx, "Motions"), nao.proxy(PosturesPrx, "Postures")
    return [
        *always,
        lambda: motions.play("wave", 1.0),
        lambda: postures.goToPosture("Crouch", 0.5),
    ]


@pytest.mark.parametrize("nao", robots(bodies=FAMILIES), indirect=True)
def test_a_lease_and_an_emergency_stop_refuse_every_command(nao, body):
    with nao.client() as other:
        other.proxy(SafetyPrx, "Safety").acquireLease("Ann", 60.0)
        for command in commands(nao):
            with pytest.raises(CommandRefusedException) as refusal:
                command()
            assert refusal.value.holder == "Ann"
        other.proxy(PoseHeadPrx, "Head").setPose(0.1, 0.0, 0.2)
        other.proxy(SafetyPrx, "Safety").releaseLease()
        nao.proxy(PoseHeadPrx, "Head").setPose(0.0, 0.0, 0.2)

    safety, head = nao.proxy(SafetyPrx, "Safety"), nao.proxy(PoseHeadPrx, "Head")
    head.setPose(1.0, 0.0, 0.02)
    wait_for(head.getPose, lambda pose: pose.pan > 0.1)
    safety.emergencyStop("enough")
    for command in commands(nao):
        with pytest.raises(CommandRefusedException):
            command()
    held = wait_for(body.getJointState, lambda state: max(map(abs, state.velocities)) < 0.1)
    assert joint(nao, held, pan_of(nao.robot.body)) < 0.8
    state = safety.getSafetyState()
    assert (state.stopped, state.reason) == (True, "enough")
    safety.resetEmergencyStop(True)
    assert head.setPose(0.0, 0.0, 0.5).pan == 0.0
    wait_for(head.getPose, lambda pose: abs(pose.pan) < 0.05)


# -- what only a simulation has ------------------------------------------------------------------------------


@in_simulation(bodies=FAMILIES)
def test_ground_truth_and_scene_are_there(nao):
    truth, scene = nao.proxy(GroundTruthPrx, "GroundTruth"), nao.proxy(ScenePrx, "Scene")
    body = nao.robot.body
    height = kinematics_of(body).torso_place(body.resting_angles)[2, 3]
    assert truth.getGroundTruth().torso.position.z == pytest.approx(height, abs=0.02)
    scene.placeObject("BallRed", Vector3(x=0.8, y=0.1, z=0.4))
    wait_for(truth.getGroundTruth, lambda seen: abs(seen.objects["BallRed"].position.y - 0.1) < 0.02)
    if body.touch_sensors:
        sensor = body.touch_sensors[1]
        scene.pressSensor(sensor, 5.0)
        wait_for(nao.proxy(TouchPrx, "Touch").getTouchReading, lambda reading: reading.touched == [sensor])
