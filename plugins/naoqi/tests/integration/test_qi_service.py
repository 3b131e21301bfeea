"""A fake robot served as NAOqi in a separate process, and genuine clients of libqi."""

import queue
import signal
import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import pytest

pytest.importorskip("qi")

import qi

from naoserver.errors import RobotError
from plugins.naoqi.tests.support.naoqi import connected, eventually_near
from tests.support.commands import run_here
from tests.support.limits import CALL_LIMIT, EVENT_LIMIT, FOREVER, RUN_LIMIT
from tests.support.processes import REPOSITORY, ComponentProcess, module
from tests.support.waiting import until
from visualhfsm_naoqi.programs.__main__ import app
from visualhfsm_naoqi.programs._connections import MOST_LINKS
from visualhfsm_naoqi.programs._memory import MOST_KEYS

HEAD_YAW = "Device/SubDeviceList/HeadYaw/Position/Sensor/Value"
ANYWHERE = "tcp://127.0.0.1:0"
MILLISECONDS = int(CALL_LIMIT * 1000)


def server(*options, program="visualhfsm_naoqi.programs"):
    return ComponentProcess(module(program, "--qi", ANYWHERE, *options))


@pytest.fixture(scope="module")
def url():
    with server("--speed", "3", program="plugins.naoqi.tests.support.faulty") as process:
        yield process.wait_for(r"^ready: (\S+)")[1]


@pytest.fixture
def session(url):
    with connected(url) as session:
        yield session
    with connected(url) as session:
        session.service("Faults").clear()
        session.service("ALMotion").killAll()


@pytest.fixture
def motion(session):
    return session.service("ALMotion")


@pytest.fixture
def video(session):
    video = session.service("ALVideoDevice")
    yield video
    for handle in video.getSubscribers():
        video.unsubscribe(handle)


def angle(motion):
    return motion.getAngles("HeadYaw", True)[0]


def test_long_calls_keep_nobody_waiting(motion):
    motion.move(0.05, 0.0, 0.0)
    waiting = [motion.waitUntilMoveIsFinished(_async=True) for _ in range(40)]
    assert motion.moveIsActive()
    assert all(future.isRunning() for future in waiting)
    motion.stopMove()
    for future in waiting:
        assert future.wait(MILLISECONDS) == qi.FutureState.FinishedWithValue


def test_a_walk_goes_on_without_being_renewed(motion):
    x = motion.getRobotPosition(True)[0]
    motion.move(0.15, 0.0, 0.0)
    eventually_near(lambda: motion.getRobotPosition(True)[0], x + 0.45, 0.05)  # longer than the guard's 0.5 s
    motion.stopMove()


def test_a_call_can_be_cancelled(motion):
    future = motion.angleInterpolation("HeadYaw", 1.0, FOREVER, True, _async=True)
    eventually_near(lambda: len(motion.getTaskList()), 1, 0)
    future.cancel()
    assert future.wait(MILLISECONDS) != qi.FutureState.Running
    eventually_near(lambda: len(motion.getTaskList()), 0, 0)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda motion: motion.setAngles("Nose", 1.0, 0.1), "there is no joint or chain 'Nose'"),
        (lambda motion: motion.angleInterpolation("HeadYaw", 1.0, [], True), "there are 0 times"),
        (lambda motion: motion.move(1.0), "missing a required argument"),
        (lambda motion: motion.setAngles("HeadYaw"), "Arguments types did not match for setAngles"),
    ],
)
def test_an_error_reports_what_is_wrong_and_nothing_of_the_code(motion, call, message):
    with pytest.raises(RuntimeError) as caught:
        call(motion)
    assert message in str(caught.value)
    assert ".py" not in str(caught.value)


def test_nothing_can_be_called_but_operations(motion):
    assert not hasattr(motion, "_body")
    assert not hasattr(motion, "_follow")
    assert hasattr(motion, "getSummary")


