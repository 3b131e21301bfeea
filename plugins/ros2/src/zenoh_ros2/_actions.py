"""Actions: goals that take time, report feedback and can be cancelled.

An action is three services and two topics below `NAME/_action` (design.ros2.org, "Actions").
"""

from __future__ import annotations

import functools
import logging
import threading
import uuid
from collections.abc import Callable
from concurrent.futures import Future
from concurrent.futures import TimeoutError as FutureTimeoutError
from enum import IntEnum
from typing import Any, Final

from zenoh_ice.data.text import text_of

from ._endpoint import Endpoint
from ._graph import Sender
from ._node import Node
from ._services import LARGEST_COMMAND
from ._wire import QoS
from ._workers import join_all
from .exceptions import CallTimeoutError, GoalRejectedError, RosError

_STATUS: Final = QoS(durability="transient_local", depth=1)
_FEEDBACK: Final = QoS(depth=100)
_CANCEL_TIME: Final = 60.0  # s for which a goal is still cancelled if accepted after its sender gave up
_CANCELLED: Final = 0
_UNKNOWN_GOAL: Final = 2
_TERMINATED: Final = 3
"""Return codes of action_msgs/srv/CancelGoal."""
_MOST_GOALS: Final = 16  # that a server executes at a time
_MOST_ENDED: Final = 64  # goals whose results it keeps

_logger = logging.getLogger(__name__)


class Status(IntEnum):
    """State of a goal, with the numbers of action_msgs/msg/GoalStatus."""

    UNKNOWN = 0
    ACCEPTED = 1
    EXECUTING = 2
    CANCELING = 3
    SUCCEEDED = 4
    CANCELED = 5
    ABORTED = 6


class Canceled(Exception):
    """Raised by the executing function of a cancelled goal; it may have a result."""

    def __init__(self, result: object = None) -> None:
        super().__init__("the goal was cancelled")
        self.result: Final = result


class Aborted(Exception):
    """Raised by the executing function of a goal that fails; it may have a result."""

    def __init__(self, message: str = "", result: object = None) -> None:
        super().__init__(message)
        self.result: Final = result


# The client's side


