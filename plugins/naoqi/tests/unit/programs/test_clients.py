"""What a client commands ends with it, what is stopped does not begin, and nobody takes another's room."""

import threading

import pytest

pytest.importorskip("qi")

from naoserver.errors import CommandRefused, InvalidCommand
from plugins.naoqi.tests.support.rig import LongCall
from tests.support.robot_server import eventually
from visualhfsm_naoqi.programs._behaviors import ALBehaviorManager
from visualhfsm_naoqi.programs._clients import Call, Client, running
from visualhfsm_naoqi.programs._memory import MOST_CALLBACKS, MOST_KEYS, MOST_LEFT
from visualhfsm_naoqi.programs._sensors import ALSonar
from visualhfsm_naoqi.programs._sound import ALAudioPlayer, ALAudioRecorder
from visualhfsm_naoqi.programs._speech import ALTextToSpeech
from visualhfsm_naoqi.programs._tracker import ALTracker
from visualhfsm_naoqi.programs._video import MOST_SUBSCRIPTIONS, ALVideoDevice
from visualhfsm_naoqi.programs._vision import ALRedBallDetection

POSE = ("HeadYaw", 0.8, 1.0, True)


@pytest.fixture
def ada():
    return Client("Ada")


@pytest.fixture
def bob():
    return Client("Bob")


def by(rig, client, operation, *arguments):
    """Perform a short operation for a client."""
    with running(rig.arrive(operation, *arguments, client=client)):
        return operation(*arguments)


def motions(rig):
    """Return the operations that move the robot, with arguments."""
    behaviors = rig.access.service(ALBehaviorManager)
    return {
        "an interpolation": (rig.motion.angleInterpolation, *POSE),
        "a walk to a place": (rig.motion.moveTo, 0.3, 0.0, 0.0),
        "a posture": (rig.postures.goToPosture, "Crouch", 0.8),
        "rest": (rig.motion.rest,),
        "wakeUp": (rig.motion.wakeUp,),
        "a behavior": (behaviors.runBehavior, "wave"),
    }


KINDS = ["an interpolation", "a walk to a place", "a posture", "rest", "wakeUp", "a behavior"]


def is_still(rig):
    """Return whether the robot holds still, and stays stiff, for a second."""
    before = rig.robot.read()
    rig.advance(1.0)
    after = rig.robot.read()
    return (before.commands, before.stiffnesses) == (after.commands, after.stiffnesses)


# -- a stop ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", KINDS)
def test_kill_all_also_ends_what_no_thread_has_taken_yet(rig, kind):
    operation, *arguments = motions(rig)[kind]
    waiting = rig.arrive(operation, *arguments)
    rig.motion.killAll()
    call = LongCall(waiting, operation, *arguments)
    call.join()
    assert is_still(rig)


@pytest.mark.parametrize("kind", KINDS)
def test_what_waited_at_an_emergency_stop_does_not_begin_after_the_reset(rig, kind):
    operation, *arguments = motions(rig)[kind]
    waiting = rig.arrive(operation, *arguments)
    rig.assembly.gate.stop("the button was pressed")
    rig.assembly.gate.reset()
    call = LongCall(waiting, operation, *arguments)
    call.join()
    assert is_still(rig)


@pytest.mark.parametrize("kind", KINDS)
def test_who_commands_on_beside_a_stop_is_refused_after_its_reset(rig, ada, bob, kind):
    operation, *arguments = motions(rig)[kind]
    rig.motion.move(0.1, 0.0, 0.0)
    rig.assembly.gate.stop("the button was pressed")
    call = LongCall(rig.arrive(operation, *arguments, client=ada), operation, *arguments)
    call.join()
    assert "the button was pressed" in str(call.error)
    rig.assembly.gate.reset()
    with pytest.raises(CommandRefused, match="ended the commands of Ada"):
        by(rig, ada, rig.motion.setAngles, "HeadYaw", 0.3, 0.5)
    by(rig, bob, rig.motion.setAngles, "HeadYaw", 0.3, 0.5)


def test_a_tracker_that_began_beside_a_stop_ends_at_the_reset(rig, ada):
    tracker = rig.access.service(ALTracker)
    rig.assembly.gate.stop("the button was pressed")
    by(rig, ada, tracker.track, "RedBall")
    rig.assembly.gate.reset()
    tracker._follow()
    assert not tracker.isActive()


@pytest.mark.parametrize(
    ("stop", "stopped"),
    [
        (lambda rig: rig.motion.stopMove(), "a walk to a place"),
        (lambda rig: rig.postures.stopMove(), "a posture"),
        (lambda rig: rig.motion.killTasksUsingResources("Head"), "an interpolation"),
        (lambda rig: rig.access.service(ALBehaviorManager).stopBehavior("wave"), "a behavior"),
    ],
)
def test_a_stop_of_one_kind_ends_only_calls_of_this_kind(rig, stop, stopped):
    calls = {
        kind: rig.arrive(*motions(rig)[kind]) for kind in ("an interpolation", *KINDS[1:3], "a behavior")
    }
    stop(rig)
    assert [kind for kind, call in calls.items() if call.stopped.is_set()] == [stopped]