def test_a_picture(motion, video):
    motion.angleInterpolation(["HeadYaw", "HeadPitch"], [[0.0], [0.0]], [[0.2], [0.2]], True)
    handle = video.subscribeCamera("test", 0, 2, 11, 30)
    picture = video.getImageRemote(handle)
    assert isinstance(picture[6], bytearray)
    rgb = np.frombuffer(picture[6], np.uint8).reshape(480, 640, 3)
    assert list(picture[:4]) == [640, 480, 3, 11]
    assert picture[7] == 0
    assert picture[8] == pytest.approx(np.radians(56.3) / 2)
    assert any((rgb == (220, 30, 30)).all(axis=2).ravel()), "the red ball is in view"
    bgr = video.subscribeCamera("test", 0, 2, 13, 30)
    seen = np.frombuffer(video.getImageRemote(bgr)[6], np.uint8).reshape(480, 640, 3)
    assert any((seen == (30, 30, 220)).all(axis=2).ravel())


def test_subscriptions_of_a_name_are_few_and_can_be_given_back(video):
    handles = [video.subscribeCamera("greedy", 0, 1, 11, 10) for _ in range(9)]
    assert all(handles[:8])
    assert handles[8] == ""
    assert video.unsubscribe(handles[0])
    assert video.subscribeCamera("greedy", 0, 1, 11, 10)
    assert video.unsubscribeAllInstances("greedy")
    with pytest.raises(RuntimeError, match="there is no subscription"):
        video.getImageRemote(handles[1])


def test_the_active_camera_is_that_of_subscriptions_without_one(video):
    old, top = video.subscribe("old", 1, 11, 10), video.subscribeCamera("new", 0, 1, 11, 10)
    assert video.setParam(18, 1) is True
    assert (video.getActiveCamera(), video.getParam(18), video.getActiveCamera(old)) == (1, 1, 1)
    assert video.getImageRemote(old)[7] == 1
    assert video.setActiveCamera(top, 0) is True
    assert video.getActiveCamera(top) == 0
    assert video.setActiveCamera(5) is False
    assert video.setActiveCamera(0) is True


def test_parameters_of_a_camera_are_remembered(video):
    assert video.setParameter(1, 0, 55) is True
    assert (video.getParameter(1, 0), video.getParameter(0, 0)) == (55, 0)
    video.setAllParametersToDefault(1)
    assert video.getParameter(1, 0) == 0
    with pytest.raises(RuntimeError, match="cameraIndex is 7: it must be from 0 to 1"):
        video.setParameter(7, 0, 1)


def test_what_cannot_be_subscribed(video):
    assert video.subscribeCamera("test", 7, 1, 11, 10) == ""
    assert video.subscribeCamera("test", 0, 1, 99, 10) == ""
    assert video.subscribeCamera("test", 0, 1, 11, 1000) == ""


def test_events_reach_other_clients(session, url):
    heard = qi.Promise()
    subscriber = session.service("ALMemory").subscriber("Test/Event")
    subscriber.signal.connect(heard.setValue)
    with connected(url) as other:
        other.service("ALMemory").raiseEvent("Test/Event", ["a", 1])
    assert heard.future().value(MILLISECONDS) == ["a", 1]


def test_subscribers_and_their_callbacks_are_counted_also_of_one_event(url):
    with connected(url) as program:
        memory = program.service("ALMemory")
        subscribers = [memory.subscriber("Test/Event") for _ in range(MOST_KEYS)]
        with pytest.raises(
            RuntimeError, match="this program has 250 subscribers already: let some of them go"
        ):
            memory.subscriber("Test/Event")
        links = [each.signal.connect(print) for each in subscribers[:MOST_LINKS]]
        with pytest.raises(RuntimeError, match="this program has 100 callbacks already: disconnect some"):
            subscribers[-1].signal.connect(print)
        subscribers[0].signal.disconnect(links[0])
        heard = qi.Promise()
        subscribers[-2].signal.connect(heard.setValue)  # libqi keeps in mind that the last one was refused
        memory.raiseEvent("Test/Event", 1)
        assert heard.future().value(MILLISECONDS) == 1
        del subscribers[1]
        until(lambda: succeeds(memory.subscriber, "Test/Event"))


def succeeds(call, *arguments):
    try:
        call(*arguments)
    except RuntimeError:
        return False
    return True


def test_touch_changed_sends_what_changed(session):
    heard: queue.Queue[list[list[Any]]] = queue.Queue()
    subscriber = session.service("ALMemory").subscriber("TouchChanged")
    subscriber.signal.connect(heard.put)
    for touched, change in (
        (["HeadFront", "LHandBack"], [["Head/Touch/Front", True], ["LHand/Touch/Back", True]]),
        (["LHandBack"], [["Head/Touch/Front", False]]),
        ([], [["LHand/Touch/Back", False]]),
    ):
        session.service("Faults").touch(touched)
        assert sorted(heard.get(timeout=MILLISECONDS / 1000)) == change