class ActionClient:
    """Sends goals to an action's server."""

    def __init__(self, node: Node, type_name: str, name: str) -> None:
        """Announce the client; `Node.close` or `close` withdraws it."""
        self.node: Final = node
        self.name: Final = node.resolve(name)
        self.type_name: Final = type_name
        self._lock: Final = threading.Lock()
        self._goals: dict[bytes, Goal] = {}
        part = f"{self.name}/_action/"
        self._send = node.create_client(f"{type_name}_SendGoal", f"{part}send_goal")
        self._cancel = node.create_client("action_msgs/srv/CancelGoal", f"{part}cancel_goal")
        self._result = node.create_client(f"{type_name}_GetResult", f"{part}get_result")
        feedback, status = f"{type_name}_FeedbackMessage", "action_msgs/msg/GoalStatusArray"
        self._feedback = node.create_subscription(feedback, f"{part}feedback", self._on_feedback, _FEEDBACK)
        self._status = node.create_subscription(status, f"{part}status", self._on_status, _STATUS)

    @property
    def ready(self) -> bool:
        """Return whether a server is present."""
        return self._send.ready and self._result.ready

    def wait(self, timeout: float) -> None:
        """Wait until a server is present; raises CallTimeoutError."""
        if not self.node.discovery.wait(lambda: self.ready, timeout):
            raise CallTimeoutError(f"{self.name}: no server within {timeout:g} s")

    def send(self, goal: object = None, /, *, timeout: float = 2.0, **fields: object) -> Goal:
        """Send a goal and return it once the server has accepted it.

        Raises GoalRejectedError if it does not, MessageError for a goal that does not fit, and as calls do. A
        goal that is accepted after `timeout` s is cancelled.
        """
        types = self.node.types
        request = types.coerce(f"{self.type_name}_Goal", goal, **fields)
        sent = Goal(self, uuid.uuid4().bytes)
        with self._lock:
            self._goals[sent.id] = sent
        try:
            response = self._send.call_async(
                goal_id={"uuid": sent.id}, goal=request, timeout=timeout + _CANCEL_TIME
            )
            try:
                accepted = response.result(timeout).accepted
            except BaseException as error:  # an interrupt, too
                response.add_done_callback(functools.partial(self._cancel_late, sent))
                if isinstance(error, FutureTimeoutError):
                    raise CallTimeoutError(f"{self.name}: no response within {timeout:g} s") from error
                raise
            if not accepted:
                raise GoalRejectedError(f"{self.name}: the server rejects the goal")
            sent.follow(self._result.call_async(goal_id={"uuid": sent.id}))
        except BaseException:
            self.forget(sent)
            raise
        return sent

    def cancel(self, goal: Goal, timeout: float) -> bool:
        """Ask the server to cancel a goal; return whether it will."""
        answer = self._cancel.call(goal_info=_reference(goal), timeout=timeout)
        return any(bytes(each.goal_id.uuid) == goal.id for each in answer.goals_canceling)

    def forget(self, goal: Goal) -> None:
        """Stop routing messages to a goal."""
        with self._lock:
            self._goals.pop(goal.id, None)

    def close(self) -> None:
        """Withdraw the client; goals continue, but waits for their results fail."""
        parts: tuple[Endpoint, ...] = self._feedback, self._status, self._send, self._cancel, self._result
        for each in parts:
            each.close()

    def _cancel_late(self, goal: Goal, response: Future[Any]) -> None:
        """Cancel a goal that is accepted after its sender gave up: nobody else would stop it."""
        try:
            if response.result().accepted:
                self._cancel.call_async(goal_info=_reference(goal), timeout=_CANCEL_TIME)
        except RosError as error:
            _logger.debug("%s: %s", self.name, error)

    def _on_feedback(self, message: Any) -> None:  # noqa: ANN401
        with self._lock:
            goal = self._goals.get(bytes(message.goal_id.uuid))
        if goal is not None:
            goal.feedback = message.feedback

    def _on_status(self, message: Any) -> None:  # noqa: ANN401
        with self._lock:  # a goal that has ended is no longer here, and keeps its status
            for each in message.status_list:
                goal = self._goals.get(bytes(each.goal_info.goal_id.uuid))
                if goal is not None:
                    goal.status = _status(each.status)


class Goal:
    """A goal that a server has accepted."""

    def __init__(self, client: ActionClient, goal_id: bytes) -> None:
        self._client: Final = client
        self.id: Final = goal_id
        """Its id: 16 bytes."""
        self.status = Status.ACCEPTED
        self.feedback: Any = None
        """The newest feedback; None before the first."""
        self._future: Future[Any] = Future()

    @property
    def done(self) -> bool:
        """Return whether it has ended, successfully or not."""
        return self._future.done()

    def result(self, timeout: float = 2.0) -> Any:  # noqa: ANN401
        """Wait for its end and return its result; `status` says how it ended. Raises as calls do."""
        try:
            return self._future.result(timeout)
        except FutureTimeoutError as error:
            raise CallTimeoutError(
                f"{self._client.name}: the goal has not ended within {timeout:g} s"
            ) from error

    def cancel(self, timeout: float = 2.0) -> bool:
        """Ask the server to cancel it; return whether it will. The goal ends only with its result."""
        return not self.done and self._client.cancel(self, timeout)

    def follow(self, response: Future[Any]) -> None:
        """End with the server's answer to the request for the result."""
        response.add_done_callback(self._end)

    def _end(self, response: Future[Any]) -> None:
        self._client.forget(self)
        if (error := response.exception()) is not None:
            self.status = Status.UNKNOWN
            self._future.set_exception(error)
            return
        answer = response.result()
        self.status = _status(answer.status)
        self._future.set_result(answer.result)


# The server's side


