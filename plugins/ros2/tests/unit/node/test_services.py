"""Services and clients of real nodes on loopback."""

from __future__ import annotations

import threading
from concurrent.futures import Future
from queue import SimpleQueue
from typing import Any

import pytest

from plugins.ros2.tests.support.ros_nodes import two_nodes
from tests.support.limits import CALL_LIMIT, EVENT_LIMIT
from zenoh_ice.objects import callbacks
from zenoh_ros2 import CallError, CallTimeoutError, Client, Node, NodeClosedError

pytestmark = pytest.mark.slow

ADD = "example_interfaces/srv/AddTwoInts"
Pair = tuple[Node, Node]


def add(request: Any) -> dict[str, int]:
    return {"sum": request.a + request.b}


def serve(nodes: Pair, name: str, handler: Any) -> Client:
    """Serve additions at the robot; return a client of it at the tool."""
    robot, tool = nodes
    robot.create_service(ADD, name, handler)
    client = tool.create_client(ADD, name)
    client.wait(EVENT_LIMIT)
    return client


class Unanswered:
    """Answers later, and says when it is asked."""

    def __init__(self) -> None:
        self.answer: Future[object] = Future()
        self.asked = threading.Event()

    def __call__(self, _: Any) -> Future[object]:
        self.asked.set()
        return self.answer


def test_a_service_is_called(nodes: Pair, name: str) -> None:
    client = serve(nodes, name, add)
    assert client.call(a=40, b=2, timeout=CALL_LIMIT).sum == 42
    assert client.call_async({"a": 1, "b": 2}).result(CALL_LIMIT).sum == 3


def test_what_a_callback_of_a_response_raises_is_told_to_who_watches(
    nodes: Pair, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    failures: SimpleQueue[BaseException] = SimpleQueue()
    monkeypatch.setattr(callbacks, "failure_watchers", [failures.put])
    client = serve(nodes, name, add)
    client.call_async(a=1, b=2).add_done_callback(lambda response: response.result().product)
    assert "product" in str(failures.get(timeout=EVENT_LIMIT))


def test_a_service_may_answer_later(nodes: Pair, name: str) -> None:
    later = Unanswered()
    response = serve(nodes, name, later).call_async(a=1, b=1)
    assert later.asked.wait(EVENT_LIMIT)
    assert not response.done()
    later.answer.set_result({"sum": 7})
    assert response.result(CALL_LIMIT).sum == 7


@pytest.mark.parametrize(
    ("handler", "why"),
    [
        (lambda _: 1 // 0, "the handler failed: ZeroDivisionError"),
        (lambda _: {"sum": "much"}, r"AddTwoInts_Response\.sum: a whole number"),
        (lambda _: 5, "this is a int"),
    ],
)
def test_a_failing_service_is_an_error_of_its_caller(nodes: Pair, name: str, handler: Any, why: str) -> None:
    with pytest.raises(CallError, match=why):
        serve(nodes, name, handler).call(a=1, b=2, timeout=CALL_LIMIT)


def test_calls_without_a_server_end(nodes: Pair) -> None:
    client = nodes[1].create_client(ADD, "/nowhere")
    with pytest.raises(CallError, match="/nowhere: there is no server"):
        client.call(timeout=CALL_LIMIT)
    with pytest.raises(CallTimeoutError, match=r"/nowhere: no server within 0\.05 s"):
        client.wait(0.05)


def test_a_call_ends_when_its_limit_has_passed_and_when_the_node_closes() -> None:
    with two_nodes() as nodes:
        never = Unanswered()
        client = serve(nodes, "/add", never)
        with pytest.raises(CallTimeoutError, match="/add: no response"):
            client.call(timeout=0.2)
        pending = client.call_async()
        nodes[1].close()
        with pytest.raises(NodeClosedError, match="closed during the call"):
            pending.result(CALL_LIMIT)
        never.answer.cancel()


def test_a_call_ends_with_its_server() -> None:
    with two_nodes() as nodes:
        never = Unanswered()
        pending = serve(nodes, "/add", never).call_async()
        assert never.asked.wait(EVENT_LIMIT)
        nodes[0].close()
        with pytest.raises(CallError):
            pending.result(CALL_LIMIT)


def test_the_first_of_two_servers_answers_a_call(nodes: Pair, name: str) -> None:
    tool, silent = nodes[1], Unanswered()
    tool.create_service(ADD, name, add)
    client = serve(nodes, name, silent)
    assert tool.graph.wait(lambda: len(tool.graph.entities("SS", name)) == 2, EVENT_LIMIT)
    assert client.call_async(a=1, b=2).result(CALL_LIMIT).sum == 3
    assert client.call(a=2, b=2, timeout=CALL_LIMIT).sum == 4
    assert silent.asked.wait(EVENT_LIMIT)
    assert not silent.answer.done()
    silent.answer.set_result({})


def test_a_call_that_its_caller_gave_up_ends_no_thread(
    nodes: Pair, name: str, caplog: pytest.LogCaptureFixture
) -> None:
    later = Unanswered()
    client = serve(nodes, name, later)
    future = client.call_async(a=1, b=2)
    assert later.asked.wait(EVENT_LIMIT)
    assert future.cancel()
    later.answer.set_result({"sum": 3})
    assert client.call_async(a=1, b=2).result(CALL_LIMIT).sum == 3
    assert "failed" not in caplog.text