class Listener:
    """A service of a program, with what was called back."""

    def __init__(self):
        self.heard: queue.Queue[tuple[str, object, str]] = queue.Queue()

    def onTouch(self, key, value, message):
        self.heard.put((key, value, message))


def test_a_programs_own_service_is_called_back(session, caplog):
    memory, faults, listener = session.service("ALMemory"), session.service("Faults"), Listener()
    session.listen(ANYWHERE)
    session.registerService("MyModule", listener)
    memory.subscribeToEvent("FrontTactilTouched", "MyModule", "onTouch")
    memory.subscribeToMicroEvent("Mine", "MyModule", "note", "onTouch")
    faults.touch(["HeadFront"])
    assert listener.heard.get(timeout=EVENT_LIMIT) == ("FrontTactilTouched", 1.0, "")
    memory.raiseMicroEvent("Mine", 7)
    assert listener.heard.get(timeout=EVENT_LIMIT) == ("Mine", 7, "note")
    memory.unsubscribeToEvent("FrontTactilTouched", "MyModule")
    faults.touch([])
    memory.raiseMicroEvent("Mine", 8)
    assert listener.heard.get(timeout=EVENT_LIMIT) == ("Mine", 8, "note")
    with pytest.raises(RuntimeError, match="the operation to call"):
        memory.subscribeToEvent("FrontTactilTouched", "MyModule")


def test_a_program_that_is_gone_is_called_back_no_more(session):
    memory = session.service("ALMemory")
    heard: queue.Queue[int] = queue.Queue()
    memory.subscribeToEvent("Mine", "Nobody", "onTouch")
    subscriber = memory.subscriber("Mine")
    subscriber.signal.connect(heard.put)
    memory.raiseEvent("Mine", 1)
    assert heard.get(timeout=EVENT_LIMIT) == 1


def test_a_call_runs_in_the_background_as_a_task(session, motion):
    speech = session.service("ALTextToSpeech")
    task = motion.pCall(["angleInterpolation", "HeadYaw", 0.5, 0.5, True])
    assert motion.isRunning(task)
    assert motion.wait(task, 10) is True
    assert motion.wait(task, 0) is False
    assert angle(motion) == pytest.approx(0.5, abs=0.01)
    sentence = speech.pCall(["say", "a long text " * 100])
    speech.stop(sentence)
    assert speech.wait(sentence, MILLISECONDS) is False
    with pytest.raises(RuntimeError, match="no operation 'fly'"):
        motion.pCall(["fly"])


def test_every_service_describes_itself(session):
    names = [each["name"] for each in session.services() if each["name"].startswith("AL")]
    assert len(names) > 30
    for name in names:
        service = session.service(name)
        methods = service.getMethodList()
        assert {"getMethodList", "getMethodHelp", "ping", "version", "pCall", "wait"} <= set(methods)
        assert all(hasattr(service, method) for method in methods)
        assert service.getModuleHelp()[0] == name
        assert service.getModuleHelp()[1]
        assert service.getBrokerName()
        assert service.ping() is True


def test_the_help_of_an_operation_names_its_parameters(session, motion):
    assert motion.getMethodHelp("setAngles") == [
        "setAngles",
        "Send joints to angles in rad at a fraction of their full speed; returns at once.",
        [["names", ""], ["angles", ""], ["maxSpeedFraction", ""]],
    ]
    assert motion.getUsage("moveTo").startswith("moveTo(...): Walk by x, y, theta")
    assert motion.getMethodHelp("angleInterpolation")[2][0] == ["names", ""], "no call, which only we see"
    recorder = session.service("ALVideoRecorder")
    assert "this robot records no video" in recorder.getMethodHelp("startRecording")[1]
    with pytest.raises(RuntimeError, match="there is no operation 'fly'; there are"):
        motion.getMethodHelp("fly")


def test_a_service_that_is_refused_says_why(session):
    sound = session.service("ALSoundLocalization")
    with pytest.raises(RuntimeError, match="ALSoundLocalization is not offered: this robot hears nothing"):
        sound.subscribe("test")


