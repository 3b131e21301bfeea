"""Whatever user code of a node raises: who waits for it gets an answer, the next one is served, the log tells.

Each place where a node calls user code is a function of PLACES, each kind of exception a line of RAISED.
"""

from __future__ import annotations

import asyncio
import itertools
import logging
import queue
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Future
from typing import Any, Final

import pytest

from plugins.ros2.tests.support.ros_nodes import matched
from plugins.ros2.tests.unit.node.test_parameters import ask, setting
from tests.support.limits import CALL_LIMIT, EVENT_LIMIT
from tests.support.soak import cases
from tests.support.waiting import until
from zenoh_ros2 import (
    ActionClient,
    ActionServer,
    CallError,
    Node,
    Parameters,
    RosError,
    Status,
)

pytestmark = pytest.mark.slow

ADD: Final = "example_interfaces/srv/AddTwoInts"
FIBONACCI: Final = "example_interfaces/action/Fibonacci"
INT: Final = "std_msgs/msg/Int64"


class Cut(BaseException):
    """What ends code from outside, and has no text."""

    def __str__(self) -> str:
        raise KeyError("text")


RAISED: Final[dict[str, Callable[[], BaseException]]] = {
    "an exception": lambda: ZeroDivisionError("a fault"),
    "one of this package": lambda: RosError("a fault"),
    "an exit": lambda: SystemExit(3),
    "an interrupt": lambda: KeyboardInterrupt(),
    "the end of a generator": lambda: GeneratorExit(),
    "the cancellation of a task": lambda: asyncio.CancelledError(),
    "a cut without a text": lambda: Cut(),
}


class Response(Mapping[str, object]):
    """A response or a result that fails when it is read."""

    def __init__(self, read: Callable[[], object]) -> None:
        self._read: Final = read

    def __getitem__(self, key: str) -> object:
        raise KeyError(key)

    def __iter__(self) -> Iterator[str]:
        self._read()
        return iter(())

    def __len__(self) -> int:
        return 1


Fail = Callable[[], None]
"""Raises once, the first time."""


def topic(robot: Node, tool: Node, name: str, fail: Fail) -> None:
    received = queue.SimpleQueue[int]()

    def receive(message: Any) -> None:
        received.put(message.data)
        fail()

    robot.create_subscription(INT, name, receive)
    publisher = tool.create_publisher(INT, name)
    matched(robot, tool, name)
    for number in (1, 2):
        publisher.publish(data=number)
        assert received.get(timeout=EVENT_LIMIT) == number


def service(robot: Node, tool: Node, name: str, fail: Fail) -> None:
    def handle(request: Any) -> dict[str, object]:
        fail()
        return {"sum": request.a}

    called_twice(robot, tool, name, handle)


def future_of_a_service(robot: Node, tool: Node, name: str, fail: Fail) -> None:
    def handle(request: Any) -> Any:
        done = Future[Any]()
        try:
            fail()
        except BaseException as error:  # noqa: BLE001
            done.set_exception(error)
        else:
            done.set_result({"sum": request.a})
        return done

    called_twice(robot, tool, name, handle)


def response_of_a_service(robot: Node, tool: Node, name: str, fail: Fail) -> None:
    answers = iter([Response(fail), {"sum": 7}])
    called_twice(robot, tool, name, lambda _: next(answers))


def called_twice(robot: Node, tool: Node, name: str, handle: Callable[[Any], object]) -> None:
    robot.create_service(ADD, name, handle)
    client = tool.create_client(ADD, name)
    client.wait(EVENT_LIMIT)
    with pytest.raises(CallError, match="the handler failed: "):
        client.call(a=7, timeout=CALL_LIMIT)
    assert client.call(a=7, timeout=CALL_LIMIT).sum == 7


def callback_of_a_call(robot: Node, tool: Node, name: str, fail: Fail) -> None:
    answers, called = queue.SimpleQueue[int](), queue.SimpleQueue[int]()
    robot.create_service(ADD, name, lambda _: {"sum": answers.get(timeout=EVENT_LIMIT)})
    client = tool.create_client(ADD, name)
    client.wait(EVENT_LIMIT)

    def receive(done: Any) -> None:
        called.put(done.result().sum)
        fail()

    for number in (1, 2):
        client.call_async(timeout=CALL_LIMIT).add_done_callback(receive)
        answers.put(number)
        assert called.get(timeout=EVENT_LIMIT) == number


def acceptance_of_a_goal(robot: Node, tool: Node, name: str, fail: Fail) -> None:
    def accept(_: Any) -> bool:
        fail()
        return True

    ActionServer(robot, FIBONACCI, name, lambda _: {}, accept)
    client = ActionClient(tool, FIBONACCI, name)
    client.wait(EVENT_LIMIT)
    with pytest.raises(CallError, match="the handler failed: "):
        client.send(timeout=CALL_LIMIT)
    ended(client, Status.SUCCEEDED)


