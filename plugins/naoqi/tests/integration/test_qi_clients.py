"""Programs on a robot that is served as NAOqi: each by itself, over genuine libqi, also when it is killed."""

import os
import signal
import socket
import sys
import textwrap
from contextlib import ExitStack, closing, suppress

import pytest

pytest.importorskip("qi")

import qi

from naoserver.fake import FakeRobot
from naoserver.options import ServerOptions
from naoserver.protocol.jobs import JobThreads
from naoserver.serving.assembly import Assembly
from plugins.naoqi.tests.support.naoqi import connected
from tests.support.limits import CALL_LIMIT, EVENT_LIMIT, FOREVER
from tests.support.present import present
from tests.support.processes import ComponentProcess, module
from tests.support.resets import check_that_a_reset_starts_nothing
from tests.support.robot_server import clock_at, eventually
from visualhfsm_naoqi.programs import serve_as_naoqi
from visualhfsm_naoqi.programs._clients import MOST_RUNNING
from visualhfsm_naoqi.programs._connections import LARGEST_MESSAGE

VALUE = qi.FutureState.FinishedWithValue
MILLISECONDS = int(CALL_LIMIT * 1000)
SWING = "HeadYaw", [0.4, -0.4] * 50, [float(i) for i in range(1, 101)], True
PROGRAM = """
    import os, sys, qi

    session = qi.Session()
    session.connect(sys.argv[1])
    motion, player = session.service("ALMotion"), session.service("ALAudioPlayer")
    video, memory = session.service("ALVideoDevice"), session.service("ALMemory")
    recorder, touched = session.service("ALAudioRecorder"), memory.subscriber("FrontTactilTouched")
    video.subscribeCamera("killed", 0, 1, 11, 10)
    memory.insertData("Killed/Key", 1)
    recorder.startMicrophonesRecording("/killed.wav")
    swing = "HeadYaw", [0.4, -0.4] * 50, [float(i) for i in range(1, 101)], True
    calls = [motion.angleInterpolation(*swing, _async=True) for _ in range(100)]
    calls += [player.playFileInLoop(f"/{i}.wav", _async=True) for i in range(30)]
    motion.move(0.1, 0.0, 0.0)
    print("ready", flush=True)
    calls[0].wait()
"""


@pytest.fixture(scope="module")
def url():
    with ComponentProcess(
        module("visualhfsm_naoqi.programs", "--qi", "tcp://127.0.0.1:0", "--speed", "4")
    ) as process:
        yield process.wait_for(r"^ready: (\S+)")[1]


@pytest.fixture
def session(url):
    with connected(url) as session:
        yield session
        session.service("ALMotion").killAll()


@pytest.fixture
def other(url):
    """A session of another program."""
    with connected(url) as session:
        yield session


@pytest.fixture
def motion(session):
    return session.service("ALMotion")


def ended(futures):
    return all(not future.isRunning() for future in futures)


def test_a_program_that_is_killed_leaves_nothing_that_moves_plays_or_takes_room(url, session, motion):
    with ComponentProcess([sys.executable, "-c", textwrap.dedent(PROGRAM), url]) as program:
        program.wait_for(r"^ready$")
        assert motion.moveIsActive()
        eventually(lambda: motion.getTaskList() != [])
        program.process.send_signal(signal.SIGKILL)
        program.wait()
    eventually(lambda: motion.getTaskList() == [] and not motion.moveIsActive())
    at = motion.getAngles("HeadYaw", False)
    player, video = session.service("ALAudioPlayer"), session.service("ALVideoDevice")
    eventually(lambda: player.getLoadedFilesIds() == [] and video.getSubscribers() == [])
    session.service("ALTextToSpeech").say("Hello")
    assert motion.getAngles("HeadYaw", False) == at
    assert session.service("ALMemory").getData("Killed/Key") == 1
    recorder = session.service("ALAudioRecorder")
    recorder.startMicrophonesRecording("/next.wav")
    recorder.stopMicrophonesRecording()


def test_a_program_that_takes_all_its_threads_takes_none_of_another_or_of_a_stop(session, motion, other):
    player = session.service("ALAudioPlayer")
    loops = [player.playFileInLoop(f"/{i}.wav", _async=True) for i in range(MOST_RUNNING)]
    eventually(lambda: len(player.getLoadedFilesIds()) == MOST_RUNNING)
    waiting = motion.openHand("LHand", _async=True)
    assert other.service("ALRobotPosture").goToPosture("StandZero", 1.0)
    for program in (session, other):
        assert program.service("ALMotion").rest(_async=True).wait(MILLISECONDS) == VALUE
    assert waiting.isRunning()
    other.service("ALMotion").killAll()
    eventually(lambda: ended([waiting]))
    assert all(loop.isRunning() for loop in loops)
    player.stopAll()
    eventually(lambda: ended(loops))
    motion.wakeUp()


def test_a_large_message_is_refused_unread_and_the_connection_goes_on(session, motion):
    memory = session.service("ALMemory")
    with pytest.raises(
        RuntimeError, match=f"ALMemory: a message of .* bytes is too large: {LARGEST_MESSAGE} at most"
    ):
        memory.insertData("Large", "x" * LARGEST_MESSAGE)
    with pytest.raises(RuntimeError, match="too large"):
        motion.setAngles("HeadYaw", [0.0] * 100_000, 0.1)
    memory.insertData("Small", "x" * 10_000)


def test_silent_and_foreign_connections_keep_nobody_out(url):
    host, port = url.removeprefix("tcp://").split(":")
    with ExitStack() as doors:
        silent = [doors.enter_context(socket.create_connection((host, int(port)))) for _ in range(50)]
        for foreign in silent[:10]:
            foreign.sendall(os.urandom(2000))
        silent[10].sendall(b"\x42\xde\xad\x42" + b"\1\0\0\0" + b"\xff\xff\xff\x7f" + bytes(16))
        with connected(url) as session:
            assert len(session.service("ALMotion").getAngles("Body", True)) == 26
        for foreign in silent[:10]:
            foreign.settimeout(EVENT_LIMIT)
            assert foreign.recv(1) == b""


def test_a_program_cannot_use_what_was_lent_to_another(session, other):
    for program in (session, other):
        assert program.service("_Door").metaObject() is not None
        with pytest.raises(RuntimeError):
            program.service("_Door").borrow("guessed ALMotion")


def test_a_stop_is_served_while_programs_flood_the_robot(session, motion, other):
    busy = other.service("ALMotion")
    calls = [busy.getAngles("Body", True, _async=True) for _ in range(2000)]
    calls += [busy.angleInterpolation("HeadYaw", 1.0, FOREVER, True, _async=True) for _ in range(100)]
    assert motion.killAll(_async=True).wait(MILLISECONDS) == VALUE
    eventually(lambda: motion.killAll() is None and ended(calls))


def test_a_reset_starts_no_walk_of_a_program_that_commands_on():
    clock = clock_at(1.0)
    with closing(FakeRobot(clock)) as robot, closing(Assembly(robot, ServerOptions(), clock)) as assembly:
        watchdog, *_ = assembly.jobs
        with (
            JobThreads([watchdog]),
            serve_as_naoqi(robot, assembly, "tcp://127.0.0.1:0") as url,
            connected(url) as session,
        ):
            motion = session.service("ALMotion")

            def command():
                with suppress(RuntimeError):
                    motion.move(0.1, 0.0, 0.0)

            check_that_a_reset_starts_nothing(
                assembly, command, lambda: present(robot.walker).commanded().forward > 0.0
            )
