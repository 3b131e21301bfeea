"""What recordings keep of ROS, and what replays make of it, malformed recordings included."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Any

import pytest

from hfsm_runtime._recording.values import readable
from hfsm_runtime.kinds import Differs
from visualhfsm_ros2._ends import KINDS
from visualhfsm_ros2._recording import ENDS
from visualhfsm_ros2._virtual import FakeRos
from visualhfsm_ros2.names import Ros
from zenoh_ros2 import CallTimeoutError, MessageError, QoS, RosError, Status

STRING = "std_msgs/msg/String"
HEARD = Ros("subscribe", "/text", STRING)
SAID = Ros("publish", "/text", STRING)
SET = Ros("service", "/set", "std_srvs/srv/SetBool")
COUNT = Ros("action", "/count", "example_interfaces/action/Fibonacci")


class Tape:
    """Record readings, and return them again."""

    def __init__(self) -> None:
        self.readings: deque[tuple[str, Any]] = deque()

    def record(self, kind: str, read: Callable[[], Any], _waits: object) -> Any:
        self.readings.append((kind, read()))
        return self.readings[-1][1]

    def replay(self, kind: str, _read: object, _waits: object) -> Any:
        if not self.readings or self.readings[0][0] != kind:
            return None
        return self.readings.popleft()[1]


@pytest.fixture
def ros() -> FakeRos:
    return FakeRos(lambda: 0.0, lambda holds, _limit: holds())


def used(
    ros: FakeRos, declared: Ros, ask: Any, differs: Differs = lambda *_: None, end: object = None
) -> Any:
    """Return what user code uses, with a genuine end or without."""
    asked = ENDS[declared.kind](declared, ros.types, ask, differs, end)
    return KINDS[declared.kind](asked, ros.types, declared)


def recording(ros: FakeRos, tape: Tape, declared: Ros) -> Any:
    """Return what user code uses while its readings are recorded."""
    return used(ros, declared, tape.record, end=ros.make_end(declared, QoS()))


def test_samples_are_replayed_as_they_were_read(ros: FakeRos) -> None:
    tape = Tape()
    recorded = recording(ros, tape, HEARD)

    def read(subscription: Any) -> list[object]:
        sample = subscription.latest()
        return [sample and sample.value.data, sample and sample.sequence, sample and sample.age]

    seen = [read(recorded)]
    for text in ("one", "two"):
        ros.topic("/text").publish(data=text)
        seen += [read(recorded), read(recorded)]
    assert [kind for kind, _ in tape.readings].count("ros /text latest") == 5
    assert {"same": True} in [value for _, value in tape.readings]
    replayed = used(ros, HEARD, tape.replay)
    assert [read(replayed) for _ in seen] == seen
    assert read(replayed)[0] == "two"  # nothing more was recorded: the newest


def test_errors_are_replayed(ros: FakeRos) -> None:
    tape = Tape()
    client = recording(ros, tape, SET)
    request = ros.types.make(f"{SET.type}_Request", data=True)
    with pytest.raises(CallTimeoutError, match="no server"):
        client.call(request, timeout=0.0)
    ros.service("/set", lambda _request: {"message": "done"})
    client.call(request, timeout=0.0)
    again = used(ros, SET, tape.replay)
    with pytest.raises(CallTimeoutError, match="no server"):
        again.call(request, timeout=0.0)
    assert again.call(request, timeout=0.0).message == "done"
    with pytest.raises(CallTimeoutError, match="no response was recorded"):
        again.call(request, timeout=0.0)


def test_what_is_sent_otherwise_is_reported(ros: FakeRos) -> None:
    tape, found = Tape(), list[tuple[str, object, object]]()
    make = ros.types.make
    recording(ros, tape, SAID).publish(make(STRING, data="one"))
    replayed = used(ros, SAID, tape.replay, lambda *difference: found.append(difference))
    replayed.publish(make(STRING, data="two"))
    assert found == [("/text.publish", {"data": "one"}, {"data": "two"})]


def test_large_messages_are_left_out_and_reach_the_code_that_is_recorded(ros: FakeRos) -> None:
    tape = Tape()
    recorded = recording(ros, tape, HEARD)
    ros.topic("/text").publish(data="x" * (1 << 20))
    sample = recorded.latest()
    assert sample is not None
    assert len(sample.value.data) == 1 << 20
    assert len(str(tape.readings)) < 200
    replayed = used(ros, HEARD, tape.replay)
    with pytest.raises(MessageError, match="1048585 bytes were too large to be recorded"):
        replayed.latest()


@pytest.mark.parametrize(
    "reading",
    [
        {"data": "§"},
        {"data": 7},
        {"data": "AAEAAP////8="},
        {"data": "AAEAAAIAAABhAA==", "sequence": "1"},
        {"error": "SystemExit", "text": "no"},
        {"error": "Node", "text": 3},
    ],
)
def test_malformed_recordings_are_refused(ros: FakeRos, reading: dict[str, object]) -> None:
    replayed = used(ros, HEARD, lambda *_: reading)
    with pytest.raises(RosError):
        replayed.latest()


def test_readings_of_a_goal_have_their_types(ros: FakeRos) -> None:
    client = used(ros, COUNT, lambda *_: "malformed")
    goal = client.send(ros.types.make(f"{COUNT.type}_Goal"), timeout=0.0)
    assert (goal.status, goal.done, goal.feedback) == (Status(0), True, None)


def test_variables_that_hold_goals_and_responses_are_the_same_as_in_older_recordings(ros: FakeRos) -> None:
    tape = Tape()
    ros.make_end(COUNT, QoS())
    ros.action("/count")
    for code in (recording(ros, tape, COUNT), used(ros, COUNT, tape.replay)):
        assert readable(code.send()) == "<hfsm_runtime._recording.ros._Goal object>"
    ros.make_end(SET, QoS())
    ros.service("/set", lambda _request: {})
    for code in (recording(ros, tape, SET), used(ros, SET, tape.replay)):
        assert readable(code.call_async()) == "<_Response state=pending>"