def test_an_operation_that_is_refused_says_why(session):
    memory = session.service("ALMemory")
    assert "LandmarkDetected" in memory.getEventList()
    with pytest.raises(
        RuntimeError, match="ALMemory::getSubscribers: this operation is not offered: only keys"
    ):
        memory.getSubscribers("LandmarkDetected")


def test_many_clients_at_once(url):
    def use(number):
        with connected(url) as session:
            motion = session.service("ALMotion")
            return [len(motion.getAngles("Body", True)) for _ in range(20)]

    with ThreadPoolExecutor(4) as executor:
        assert list(executor.map(use, range(4))) == [[26] * 20] * 4


# -- what tests make go wrong ----------------------------------------------------------------------------


def test_calls_that_fail(session, motion):
    session.service("Faults").fail("ALMotion::get*", "the motor boards do not answer")
    with pytest.raises(RuntimeError, match="ALMotion::getAngles: the motor boards do not answer"):
        angle(motion)
    session.service("Faults").clear()
    angle(motion)


def test_keys_that_are_not_there(session):
    memory = session.service("ALMemory")
    session.service("Faults").forget("Device/SubDeviceList/Head*")
    assert memory.getListData([HEAD_YAW]) == [None]
    assert HEAD_YAW not in memory.getDataListName()
    session.service("Faults").clear()
    assert memory.getListData([HEAD_YAW]) != [None]


def test_calls_that_are_late(session, motion):
    session.service("Faults").slow("ALMotion::getAngles", FOREVER)
    future = motion.getAngles("HeadYaw", True, _async=True)
    assert motion.getBodyNames("Head") == ["HeadYaw", "HeadPitch"]
    assert future.isRunning()
    future.cancel()
    session.service("Faults").clear()


def test_cameras_without_a_picture(session, video):
    handle = video.subscribeCamera("test", 0, 1, 11, 30)
    session.service("Faults").blind(True)
    assert video.getImageRemote(handle) is None
    session.service("Faults").blind(False)
    assert video.getImageRemote(handle) is not None


def test_connections_that_break(session, motion, url):
    gone = threading.Event()
    session.disconnected.connect(lambda _reason: gone.set())
    session.service("Faults").disconnect()
    assert gone.wait(EVENT_LIMIT)
    with pytest.raises(RuntimeError):
        angle(motion)

    def back():
        try:
            with connected(url) as again:
                again.service("Faults")  # the last that is offered again
                return len(again.service("ALMotion").getAngles("Body", True))
        except RuntimeError:
            return 0

    eventually_near(back, 26, 0)


# -- the command -----------------------------------------------------------------------------------------


def test_it_ends_cleanly_at_ctrl_c_while_it_is_used():
    with server() as process:
        with connected(process.wait_for(r"^ready: (\S+)")[1]) as session:
            services = {service["name"] for service in session.services()}
            assert "Faults" not in services
            call = session.service("ALMotion").angleInterpolation("HeadYaw", 1.0, FOREVER, True, _async=True)
            process.process.send_signal(signal.SIGINT)
            assert process.wait() == 130
            assert call.wait(MILLISECONDS) != qi.FutureState.Running
        assert process.output.count("\n") == 1


def test_a_port_that_is_taken(url):
    refused = run_here(app, "visualhfsm_naoqi.programs", "--qi", url, expected=(RobotError,))
    assert refused.returncode == 1
    assert f"cannot listen at {url}" in refused.stderr
    assert "Traceback" not in refused.stderr


@pytest.mark.parametrize(
    "command",
    [
        ["visualhfsm_naoqi.programs"],
        pytest.param(
            ["naoserver_sim", "--listen", "tcp/127.0.0.1:0", "--qi", ANYWHERE], marks=pytest.mark.sim
        ),
    ],
)
def test_without_qi_it_names_what_to_install(command):
    code = (
        f"import runpy, sys; sys.modules['qi'] = None; sys.argv = {command};"
        f"runpy.run_module({command[0]!r}, run_name='__main__')"
    )
    result = subprocess.run(
        [sys.executable, "-c", code],
        cwd=REPOSITORY,
        capture_output=True,
        text=True,
        timeout=RUN_LIMIT,
        check=False,
    )
    assert result.returncode == 1
    assert "qi is not installed; type: pip install 'visualhfsm[naoqi]'" in result.stderr
    assert "Traceback" not in result.stderr