class ServerGoal:
    """A goal from the point of view of the function that executes it."""

    def __init__(
        self,
        server: ActionServer,
        goal_id: bytes,
        request: object,
        stamp: object,
        client: Sender | None = None,
    ) -> None:
        self._server: Final = server
        self.id: Final = goal_id
        self.request: Final[Any] = request
        self.stamp: Final = stamp
        self.status = Status.ACCEPTED
        self.result: Future[Any] = Future()
        self._client: Final = client
        self._canceled: Final = threading.Event()

    @property
    def canceled(self) -> bool:
        """Return whether it is to be cancelled: in that case clean up, and raise Canceled."""
        if self._client is not None and not self._canceled.is_set() and self._client.gone:
            _logger.warning("%s: a goal is cancelled: its client is gone", self._server.name)
            self._canceled.set()
        return self._canceled.is_set()

    def wait(self, seconds: float) -> bool:
        """Wait for some seconds, or until it is to be cancelled; return whether it is."""
        self._canceled.wait(seconds)
        return self.canceled

    def publish_feedback(self, feedback: object = None, /, **fields: object) -> None:
        """Publish feedback: a message, or its fields."""
        self._server.publish_feedback(self, feedback, fields)

    def cancel(self) -> None:
        """Ask the executing function to stop."""
        self._canceled.set()