def action(robot: Node, tool: Node, name: str, fail: Fail) -> None:
    ActionServer(robot, FIBONACCI, name, lambda _: fail())
    carried_out_twice(tool, name)


def result_of_an_action(robot: Node, tool: Node, name: str, fail: Fail) -> None:
    results = iter([Response(fail), {}])
    ActionServer(robot, FIBONACCI, name, lambda _: next(results))
    carried_out_twice(tool, name)


def carried_out_twice(tool: Node, name: str) -> None:
    client = ActionClient(tool, FIBONACCI, name)
    client.wait(EVENT_LIMIT)
    ended(client, Status.ABORTED)
    ended(client, Status.SUCCEEDED)


def ended(client: ActionClient, status: Status) -> None:
    goal = client.send(timeout=CALL_LIMIT)
    goal.result(CALL_LIMIT)
    assert goal.status is status


def change_of_a_parameter(robot: Node, tool: Node, name: str, fail: Fail) -> None:
    parameters, name = parameters_of(robot), name.strip("/")
    parameters.declare(name, 1, on_change=lambda _: fail())
    change = [setting(name, 2, integer_value=2)]
    first, second = (ask(tool, "SetParameters", parameters=change).results[0] for _ in range(2))
    assert (first.successful, second.successful) == (False, True)
    assert first.reason.startswith(f"{name}: its change failed: ")


def changes_of_parameters(robot: Node, tool: Node, name: str, fail: Fail) -> None:
    parameters, name = parameters_of(robot), name.strip("/")
    parameters.declare(f"{name}.first", 1)
    parameters.declare(f"{name}.second", 1, on_change=lambda _: fail())
    changes = [setting(f"{name}.{each}", 2, integer_value=2) for each in ("first", "second")]
    assert not ask(tool, "SetParametersAtomically", parameters=changes).result.successful
    assert parameters[f"{name}.first"] == 1
    assert ask(tool, "SetParametersAtomically", parameters=changes).result.successful


def value_of_a_parameter(robot: Node, tool: Node, name: str, fail: Fail) -> None:
    def read() -> int:
        fail()
        return 5

    parameters, name = parameters_of(robot), name.strip("/")
    parameters.declare(f"{name}.first", 1)
    parameters.declare(f"{name}.second", 1, read=read)
    changes = [setting(f"{name}.{each}", 2, integer_value=2) for each in ("first", "second")]
    with pytest.raises(CallError, match="the handler failed: "):
        ask(tool, "SetParametersAtomically", parameters=changes)
    assert parameters[f"{name}.first"] == 1
    assert ask(tool, "GetParameters", names=[f"{name}.second"]).values[0].integer_value == 5


Place = Callable[[Node, Node, str, Fail], None]
PLACES: Final[list[Place]] = [
    topic,
    service,
    future_of_a_service,
    response_of_a_service,
    callback_of_a_call,
    acceptance_of_a_goal,
    action,
    result_of_an_action,
    change_of_a_parameter,
    changes_of_parameters,
    value_of_a_parameter,
]
NUMBERS: Final = itertools.count(1)
_parameters: dict[Node, Parameters] = {}


def parameters_of(node: Node) -> Parameters:
    if node not in _parameters:
        _parameters[node] = Parameters(node)
    return _parameters[node]


@pytest.fixture(autouse=True, scope="module")
def forgotten() -> Iterator[None]:
    """Keep no parameters of nodes that are closed."""
    yield
    _parameters.clear()


def failing_once(error: BaseException) -> Fail:
    left = [error]

    def fail() -> None:
        if left:
            raise left.pop()

    return fail


def at(place: Place, raised: str) -> Any:
    return pytest.param(place, raised, id=f"{place.__name__} {raised}")


@pytest.mark.parametrize(
    ("place", "raised"),
    cases(
        [
            *(at(place, "an exit") for place in PLACES),
            *(at(service, each) for each in RAISED if each != "an exit"),
        ],
        [at(place, each) for place in PLACES if place is not service for each in RAISED if each != "an exit"],
    ),
)
def test_whatever_user_code_raises_what_follows_is_served(
    nodes: tuple[Node, Node], caplog: pytest.LogCaptureFixture, place: Place, raised: str
) -> None:
    error = RAISED[raised]()
    place(*nodes, f"/n{next(NUMBERS)}", failing_once(error))
    until(lambda: [record.exc_info[1] for record in caplog.records if record.exc_info] == [error])


@pytest.mark.parametrize("place", [service, change_of_a_parameter], ids=lambda place: place.__name__)
def test_a_text_that_utf_8_cannot_encode_is_answered(
    nodes: tuple[Node, Node], caplog: pytest.LogCaptureFixture, place: Place
) -> None:
    caplog.set_level(logging.CRITICAL + 1, "zenoh_ros2")  # a report of a test cannot have it, either
    place(*nodes, f"/n{next(NUMBERS)}", failing_once(OSError("no file \udcff")))
