"""Goals, feedback and cancelling between two nodes."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Callable
from typing import Any

import pytest

from plugins.ros2.tests.support.ros_nodes import two_nodes
from tests.support.limits import CALL_LIMIT, EVENT_LIMIT
from tests.support.waiting import until
from zenoh_ros2 import (
    LATCHED,
    Aborted,
    ActionClient,
    ActionServer,
    CallTimeoutError,
    Canceled,
    GoalRejectedError,
    Node,
    ServerGoal,
    Status,
    Types,
)

pytestmark = pytest.mark.slow

FIBONACCI = "example_interfaces/action/Fibonacci"


def fibonacci(goal: ServerGoal) -> dict[str, list[int]]:
    sequence = [0, 1]
    while len(sequence) < goal.request.order:
        sequence.append(sequence[-1] + sequence[-2])
        goal.publish_feedback(sequence=sequence)
        if goal.wait(0.001):
            raise Canceled({"sequence": sequence})
    return {"sequence": sequence}


Pair = tuple[Node, Node]


def serve(nodes: Pair, name: str, execute: Any, accept: Any = None) -> ActionClient:
    """Serve an action at the robot; return a client of it at the tool."""
    robot, tool = nodes
    ActionServer(robot, FIBONACCI, name, execute, accept)
    client = ActionClient(tool, FIBONACCI, name)
    client.wait(EVENT_LIMIT)
    return client


def test_a_goal_succeeds(nodes: Pair, name: str) -> None:
    goal = serve(nodes, name, fibonacci).send(order=6, timeout=CALL_LIMIT)
    assert goal.result(CALL_LIMIT).sequence.tolist() == [0, 1, 1, 2, 3, 5]
    assert (goal.status, goal.done) == (Status.SUCCEEDED, True)
    assert not goal.cancel()


def report(goal: ServerGoal) -> None:
    while not goal.wait(0.001):
        goal.publish_feedback(sequence=[0, 1, 1])
    raise Canceled({"sequence": [0, 1]})


def test_a_goal_reports_as_soon_as_its_server_has_found_who_listens(nodes: Pair, name: str) -> None:
    goal = serve(nodes, name, report).send(order=6, timeout=CALL_LIMIT)
    until(lambda: goal.feedback is not None)
    assert goal.feedback.sequence.tolist() == [0, 1, 1]
    assert goal.cancel(CALL_LIMIT)


def test_a_goal_is_cancelled(nodes: Pair, name: str) -> None:
    goal = serve(nodes, name, fibonacci).send(order=40_000, timeout=CALL_LIMIT)
    with pytest.raises(CallTimeoutError, match=f"{name}: the goal has not ended"):
        goal.result(0.01)
    assert goal.cancel(CALL_LIMIT)
    assert len(goal.result(CALL_LIMIT).sequence) >= 2
    assert goal.status is Status.CANCELED


def test_a_goal_is_rejected(nodes: Pair, name: str) -> None:
    client = serve(nodes, name, fibonacci, lambda request: request.order < 10)
    with pytest.raises(GoalRejectedError, match=f"{name}: the server rejects the goal"):
        client.send(order=10, timeout=CALL_LIMIT)


def abort(_: ServerGoal) -> None:
    raise Aborted("no way there", {"sequence": [7]})


def fail(_: ServerGoal) -> None:
    raise RuntimeError("a fault")


def answer_wrongly(_: ServerGoal) -> dict[str, list[str]]:
    return {"sequence": ["a"]}


def answer_with_a_wrong_message(_: ServerGoal) -> Any:
    message = Types().make(f"{FIBONACCI}_Result")
    message.sequence = ["a"]
    return message


@pytest.mark.parametrize(
    ("execute", "sequence"),
    [(abort, [7]), (fail, []), (answer_wrongly, []), (answer_with_a_wrong_message, [])],
)
def test_a_goal_that_cannot_be_carried_out_is_aborted(
    nodes: Pair, name: str, execute: Callable[[ServerGoal], Any], sequence: list[int]
) -> None:
    goal = serve(nodes, name, execute).send(timeout=CALL_LIMIT)
    assert goal.result(CALL_LIMIT).sequence.tolist() == sequence
    assert goal.status is Status.ABORTED


def test_a_server_that_ends_cancels_its_goals(nodes: Pair, name: str) -> None:
    canceled = []

    def execute(goal: ServerGoal) -> None:
        if goal.wait(CALL_LIMIT):
            canceled.append(goal)
            raise Canceled

    robot, tool = nodes
    server = ActionServer(robot, FIBONACCI, name, execute)
    client = ActionClient(tool, FIBONACCI, name)
    client.wait(EVENT_LIMIT)
    goal = client.send(timeout=CALL_LIMIT)
    client.send(timeout=CALL_LIMIT)  # comes after the request for the result of the first
    server.close()
    assert len(canceled) == 2
    assert goal.result(CALL_LIMIT) is not None
    assert goal.status is Status.CANCELED


class Late:
    """An action that is accepted late, and says when its goal is cancelled."""

    def __init__(self) -> None:
        self.accepted, self.canceled = threading.Event(), threading.Event()

    def execute(self, goal: ServerGoal) -> None:
        if goal.wait(CALL_LIMIT):
            self.canceled.set()
            raise Canceled


def test_a_goal_that_is_accepted_too_late_is_cancelled(nodes: Pair, name: str) -> None:
    late = Late()
    client = serve(nodes, name, late.execute, lambda _: late.accepted.wait(CALL_LIMIT))
    with pytest.raises(CallTimeoutError):
        client.send(timeout=0.05)
    late.accepted.set()
    assert late.canceled.wait(EVENT_LIMIT)


def test_a_goal_whose_sender_is_interrupted_is_cancelled(nodes: Pair, name: str) -> None:
    late, sender = Late(), threading.get_ident()

    def accept(_: object) -> bool:
        until(lambda: sys._current_frames()[sender].f_code is threading.Condition.wait.__code__)
        signal.pthread_kill(sender, signal.SIGINT)
        return late.accepted.wait(CALL_LIMIT)

    client = serve(nodes, name, late.execute, accept)
    with pytest.raises(KeyboardInterrupt):
        client.send(timeout=CALL_LIMIT)
    late.accepted.set()
    assert late.canceled.wait(EVENT_LIMIT)


def test_the_statuses_of_all_goals_are_published_for_late_joiners(nodes: Pair, name: str) -> None:
    serve(nodes, name, fibonacci).send(order=3, timeout=CALL_LIMIT).result(CALL_LIMIT)
    ended = threading.Event()

    def receive(message: Any) -> None:
        if [each.status for each in message.status_list] == [Status.SUCCEEDED]:
            ended.set()

    nodes[1].create_subscription(
        "action_msgs/msg/GoalStatusArray", f"{name}/_action/status", receive, LATCHED
    )
    assert ended.wait(EVENT_LIMIT)


def test_a_cancel_request_may_name_a_goal_and_a_time() -> None:
    times = iter(range(10_000_000_000, 10**12, 10_000_000_000))
    with two_nodes(clock=lambda: next(times)) as nodes:
        client = serve(nodes, "/fib", lambda goal: goal.wait(CALL_LIMIT) and fibonacci(goal))
        first, second, third = (client.send(timeout=CALL_LIMIT) for _ in range(3))  # at 10, 20 and 30 s
        cancel = nodes[1].create_client("action_msgs/srv/CancelGoal", "/fib/_action/cancel_goal")
        info = {"goal_id": {"uuid": third.id}, "stamp": {"sec": 15}}
        answer = cancel.call(goal_info=info, timeout=CALL_LIMIT)
        assert [bytes(each.goal_id.uuid) for each in answer.goals_canceling] == [first.id, third.id]
        assert not second.done


def test_an_unknown_goal_cannot_be_cancelled(nodes: Pair, name: str) -> None:
    serve(nodes, name, fibonacci)
    cancel = nodes[1].create_client("action_msgs/srv/CancelGoal", f"{name}/_action/cancel_goal")
    cancel.wait(EVENT_LIMIT)
    answer = cancel.call(goal_info={"goal_id": {"uuid": [1] * 16}}, timeout=CALL_LIMIT)
    assert (answer.return_code, answer.goals_canceling) == (2, [])
    result = nodes[1].create_client(f"{FIBONACCI}_GetResult", f"{name}/_action/get_result")
    assert result.call(goal_id={"uuid": [1] * 16}, timeout=CALL_LIMIT).status == Status.UNKNOWN