class ActionServer:
    """Executes the goals of an action, each in its own thread.

    `execute(goal)` returns the result, a message or a mapping of its fields; it raises Canceled once it has
    stopped a cancelled goal, and Aborted if it fails. Whatever else it raises aborts the goal, and is logged.
    """

    def __init__(
        self,
        node: Node,
        type_name: str,
        name: str,
        execute: Callable[[ServerGoal], object],
        accept: Callable[[Any], bool] | None = None,
        *,
        largest_goal: int = LARGEST_COMMAND,
        needs_client: bool = False,
    ) -> None:
        """Serve an action; `accept` gets each goal and returns whether it is to be executed.

        Goals of more than `largest_goal` bytes are refused. With `needs_client` a goal is cancelled when the
        client that sent it is gone.
        """
        self.node: Final = node
        self.name: Final = node.resolve(name)
        self.type_name: Final = type_name
        self._execute: Final = execute
        self._accept: Final = accept
        self._lock: Final = threading.Lock()
        self._goals: dict[bytes, ServerGoal] = {}
        self._threads: set[threading.Thread] = set()
        self._closed = False
        part = f"{self.name}/_action/"
        status = "action_msgs/msg/GoalStatusArray"
        self._feedback = node.create_publisher(f"{type_name}_FeedbackMessage", f"{part}feedback", _FEEDBACK)
        self._status = node.create_publisher(status, f"{part}status", _STATUS)
        self._cancel = node.create_service(
            "action_msgs/srv/CancelGoal", f"{part}cancel_goal", self._on_cancel
        )
        self._result = node.create_service(f"{type_name}_GetResult", f"{part}get_result", self._on_result)
        self._send = node.create_service(
            f"{type_name}_SendGoal",
            f"{part}send_goal",
            self._on_goal,
            largest=largest_goal,
            with_sender=needs_client,
        )
        node.on_close(self, self.close)

    def publish_feedback(self, goal: ServerGoal, feedback: object, fields: dict[str, object]) -> None:
        """Publish the feedback of a goal."""
        message = self.node.types.coerce(f"{self.type_name}_Feedback", feedback, **fields)
        self._feedback.publish(goal_id={"uuid": goal.id}, feedback=message)

    def close(self) -> None:
        """Cancel all goals, wait up to two seconds for their ends, and withdraw the server."""
        with self._lock:
            self._closed = True
            goals, threads = [*self._goals.values()], [*self._threads]
        for goal in goals:
            goal.cancel()
        if busy := join_all(threads):
            _logger.error("%s: %d goals are still carried out though they were cancelled", self.name, busy)
        self.node.on_close(self, None)
        parts: tuple[Endpoint, ...] = self._send, self._result, self._cancel, self._status, self._feedback
        for each in parts:
            each.close()

    def _on_goal(self, request: Any, client: Sender | None = None) -> object:  # noqa: ANN401
        goal_id, stamp = bytes(request.goal_id.uuid), self.node.now()
        refused = {"accepted": False, "stamp": stamp}
        if self._accept is not None and not self._accept(request.goal):
            return refused
        goal = ServerGoal(self, goal_id, request.goal, stamp, client)
        with self._lock:
            if self._closed or goal_id in self._goals or len(self._threads) >= _MOST_GOALS:
                return refused
            ended = [each for each, known in self._goals.items() if known.result.done()]
            for each in ended[: max(0, len(ended) - _MOST_ENDED + 1)]:
                del self._goals[each]
            self._goals[goal_id] = goal
            thread = threading.Thread(
                target=self._carry_out, args=(goal,), name=f"{self.name} goal", daemon=True
            )
            try:
                thread.start()
            except RuntimeError as error:  # at a limit of threads or memory
                _logger.error("%s: a goal is refused: %s", self.name, error)
                del self._goals[goal_id]
                return refused
            self._threads.add(thread)  # it needs the lock to end
        return {"accepted": True, "stamp": stamp}

    def _carry_out(self, goal: ServerGoal) -> None:
        """Execute a goal and end it, whatever is raised: not even SystemExit leaves its client waiting."""
        self._set(goal, Status.EXECUTING)
        try:
            status, message = self._outcome(goal)
        except BaseException:
            _logger.exception("%s: carrying out a goal failed", self.name)
            status, message = Status.ABORTED, self.node.types.make(f"{self.type_name}_Result")
        with self._lock:
            self._threads.discard(threading.current_thread())
        goal.result.set_result({"status": int(status), "result": message})
        self._set(goal, status)

    def _outcome(self, goal: ServerGoal) -> tuple[Status, Any]:
        """Execute a goal; return how it ends and its result.

        Raises what user code raises, and MessageError for what is no result.
        """
        status, result = Status.SUCCEEDED, None
        try:
            result = self._execute(goal)
        except Canceled as canceled:
            status, result = Status.CANCELED, canceled.result
        except Aborted as aborted:
            _logger.warning("%s: a goal is aborted: %s", self.name, text_of(aborted))
            status, result = Status.ABORTED, aborted.result
        message = self.node.types.coerce(f"{self.type_name}_Result", result)
        self.node.types.encode(message)  # now: later, its client would get neither a result nor a status
        return status, message

    def _on_cancel(self, request: Any) -> object:  # noqa: ANN401
        """Cancel the goal with an id, and those up to a time; all if neither is given."""
        info = request.goal_info
        wanted, stamp = bytes(info.goal_id.uuid), (info.stamp.sec, info.stamp.nanosec)
        with self._lock:
            running = [each for each in self._goals.values() if not each.result.done()]
            known = wanted in self._goals
        anyone, timed = not any(wanted), stamp != (0, 0)
        chosen = [
            each for each in running if each.id == wanted or (_time(each.stamp) <= stamp if timed else anyone)
        ]
        for each in chosen:
            self._set(each, Status.CANCELING)
            each.cancel()
        code = _CANCELLED
        if not chosen and not anyone:
            code = _TERMINATED if known else _UNKNOWN_GOAL
        return {"return_code": code, "goals_canceling": [_info(each) for each in chosen]}

    def _on_result(self, request: Any) -> object:  # noqa: ANN401
        with self._lock:
            goal = self._goals.get(bytes(request.goal_id.uuid))
        return goal.result if goal is not None else {"status": int(Status.UNKNOWN)}

    def _set(self, goal: ServerGoal, status: Status) -> None:
        with self._lock:
            if goal.status >= status:  # cancelled before it began, or ended meanwhile
                return
            goal.status = status
            listed = [{"goal_info": _info(each), "status": int(each.status)} for each in self._goals.values()]
        try:
            self._status.publish(status_list=listed)
        except RosError as error:
            _logger.debug("%s: %s", self.name, error)


def _status(number: int) -> Status:
    return Status(number) if 0 <= number <= Status.ABORTED else Status.UNKNOWN


def _reference(goal: Goal) -> dict[str, object]:
    """Return the fields of an action_msgs/msg/GoalInfo by which a client names one goal."""
    return {"goal_id": {"uuid": goal.id}}


def _time(stamp: Any) -> tuple[int, int]:  # noqa: ANN401
    return stamp.sec, stamp.nanosec


def _info(goal: ServerGoal) -> dict[str, object]:
    return {"goal_id": {"uuid": goal.id}, "stamp": goal.stamp}
