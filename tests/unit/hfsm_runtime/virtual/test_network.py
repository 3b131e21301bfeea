"""Proxies within the process behave as over the wire, in virtual time and without threads."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable
from typing import Any

import pytest

from hfsm_runtime import Automaton, Component, Proxy, State
from hfsm_runtime.virtual._stubs import make_stub
from interfaces.jderobot import (
    CameraPrx,
    ConfigurationNotExistException,
    ImageData,
    ImageDescription,
    InvalidValueException,
    Pose3DMotorsData,
    Pose3DMotorsPrx,
    Time,
)
from interfaces.nao import HeadPose, PoseHeadPrx
from naoserver.fake import FakeRobot
from tests.support.limits import EVENT_LIMIT
from tests.support.robot_server import served_to_client
from tests.support.stepped_clock import SteppedClock
from visualhfsm.testing import BehaviorFailed, MakeBehavior
from zenoh_ice import (
    ConnectionLostException,
    MarshalException,
    ObjectNotExistException,
    TimeoutException,
    UnknownException,
    ZenohIceError,
)
from zenoh_ice.threads.limits import Limits


class Nothing(Component):
    """A component that only has proxies."""

    Head = Proxy("Head", PoseHeadPrx)
    Camera = Proxy("Camera", CameraPrx)
    Shoulder = Proxy("RightShoulderMotors", Pose3DMotorsPrx)

    def automaton(self) -> Automaton:
        return Automaton(id=1, name="nothing", states=(State(id=1, name="idle", initial=True),))


CALLS: list[Callable[[Nothing], object]] = [
    lambda c: c.Head.getPose(),
    lambda c: c.Head.getLimits(),
    lambda c: c.Head.setPose(9.0, 0.1, 0.5),
    lambda c: c.Head.setPose(math.nan, 0.0, 0.5),
    lambda c: c.Head.setPose(0.0, 0.0, 7.0),
    lambda c: c.Head.setPose("far", 0.0, 0.5),  # type: ignore[arg-type]
    lambda c: c.Head.setPose(0.0, 0.0),  # type: ignore[call-arg]
    lambda c: c.Camera.getImageFormat(),
    lambda c: c.Camera.getImageData("PNG"),
    lambda c: c.Camera.getImageDescription(),
    lambda c: c.Shoulder.setPose3DMotorsData(Pose3DMotorsData(0, 0, 0, 0, 3.0, -0.1, 0.0, 99.0)),
    lambda c: c.Shoulder.setPose3DMotorsData(Pose3DMotorsData(0, 0, 0, 0, 0.1, -0.1, 0.0, -1.0)),
    lambda c: c.Shoulder.getPose3DMotorsParams(),
    lambda c: c.Head.ice_ids(),
    lambda c: c.Head.ice_isA("::nao::PoseHead"),
    lambda c: Pose3DMotorsPrx.checkedCast(c.Head),
    lambda c: c.Head.getPose.begin().result(),
    lambda c: c.Head.setPose.begin(math.inf, 0.0, 0.5).result(),
]


def outcome(call: Callable[[Nothing], object], component: Nothing) -> tuple[str, object]:
    """Return the result of a call, in a form that can be compared."""
    try:
        result = call(component)
    except (ZenohIceError, TypeError) as error:
        return type(error).__name__, str(error).replace(f"@{component.Head.ice_getRealm()}", "@REALM")
    return "result", result


@pytest.mark.slow
def test_calls_come_to_the_same_as_over_the_wire(behavior: MakeBehavior) -> None:
    b = behavior(Nothing, robot="fake")
    assert isinstance(b.component, Nothing)
    over_the_wire = Nothing()
    # One of the calls waits for an interface that the servant does not have.
    robot, limits = FakeRobot(SteppedClock(limit=EVENT_LIMIT)), Limits(longest_grace=0.0)
    with served_to_client(robot, limits=limits) as client:
        vars(over_the_wire)["Head"] = client.proxy(PoseHeadPrx, "Head")
        vars(over_the_wire)["Camera"] = client.proxy(CameraPrx, "Camera")
        vars(over_the_wire)["Shoulder"] = client.proxy(Pose3DMotorsPrx, "RightShoulderMotors")
        for number, call in enumerate(CALLS):
            assert outcome(call, b.component) == outcome(call, over_the_wire), f"call {number}"


@pytest.fixture
def b(behavior: MakeBehavior):
    return behavior(Nothing, robot="fake")


def test_no_thread_is_started(behavior: MakeBehavior) -> None:
    before = threading.active_count()
    b = behavior(Nothing, robot="fake")
    b.component.Head.getPose.latest()
    b.component.Camera.getImageData.wait()
    b.component.Head.getPose.begin().result()
    assert threading.active_count() == before


def test_calls_are_remembered_with_their_times(b) -> None:
    b.component.Head.setPose(0.5, 0.1, 0.2)
    b.advance(1.0)
    with pytest.raises(InvalidValueException):
        b.component.Head.setPose(math.nan, 0.0, 0.5)
    first, second = b.calls("Head.setPose")
    assert (first.time, first.pan, first.arguments) == (0.0, 0.5, {"pan": 0.5, "tilt": 0.1, "fraction": 0.2})
    assert first.result.pan == 0.5
    assert second.time == 1.0
    assert isinstance(second.error, InvalidValueException)
    assert b.calls("Head") == b.calls() == [first, second]
    assert "Head.setPose(pan=0.5, tilt=0.1, fraction=0.2)" in str(first)
    with pytest.raises(AttributeError, match="it has pan, tilt, fraction"):
        _ = first.speed


@pytest.mark.slow
def test_a_stream_begins_with_the_first_question(b) -> None:
    assert b.component.Head.getPose.latest() is None
    b.advance(0.1)
    sample = b.component.Head.getPose.latest()
    assert isinstance(sample.value, HeadPose)
    assert sample.age < 0.021
    b.advance(0.5)
    assert b.component.Head.getPose.latest().sequence - sample.sequence == 25


def test_the_age_of_a_sample_counts_virtual_time(b) -> None:
    b.component.Camera.getImageData.latest()
    b.advance(0.1)
    sample = b.component.Camera.getImageData.latest()
    age = sample.age
    b.advance(5.0)
    assert sample.age == pytest.approx(age + 5.0)


def test_images_come_at_the_rate_of_the_camera(b) -> None:
    times = []
    subscription = b.component.Camera.getImageData.subscribe(lambda sample: times.append(sample.time))
    b.advance(1.0)
    subscription.close()
    b.advance(1.0)
    assert times == pytest.approx([(number + 1) / 10 for number in range(10)])


def test_who_waits_for_a_sample_moves_the_time_on(b) -> None:
    first = b.component.Camera.getImageData.wait()
    assert b.time == pytest.approx(0.1)
    second = b.component.Camera.getImageData.wait(after=first)
    assert b.time == pytest.approx(0.2)
    assert second.sequence == first.sequence + 1


def test_a_loop_with_a_rate_waits_in_virtual_time(b) -> None:
    times = []
    for sample in b.component.Head.getPose.samples(timeout=1.0, rate=4.0):
        times.append(b.clock.now())
        assert sample.age < 0.021, "the newest"
        if len(times) == 5:
            break
    assert [time - times[0] for time in times] == pytest.approx([0.0, 0.25, 0.5, 0.75, 1.0], abs=0.021)


def test_a_subscription_with_a_rate_is_called_at_that_rate_of_virtual_time_with_the_newest(b) -> None:
    times, ages = [], []
    stream = b.component.Head.getPose

    def note(sample: Any) -> None:
        times.append(b.clock.now())
        ages.append(sample.age)

    with stream.subscribe(note, rate=4.0):
        b.advance(2.0)
        assert 8 <= len(times) <= 9
        assert times == pytest.approx([times[0] + 0.25 * number for number in range(len(times))])
        assert max(ages) < 0.021
    b.advance(1.0)
    assert len(times) <= 9, "it was closed"


@pytest.mark.parametrize(("rate", "number"), [(None, 20), (4.0, 8)])
def test_a_subscription_is_called_with_samples_of_a_stub(b, rate: float | None, number: int) -> None:
    pans = iter(range(1000))
    b.stub("Head", getPose=lambda: HeadPose(pan=float(next(pans))))
    heard: list[float] = []
    subscription = b.component.Head.getPose.subscribe(
        lambda sample: heard.append(sample.value.pan), rate=rate
    )
    b.advance(2.0)
    assert heard == [float(each) for each in range(number)]
    subscription.close()
    b.advance(1.0)
    assert len(heard) == number


@pytest.mark.parametrize(
    ("error", "logged"), [(ValueError("a slip"), 1), (SystemExit("a slip"), 1), (TimeoutException("late"), 0)]
)
def test_a_stub_that_fails_has_no_sample_and_says_so_once(
    b, error: BaseException, logged: int, caplog: pytest.LogCaptureFixture
) -> None:
    def fails() -> HeadPose:
        raise error

    b.stub("Head", getPose=fails)
    for _ in range(3):
        b.advance(0.1)
        assert b.component.Head.getPose.latest() is None
    assert caplog.text.count("Head.getPose has no sample while its stub fails") == logged
    assert caplog.text.count(f"{type(error).__name__}: a slip") == logged


def test_a_stream_without_samples_times_out_after_exactly_that_time(b) -> None:
    with pytest.raises(TimeoutException, match="no new sample"):
        b.component.Camera.getImageData.wait(timeout=0.05)
    assert b.time == pytest.approx(0.05, abs=1e-9)


def test_a_stream_that_nobody_asks_for_ends_and_restarts(b) -> None:
    b.component.Head.getPose.latest()
    b.advance(20.0)
    assert b.component.Head.getPose.latest() is None, "a sample from long ago is worse than none"
    b.advance(0.1)
    assert b.component.Head.getPose.latest().age < 0.021


def test_a_velocity_that_is_not_renewed_ends_in_virtual_time(b) -> None:
    b.component.Head.setSpeed(1.0, 0.0)
    b.advance(0.4)
    moving = b.robot.head[0]
    b.advance(1.0)
    stopped = b.robot.head[0]
    b.advance(1.0)
    assert 0.0 < moving < stopped < 0.6
    assert b.robot.head[0] == pytest.approx(stopped, abs=1e-3)


def test_a_servant_that_is_away_is_a_lost_connection(b) -> None:
    with b.server_offline("Head"):
        with pytest.raises(ConnectionLostException):
            b.component.Head.getPose()
        assert b.component.Camera.getImageFormat()
    assert b.component.Head.getPose()


def test_streams_of_a_servant_that_is_away_bring_nothing(b) -> None:
    pose, times = b.component.Head.getPose, []
    with pose.subscribe(lambda sample: times.append(sample.time)):
        pose.latest()
        b.advance(0.1)
        before, heard = pose.latest(), len(times)
        with b.server_offline("Head"):
            b.advance(1.0)
            assert pose.latest().sequence == before.sequence
            assert pose.latest().age == pytest.approx(1.0, abs=0.021)
            assert len(times) == heard > 0
        b.advance(0.1)
        assert pose.latest().age < 0.1
        assert len(times) > heard


def test_what_nobody_serves_does_not_exist(behavior: MakeBehavior) -> None:
    b = behavior(Nothing)
    with pytest.raises(ObjectNotExistException, match="robot= or stub"):
        b.component.Head.getPose()


class TestStubs:
    @pytest.fixture
    def b(self, behavior: MakeBehavior):
        return behavior(Nothing)

    def test_a_function_answers(self, b) -> None:
        b.stub("Head", setPose=lambda pan, tilt, fraction: HeadPose(0.0, pan, tilt, fraction, 0.0))
        assert b.component.Head.setPose(0.5, 0.25, 0.125) == HeadPose(0.0, 0.5, 0.25, 0.125, 0.0)

    def test_a_value_answers_in_calls_and_streams(self, b) -> None:
        image = ImageData(ImageDescription(1, 1, 3, "RGB8"), Time(0, 0), b"abc")
        b.stub("Camera", getImageData=image)
        assert b.component.Camera.getImageData("RGB8").pixelData == b"abc"
        assert b.component.Camera.getImageData.latest().value.pixelData == b"abc"

    def test_an_exception_is_raised(self, b) -> None:
        b.stub("Camera", getImageData=ConfigurationNotExistException("no such format"))
        with pytest.raises(ConfigurationNotExistException, match="no such format"):
            b.component.Camera.getImageData("RGB8")

    def test_what_does_not_fit_the_interface_is_reported(self, b) -> None:
        b.stub("Head", getPose="to the left")
        with pytest.raises(MarshalException):
            b.component.Head.getPose()
        with pytest.raises(LookupError, match="it has setPose"):
            b.stub("Head", nod=1)
        with pytest.raises(LookupError, match="there are Head, Camera, Shoulder"):
            b.stub("Tail", wag=1)

    def test_what_is_not_stubbed_says_so(self, b) -> None:
        b.stub("Head", getPose=HeadPose(0.0, 0.0, 0.0, 0.0, 0.0))
        with pytest.raises(UnknownException, match=r"Head\.stop is not stubbed"):
            b.component.Head.stop()

    def test_the_rest_goes_to_the_robot(self, behavior: MakeBehavior) -> None:
        b = behavior(Nothing, robot="fake", stubs={"Head": {"stop": None}})
        b.component.Head.setPose(0.5, 0.0, 1.0)
        b.component.Head.stop()
        b.advance(2.0)
        assert b.robot.head[0] == pytest.approx(0.5)
        b.component.Head.getPose.latest()
        b.advance(0.1)
        assert b.component.Head.getPose.latest().value.pan == pytest.approx(0.5)

    def test_a_stream_that_has_begun_goes_over_to_the_stub(self, behavior: MakeBehavior) -> None:
        b = behavior(Nothing, robot="fake")
        head = b.component.Head
        head.getPose.latest()
        b.advance(0.1)
        b.stub("Head", getPose=HeadPose(0.0, 0.125, 0.0, 0.0, 0.0))
        b.advance(0.1)
        assert head.getPose.latest().value.pan == 0.125
        b.stub("Head", getPose=RuntimeError("dead"))
        b.advance(2.0)
        assert head.getPose.latest().age == pytest.approx(2.0)

    def test_a_servant_that_takes_the_place_of_another_publishes_for_itself(
        self, behavior: MakeBehavior
    ) -> None:
        b = behavior(Nothing, robot="fake")
        head = b.component.Head
        head.getPose.latest()
        b.advance(0.1)
        silent, _ = make_stub("Head", PoseHeadPrx.ice_interface, {})
        b.stub("Head", silent)
        b.advance(1.0)
        assert head.getPose.latest().age == pytest.approx(1.0, abs=0.021)

    def test_the_streams_of_other_operations_go_on_as_before(self, behavior: MakeBehavior) -> None:
        b = behavior(Nothing, robot="fake")
        head = b.component.Head
        head.getPose.latest()
        b.advance(0.1)
        before = head.getPose.latest().sequence
        b.stub("Head", stop=None)
        b.advance(0.1)
        assert head.getPose.latest().sequence == before + 5


def test_code_that_needs_what_nobody_serves_fails_the_test(behavior: MakeBehavior) -> None:
    b = behavior("behaviors/follow_ball.xml")
    with pytest.raises(BehaviorFailed, match="there is no servant Head"):
        b.advance(0.1)
