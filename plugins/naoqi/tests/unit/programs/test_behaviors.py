"""Motions and animations as behaviors: by name, by tag, and within a text."""

import math

import pytest

pytest.importorskip("qi")

from naoserver.errors import InvalidCommand
from tests.support.soak import repeated
from visualhfsm_naoqi.programs._animations import TAGS, AnimationRoute, find_animation, load_animations
from visualhfsm_naoqi.programs._behaviors import ALAnimationPlayer, ALBehaviorManager, ALFrameManager
from visualhfsm_naoqi.programs._clients import Client
from visualhfsm_naoqi.programs._memory import ALMemory
from visualhfsm_naoqi.programs._speech import ALAnimatedSpeech, ALTextToSpeech

HEY = "animations/Stand/Gestures/Hey_1"
NOD = "animations/Stand/Gestures/Yes_1"
LONG = "a long text " * 20


@pytest.fixture
def manager(rig):
    return rig.access.service(ALBehaviorManager)


@pytest.fixture
def speech(rig):
    return rig.access.service(ALAnimatedSpeech)


@pytest.mark.sim
def test_an_animation_ends_where_it_began_and_the_robot_stands():
    from naoserver_sim.robot import SimulatedRobot
    from naoserver_sim.world import load_world
    from tests.support.motion_rig import MotionRig
    from zenoh_ice import VirtualClock

    clock = VirtualClock()
    robot = SimulatedRobot(clock=clock, skin=False, world=load_world("empty"))
    robot.start()
    rig = MotionRig(robot, clock)
    rig.go("StandInit")
    assert len(load_animations()) >= 20
    for name in repeated([HEY, NOD], soak=[*load_animations()]):
        animation = load_animations()[name]
        before = robot.read().commands
        rig.player.begin("motion", name, AnimationRoute(rig.player.body, animation))
        rig.finish()
        assert robot.read().commands == pytest.approx(before, abs=0.01), name
        assert robot.state().torso_tilt < math.radians(10), name
    assert not [event for event in rig.assembly.events.snapshot()[0] if "limited" in event.message]
    robot.close()


def test_an_animation_runs_by_its_name(rig, manager):
    call = rig.begin(manager.runBehavior, HEY)
    rig.advance(1.2)
    assert manager.getRunningBehaviors() == [HEY]
    assert rig.positions("RShoulderPitch")[0] == pytest.approx(-1.0, abs=0.05)
    rig.advance(5.0)
    call.join()
    assert manager.getRunningBehaviors() == []


def test_other_variants_are_played_as_one_that_is_there(manager):
    assert manager.isBehaviorInstalled("animations/Stand/Gestures/Explain_7")
    manager.startBehavior("animations/Stand/Gestures/Hey_4")
    assert manager.isBehaviorRunning("animations/Stand/Gestures/Hey_4")
    assert manager.getRunningBehaviors() == [HEY]
    manager.stopBehavior("animations/Stand/Gestures/Hey_3")
    assert manager.getRunningBehaviors() == []


@pytest.mark.parametrize(
    "name", ["animations/Stand/Gestures/Fly_1", "animations/Sit/Gestures/Hey_1", "Hey_1"]
)
def test_animations_that_are_not_there(manager, name):
    assert not manager.isBehaviorInstalled(name)
    with pytest.raises(InvalidCommand, match=r"no behavior .*; there are .*Hey_1"):
        manager.startBehavior(name)


def test_installed_behaviors_can_all_be_found(manager):
    assert {"wave", HEY} <= set(manager.getInstalledBehaviors())
    assert all(map(manager.isBehaviorInstalled, manager.getInstalledBehaviors()))


def test_a_behavior_is_loaded_and_knows_its_tags(manager):
    assert manager.preloadBehavior(HEY)
    assert "hello" in manager.getBehaviorTags(HEY)
    assert set(manager.getBehaviorTags(HEY)) < set(manager.getTagList())
    with pytest.raises(InvalidCommand, match="no behavior"):
        manager.preloadBehavior("Fly")


def test_a_robot_that_sits_is_not_animated(rig, manager):
    rig.complete(rig.postures.goToPosture, "Sit", 1.0)
    with pytest.raises(InvalidCommand, match="needs a robot that stands, and it is sitting"):
        manager.startBehavior(HEY)


def test_a_tag_means_an_animation(rig, manager):
    assert all(find_animation(name) for name in TAGS.values())
    call = rig.begin(rig.access.service(ALAnimationPlayer).runTag, "hello")
    assert manager.getRunningBehaviors() == [HEY]
    manager.stopAllBehaviors()
    rig.advance(0.2)
    call.join()