def test_no_stop_slips_in_between_a_calls_check_and_its_beginning(rig):
    stop = threading.Thread(target=rig.motion.stopMove, name="stop")
    with rig.access.calls.beginning() as may:
        assert may
        stop.start()
        stop.join(0.1)  # it must not end
        rig.motion.move(0.1, 0.0, 0.0)
    stop.join()
    assert not rig.motion.moveIsActive()


# -- the end of a client ---------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", KINDS[:2])
def test_a_lost_clients_motion_ends(rig, ada, kind):
    operation, *arguments = motions(rig)[kind]
    call = rig.begin(operation, *arguments, client=ada)
    rig.advance(0.5)
    rig.access.lose(ada)
    rig.advance(0.9)
    call.join()
    assert is_still(rig)


@pytest.mark.parametrize("kind", ["a posture", "rest", "wakeUp"])
def test_a_lost_clients_way_to_a_posture_ends_in_a_crouch_and_it_stays_stiff(rig, ada, kind):
    rig.complete(rig.postures.goToPosture, "StandInit", 1.0)
    operation, *arguments = motions(rig)[kind]
    call = rig.begin(operation, *arguments, client=ada)
    rig.access.lose(ada)
    rig.advance(0.1)
    call.join()
    rig.advance(10.0)
    assert rig.postures.getPosture() == "Crouch"
    assert rig.motion.robotIsWakeUp()
    assert is_still(rig)


@pytest.mark.parametrize("kind", KINDS)
def test_a_call_of_a_lost_client_begins_nothing(rig, ada, kind):
    operation, *arguments = motions(rig)[kind]
    rig.access.lose(ada)
    call = rig.begin(operation, *arguments, client=ada)
    call.join()
    assert is_still(rig)


def test_a_short_call_of_a_lost_client_begins_nothing(rig, ada):
    rig.access.lose(ada)
    by(rig, ada, rig.motion.setAngles, "HeadYaw", 1.0, 0.1)
    by(rig, ada, rig.motion.setStiffnesses, "Body", 0.0)
    by(rig, ada, rig.motion.move, 0.1, 0.0, 0.0)
    by(rig, ada, rig.access.service(ALBehaviorManager).startBehavior, "wave")
    assert is_still(rig)
    assert not rig.walking.active


def test_a_walk_that_nobody_waits_for_ends_with_its_client(rig, ada):
    by(rig, ada, rig.motion.move, 0.1, 0.0, 0.0)
    rig.advance(1.0)
    rig.access.lose(ada)
    rig.walking.renew()
    assert not rig.walking.active


def test_a_lost_clients_joints_hold_where_they_are_and_anothers_go_on(rig, ada, bob):
    by(rig, ada, rig.motion.setAngles, "HeadYaw", 1.0, 0.1)
    by(rig, bob, rig.motion.setAngles, "HeadPitch", 0.3, 0.1)
    rig.advance(0.2)
    rig.access.lose(ada)
    rig.advance(0.1)
    held = rig.motion.getAngles("HeadYaw", False)
    rig.advance(3.0)
    assert rig.motion.getAngles("Head", False) == pytest.approx([*held, 0.3])
    assert 0.0 < held[0] < 0.5


def test_what_another_client_commanded_instead_goes_on(rig, ada, bob):
    call = rig.begin(rig.motion.moveTo, 1.0, 0.0, 0.0, client=ada)
    rig.advance(0.5)
    by(rig, bob, rig.motion.move, 0.05, 0.0, 0.0)
    rig.advance(0.2)
    call.join()
    rig.access.lose(ada)
    rig.walking.renew()
    assert rig.motion.getRobotVelocity() == pytest.approx([0.05, 0.0, 0.0])


def test_a_lost_client_is_followed_by_no_head(rig, ada):
    tracker, detector = rig.access.service(ALTracker), rig.access.service(ALRedBallDetection)
    with running(Call(rig.clock, ada)):
        tracker.track("RedBall")
    detector._look()
    rig.access.lose(ada)
    tracker._follow()
    assert not tracker.isActive()
    assert not detector.getSubscribersInfo()
    assert is_still(rig)


def test_what_a_lost_client_was_saying_and_playing_ends(rig, ada):
    speech, player = rig.access.service(ALTextToSpeech), rig.access.service(ALAudioPlayer)
    saying = rig.begin(speech.say, "a long text " * 20, client=ada)
    playing = rig.begin(player.playFileInLoop, "/none.wav", client=ada)
    by(rig, ada, player.loadFile, "/other.wav")
    rig.access.lose(ada)
    rig.advance(0.2)
    saying.join()
    playing.join()
    assert not rig.robot.voice.utterance().speaking
    assert player.getLoadedFilesIds() == []


