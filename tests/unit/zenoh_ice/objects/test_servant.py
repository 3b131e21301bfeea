"""Calls of a servant as its transport hands them over: in turn, and for callers that are gone."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import msgspec
import pytest

from tests.support.gripper import GripperI
from tests.support.hostile_bytes import bombs
from tests.support.limits import EVENT_LIMIT
from tests.support.waiting import until
from zenoh_ice import (
    Communicator,
    MarshalException,
    OperationNotExistException,
    Settings,
)
from zenoh_ice.data.codec import Buffer
from zenoh_ice.data.keys import Target
from zenoh_ice.data.wire import decode_error
from zenoh_ice.routes.in_process import InProcessTransport
from zenoh_ice.threads.pool import Pool
from zenoh_ice.transport import Receiver

BOMBS = [pytest.param(bomb, id=f"bomb {number}") for number, bomb in enumerate(bombs())]
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


def answer(
    communicator: Communicator, operation: str, payload: bytes, attachment: bytes | None = None
) -> Buffer | Exception:
    """Hand over a call of somebody who is none of ours; return its result or its error."""
    answers: list[Buffer | Exception] = []

    def reply(ok: bool, answer: Any) -> None:
        answers.append(answer if ok else decode_error(bytes(answer), (), "call"))

    job = communicator.served[Target("nao", "Gripper")].admit(operation, payload, attachment, reply)
    if job is not None:
        job[1]()
    (found,) = answers
    return found


@pytest.mark.parametrize(
    "payload",
    [
        pytest.param(b"", id="empty"),
        pytest.param(b"\xc1", id="not MessagePack"),
        pytest.param(b"\x82\xa8position", id="cut off"),
        pytest.param(b"\x91" * 500_000, id="nested too deeply"),
        pytest.param(b"\x83\xa1x" + b"\x91" * 500_000, id="unknown field nested too deeply"),
        pytest.param(b"\x81\xa8position\xdd\xff\xff\xff\xff", id="announces 4 billion elements"),
        pytest.param(b"\x90", id="an array"),
        pytest.param(b"\x81\xa8position\xa2\xff\xfe", id="not UTF-8"),
        pytest.param(bytes((1 << 20) + 1), id="too large"),
        *BOMBS,
    ],
)
def test_a_malformed_call_is_refused_and_the_next_one_executed(
    communicator: Communicator, servant: GripperI, payload: bytes
) -> None:
    error = answer(communicator, "move", payload)
    assert isinstance(error, MarshalException)
    assert len(payload) <= 1 << 20 or "1048577 bytes" in str(error)
    assert not isinstance(answer(communicator, "move", MOVE), Exception)
    assert servant.moved == [1.0]


@pytest.mark.parametrize("attachment", [b"\xc1", b"\x91\x01", b"\x91" * 400, b"x" * 4096, *BOMBS])
def test_a_call_with_a_malformed_attachment_is_refused(
    communicator: Communicator, servant: GripperI, attachment: bytes
) -> None:
    error = answer(communicator, "ice_ping", NO_ARGUMENTS, attachment)
    assert isinstance(error, MarshalException)
    assert "attachment" in str(error)


@pytest.mark.parametrize("name", ["__init__", "moved", "entered", "ice_publisher"])
def test_only_operations_can_be_called(communicator: Communicator, servant: GripperI, name: str) -> None:
    assert isinstance(answer(communicator, name, NO_ARGUMENTS), OperationNotExistException)
