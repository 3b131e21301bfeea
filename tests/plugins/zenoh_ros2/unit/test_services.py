"""Services and clients of real nodes on loopback."""

from __future__ import annotations

import threading
from concurrent.futures import Future
from queue import SimpleQueue
from typing import Any

import pytest

from tests.support.limits import CALL_LIMIT, EVENT_LIMIT
from tests.support.ros_nodes import DOMAIN, two_nodes
from zenoh_ice.objects import callbacks
from zenoh_ros2 import CallError, CallTimeoutError, Node, NodeClosedError
from zenoh_ros2._wire import Attachment, key

ADD = "example_interfaces/srv/AddTwoInts"


def unanswered(robot: Node, answer: Future[object]) -> threading.Event:
    """Serve /add with a later answer; return what is set when it is asked."""
    asked = threading.Event()

    def handle(_: Any) -> Future[object]:
        asked.set()
        return answer

    robot.create_service(ADD, "/add", handle)
    return asked


def test_a_service_is_called() -> None:
    with two_nodes() as (robot, tool):
        robot.create_service(ADD, "/add", lambda request: {"sum": request.a + request.b})
        client = tool.create_client(ADD, "/add")
        client.wait(EVENT_LIMIT)
        assert client.call(a=40, b=2, timeout=CALL_LIMIT).sum == 42
        assert client.call_async({"a": 1, "b": 2}).result(CALL_LIMIT).sum == 3


def test_what_a_callback_of_a_response_raises_is_told_to_who_watches(monkeypatch: pytest.MonkeyPatch) -> None:
    failures: SimpleQueue[BaseException] = SimpleQueue()
    monkeypatch.setattr(callbacks, "failure_watchers", [failures.put])
    with two_nodes() as (robot, tool):
        robot.create_service(ADD, "/add", lambda request: {"sum": request.a + request.b})
        client = tool.create_client(ADD, "/add")
        client.wait(EVENT_LIMIT)
        client.call_async(a=1, b=2).add_done_callback(lambda response: response.result().product)
        assert "product" in str(failures.get(timeout=EVENT_LIMIT))


def test_a_service_may_answer_later() -> None:
    with two_nodes() as (robot, tool):
        later: Future[object] = Future()
        asked = unanswered(robot, later)
        client = tool.create_client(ADD, "/add")
        client.wait(EVENT_LIMIT)
        response = client.call_async(a=1, b=1)
        assert asked.wait(EVENT_LIMIT)
        assert not response.done()
        later.set_result({"sum": 7})
        assert response.result(CALL_LIMIT).sum == 7


@pytest.mark.parametrize(
    ("handler", "why"),
    [
        (lambda _: 1 // 0, "the handler failed: ZeroDivisionError"),
        (lambda _: {"sum": "much"}, r"AddTwoInts_Response\.sum: a whole number"),
        (lambda _: 5, "this is a int"),
    ],
)
def test_a_failing_service_is_an_error_of_its_caller(handler: Any, why: str) -> None:
    with two_nodes() as (robot, tool):
        robot.create_service(ADD, "/add", handler)
        client = tool.create_client(ADD, "/add")
        client.wait(EVENT_LIMIT)
        with pytest.raises(CallError, match=why):
            client.call(a=1, b=2, timeout=CALL_LIMIT)


def test_a_malformed_request_is_refused_and_counted() -> None:
    with two_nodes() as (robot, tool):
        service = robot.create_service(ADD, "/add", lambda request: {"sum": request.a})
        client = tool.create_client(ADD, "/add")
        client.wait(EVENT_LIMIT)
        place = key(DOMAIN, "/add", ADD, tool.types.hash(ADD))
        attached = Attachment(1, 0, bytes(16)).encode()
        for payload, attachment in ((b"\0\1\0\0xy", attached), (bytes(20), None), (bytes(5 << 20), attached)):
            replies = [*tool.session.get(place, payload=payload, attachment=attachment, timeout=CALL_LIMIT)]
            assert [each.ok for each in replies] == [None]
        assert service.malformed == 3
        assert client.call(a=1, b=2, timeout=CALL_LIMIT).sum == 1


def test_calls_without_a_server_end() -> None:
    with two_nodes() as (_, tool):
        client = tool.create_client(ADD, "/nowhere")
        with pytest.raises(CallError, match="/nowhere: there is no server"):
            client.call(timeout=CALL_LIMIT)
        with pytest.raises(CallTimeoutError, match=r"/nowhere: no server within 0\.05 s"):
            client.wait(0.05)


def test_a_call_ends_when_its_limit_has_passed_and_when_the_node_closes() -> None:
    with two_nodes() as (robot, tool):
        never: Future[object] = Future()
        robot.create_service(ADD, "/add", lambda _: never)
        client = tool.create_client(ADD, "/add")
        client.wait(EVENT_LIMIT)
        with pytest.raises(CallTimeoutError, match="/add: no response"):
            client.call(timeout=0.2)
        pending = client.call_async()
        tool.close()
        with pytest.raises(NodeClosedError, match="closed during the call"):
            pending.result(CALL_LIMIT)
        never.cancel()


def test_a_call_ends_with_its_server() -> None:
    with two_nodes() as (robot, tool):
        asked = unanswered(robot, Future())
        client = tool.create_client(ADD, "/add")
        client.wait(EVENT_LIMIT)
        pending = client.call_async()
        assert asked.wait(EVENT_LIMIT)
        robot.close()
        with pytest.raises(CallError):
            pending.result(CALL_LIMIT)


def test_the_first_of_two_servers_answers_a_call() -> None:
    with two_nodes() as (robot, tool):
        silent: Future[object] = Future()
        asked = unanswered(robot, silent)
        tool.create_service(ADD, "/add", lambda request: {"sum": request.a + request.b})
        client = tool.create_client(ADD, "/add")
        assert tool.graph.wait(lambda: len(tool.graph.entities("SS", "/add")) == 2, EVENT_LIMIT)
        assert client.call_async(a=1, b=2).result(CALL_LIMIT).sum == 3
        assert client.call(a=2, b=2, timeout=CALL_LIMIT).sum == 4
        assert asked.wait(EVENT_LIMIT)
        assert not silent.done()
        silent.set_result({})


def test_a_call_that_its_caller_gave_up_ends_no_thread(caplog: pytest.LogCaptureFixture) -> None:
    with two_nodes() as (robot, tool):
        answer: Future[object] = Future()
        asked = unanswered(robot, answer)
        client = tool.create_client(ADD, "/add")
        client.wait(EVENT_LIMIT)
        future = client.call_async(a=1, b=2)
        assert asked.wait(EVENT_LIMIT)
        assert future.cancel()
        answer.set_result({"sum": 3})
        assert client.call_async(a=1, b=2).result(CALL_LIMIT).sum == 3
    assert "failed" not in caplog.text