def test_a_lost_clients_recording_ends(rig, ada, tmp_path):
    rig.access.disk = tmp_path
    recorder = rig.access.service(ALAudioRecorder)
    by(rig, ada, recorder.startMicrophonesRecording, "/a.wav")
    rig.access.lose(ada)
    recorder.startMicrophonesRecording("/b.wav")


def test_a_lost_clients_subscriptions_end(rig, ada, bob):
    video, sonar = rig.access.service(ALVideoDevice), rig.access.service(ALSonar)
    handles = {who: by(rig, who, video.subscribeCamera, "me", 0, 1, 11, 10) for who in (ada, bob)}
    by(rig, ada, sonar.subscribe, "me")
    rig.access.lose(ada)
    assert video.getSubscribers() == [handles[bob]]
    assert sonar.getSubscribersInfo() == []


# -- the room of a client --------------------------------------------------------------------------------


def test_the_keys_of_one_client_leave_room_for_those_of_others_and_of_the_services(rig, memory, ada, bob):
    for i in range(MOST_KEYS):
        by(rig, ada, memory.insertData, f"key {i}", i)
    with pytest.raises(InvalidCommand, match="this program has 250 keys already: remove some"):
        by(rig, ada, memory.insertData, "one more", 1)
    by(rig, ada, memory.insertData, "key 0", "new")
    by(rig, bob, memory.insertData, "one more", 1)
    rig.complete(rig.access.service(ALTextToSpeech).say, "Hello")
    assert memory.getListData(["key 0", "one more", "ALTextToSpeech/TextDone"]) == ["new", 1, 1]


def test_the_keys_of_lost_clients_stay_until_there_are_too_many(rig, memory):
    names = "abcde"[: MOST_LEFT // MOST_KEYS + 1]
    keys = [f"{name} {i}" for name in names for i in range(MOST_KEYS)][: MOST_LEFT + 1]
    for name in names:
        client = Client(name)
        for key in keys:
            if key.startswith(name):
                by(rig, client, memory.insertData, key, key)
        rig.access.lose(client)
    assert memory.getListData(keys[:2]) == [None, keys[1]]
    assert memory.getListData(keys[-2:]) == keys[-2:]
    memory.removeData(keys[1])
    assert [key for key in memory.getDataListName() if key[1:2] == " "] == sorted(keys[2:])


def test_the_callbacks_of_a_client_are_few_and_end_with_it(rig, memory, ada, bob):
    called: list[str] = []

    def find(module: str) -> NeverFound:
        called.append(module)
        return NeverFound()

    rig.access.find = find
    for i in range(MOST_CALLBACKS):
        by(rig, ada, memory.subscribeToEvent, "Mine", f"Module{i}", "onEvent")
    with pytest.raises(InvalidCommand, match="this program has 100 callbacks already"):
        by(rig, ada, memory.subscribeToEvent, "Mine", "One more", "onEvent")
    by(rig, bob, memory.subscribeToEvent, "Mine", "Bob's", "onEvent")
    rig.access.lose(ada)
    memory.raiseEvent("Mine", 1)
    eventually(lambda: called == ["Bob's"])


class NeverFound:
    """A service that is looked up, and not found before the end of the test."""

    def addCallback(self, _callback):
        """Forget it."""


def test_the_subscribers_of_a_client_are_few_and_end_with_it(rig, memory, ada, bob):
    for i in range(MOST_KEYS):
        by(rig, ada, memory.subscriber, f"key {i}")
    with pytest.raises(InvalidCommand, match="this program has 250 keys to which it listens already"):
        by(rig, ada, memory.subscriber, "one more")
    shared = by(rig, bob, memory.subscriber, "key 0")
    own = by(rig, ada, memory.subscriber, "key 1")
    rig.access.lose(ada)
    assert by(rig, bob, memory.subscriber, "key 0") is shared
    assert by(rig, bob, memory.subscriber, "key 1") is not own


def test_the_subscriptions_of_one_client_leave_others_pictures(rig, ada, bob):
    video = rig.access.service(ALVideoDevice)
    handles = [by(rig, ada, video.subscribeCamera, f"n{i}", 0, 1, 11, 10) for i in range(MOST_SUBSCRIPTIONS)]
    assert all(handles)
    assert by(rig, ada, video.subscribeCamera, "one more", 0, 1, 11, 10) == ""
    assert by(rig, bob, video.subscribeCamera, "mine", 0, 1, 11, 10)


def test_a_file_is_not_below_any_number_of_folders(rig, tmp_path):
    rig.access.disk = tmp_path
    recorder = rig.access.service(ALAudioRecorder)
    recorder.startMicrophonesRecording("d/" * 16 + "a.wav")
    recorder.stopMicrophonesRecording()
    with pytest.raises(InvalidCommand, match="at most 16 folders"):
        recorder.startMicrophonesRecording("d/" * 17 + "a.wav")
