"""Calls of a servant as its transport hands them over: in turn, and for callers that are gone."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import msgspec
import pytest

from tests.support.gripper import GripperI
from tests.support.limits import EVENT_LIMIT
from tests.support.waiting import until
from zenoh_ice import Communicator, Settings
from zenoh_ice.data.keys import Target
from zenoh_ice.routes.in_process import InProcessTransport
from zenoh_ice.threads.pool import Pool
from zenoh_ice.transport import Receiver

NO_ARGUMENTS = b"\x80"
MOVE = msgspec.msgpack.encode({"position": 1.0})


@pytest.fixture
def communicator() -> Iterator[Communicator]:
    with Communicator(Settings(clock="wall"), pool=Pool(2, "test"), transport=InProcessTransport) as here:
        yield here


@pytest.fixture
def servant(communicator: Communicator) -> GripperI:
    adapter, servant = communicator.createObjectAdapter("Test"), GripperI()
    adapter.add(servant, "Gripper")
    adapter.activate()
    return servant


def admit(
    receiver: Receiver,
    operation: str,
    answers: list[bool],
    *,
    gone: bool = False,
    ended: Callable[[], bool] | None = None,
) -> Callable[..., object] | None:
    """Hand a call over; return the function that runs it, None if it waits for its turn."""
    payload = MOVE if operation == "move" else NO_ARGUMENTS
    job = receiver.admit(operation, payload, None, lambda ok, _: answers.append(ok), gone=gone, ended=ended)
    return None if job is None else job[1]


def test_a_call_that_nobody_waits_for_is_executed_only_if_it_stops(
    communicator: Communicator, servant: GripperI
) -> None:
    served, answers = communicator.served[Target("nao", "Gripper")], list[bool]()
    for operation in ("move", "stop"):
        run = admit(served, operation, answers, gone=True)
        assert run is not None
        run()
    assert answers == [False, True]
    assert (servant.moved, servant.stopped) == ([], 1)
    assert (served.status().refused, served.status().calls) == (1, 1)


def test_callers_of_calls_that_waited_are_asked_whether_they_still_do(
    communicator: Communicator, servant: GripperI
) -> None:
    served, answers, asked = communicator.served[Target("nao", "Gripper")], list[bool](), list[str]()

    def ended() -> bool:
        asked.append("ended")
        return True

    servant.leave.clear()
    run = admit(served, "move", answers, ended=ended)
    assert run is not None
    communicator.pool.submit(run)
    assert servant.entered.acquire(timeout=EVENT_LIMIT)
    for operation in ("move", "stop"):
        assert admit(served, operation, answers, ended=ended) is None
    assert asked == []
    servant.leave.set()
    until(lambda: len(answers) == 3)
    assert answers == [True, False, True]
    assert (servant.moved, servant.stopped) == ([1.0], 1)
    assert asked == ["ended"]