def test_the_frame_manager_runs_behaviors_too(rig, manager):
    frames = rig.access.service(ALFrameManager)
    behavior = frames.newBehaviorFromFile(f"/home/nao/{NOD}/behavior.xar", "behavior_1")
    assert behavior == NOD
    assert frames.getBehaviorPath(behavior).endswith(f"/{NOD}/")
    assert rig.complete(frames.completeBehavior, behavior) == pytest.approx(
        frames.getMotionLength(behavior), abs=1.0
    )
    frames.playBehavior(behavior)
    assert frames.behaviors() == [NOD]
    frames.exitBehavior(behavior)
    assert not frames.isBehaviorRunning(behavior)
    with pytest.raises(InvalidCommand, match="boxes and timelines are not played here"):
        frames.newBehaviorFromFile("/home/nao/mine/behavior.xar", "")
    with pytest.raises(InvalidCommand, match="boxes and timelines are not played here"):
        frames.createTimeline("<Timeline/>")


# -- within a text ---------------------------------------------------------------------------------------


def said(rig):
    return rig.robot.voice.utterance().text


def test_a_text_starts_an_animation_and_goes_on_meanwhile(rig, manager, speech):
    call = rig.begin(speech.say, f"^start({HEY}) {LONG}")
    rig.advance(0.2)
    assert manager.getRunningBehaviors() == [HEY]
    assert rig.robot.voice.utterance().speaking
    rig.advance(60.0)
    call.join()
    assert said(rig) == LONG.strip()
    assert rig.access.service(ALMemory).getData("ALAnimatedSpeech/EndOfAnimatedSpeech") is True


@pytest.mark.parametrize("text", [f"^start({NOD}) ^wait({NOD}) Now", f"^run({NOD}) Now", "^runTag(yes) Now"])
def test_a_text_waits_for_an_animation(rig, speech, text):
    assert rig.complete(speech.say, text) > load_animations()[NOD].duration
    assert said(rig) == "Now"


def test_a_text_stops_an_animation(rig, manager, speech):
    call = rig.begin(speech.say, f"^start({HEY}) Hello ^stop({HEY}) {LONG}")
    rig.advance(2.0)
    assert manager.getRunningBehaviors() == []
    assert rig.robot.voice.utterance().speaking
    rig.advance(60.0)
    call.join()


@pytest.mark.parametrize(
    "text", ["^start(animations/Fly_1) Hello", "^runTag(fly) Hello", "^wait(never) Hello"]
)
def test_a_text_goes_on_without_an_animation_that_is_not_there(rig, speech, text):
    rig.complete(speech.say, text)
    assert said(rig) == "Hello"


def test_a_text_complains_once(rig, speech, caplog):
    rig.complete(speech.say, "^start(animations/Fly_1) " * 5 + "Hello")
    assert len([message for message in caplog.messages if "without its animation" in message]) == 1


def kill_all(rig, _call):
    rig.motion.killAll()


def stop_behaviors(rig, _call):
    rig.access.service(ALBehaviorManager).stopAllBehaviors()


def emergency_stop(rig, _call):
    rig.access.body.gate.stop("somebody")
    rig.access.body.gate.reset()


@pytest.mark.parametrize("stop", [kill_all, stop_behaviors, emergency_stop])
def test_what_stops_motion_stops_all_animations_of_a_text(rig, manager, speech, stop):
    call = rig.begin(speech.say, f"^start({HEY}) Hello ^run({NOD}) ^start({HEY}) {LONG}")
    rig.advance(0.3)
    assert manager.getRunningBehaviors() == [HEY]
    stop(rig, call)
    for _ in range(100):
        assert manager.getRunningBehaviors() == []
        rig.advance(0.2)
    call.join()
    assert call.error is None
    assert said(rig) == LONG.strip(), "the text goes on"


def stop_speech(rig, _call):
    rig.access.service(ALTextToSpeech).stopAll()


def lose_program(rig, call):
    rig.access.lose(call.call.client)


@pytest.mark.slow
@pytest.mark.parametrize("stop", [stop_speech, lose_program])
@pytest.mark.parametrize("text", [f"^start({HEY}) {LONG} ^start({NOD})", f"^run({HEY}) ^run({NOD})"])
def test_a_text_that_is_stopped_stops_its_animations(rig, manager, speech, text, stop):
    call = rig.begin(speech.say, text, client=Client("a program"))
    rig.advance(0.3)
    assert manager.getRunningBehaviors() == [HEY]
    stop(rig, call)
    rig.advance(0.5)
    call.join()
    assert manager.getRunningBehaviors() == []
