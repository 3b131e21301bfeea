"""The ROS of a test, in virtual time: the test publishes, answers, carries out goals, and sees what was sent.

Messages are encoded and decoded as on the wire, immediately and on the calling thread.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Callable, Mapping
from concurrent.futures import Future
from typing import Any, Final, TypeVar

from hfsm_runtime.errors import describe
from hfsm_runtime.kinds import Called
from hfsm_runtime.virtual.errors import UnknownName, says_it_all
from zenoh_ice import Sample
from zenoh_ice.objects.callbacks import CallFuture
from zenoh_ros2 import CallError, CallTimeoutError, GoalRejectedError, QoS, RosError, Status, Types

from ._ends import Endpoints
from .names import Ros

__tracebackhide__ = says_it_all

_T = TypeVar("_T", "Topic", "Service", "Action")
Answer = Callable[[Any], object]

_logger = logging.getLogger(__name__)


class FakeRos(Endpoints):
    """All topics, services and actions that a behavior uses, by their ROS names.

    `now` returns the time in s, and `wait` lets time pass until a condition holds or a limit in s is over. A
    service without an answer has no server; with `stand_ins` it answers with zeros and empty values.
    """

    def __init__(
        self,
        now: Callable[[], float],
        wait: Callable[[Callable[[], bool], float], bool],
        called: Called = lambda *_: None,
        *,
        stand_ins: bool = False,
    ) -> None:
        self.types: Final = Types()
        super().__init__(self.make_end, self.types)
        self.now: Final = now
        self.wait: Final = wait
        self.called: Final = called
        self.stand_ins: Final = stand_ins
        self._known: Final[dict[tuple[type[_Used], str], Any]] = {}

    def topic(self, name: str) -> Topic:
        """Return a topic; raises UnknownName for one that the behavior does not use."""
        return self._find(Topic, name)

    def service(self, name: str, answer: Answer | None = None) -> Service:
        """Return a service of the behavior; an `answer` is its response from now on.

        The answer is a function of the request that returns a response or a mapping of its fields. If it
        raises an exception, the call fails as at a real server: with CallError, or the RosError that it is.
        """
        found = self._find(Service, name)
        found.answer = answer or found.answer
        return found

    def action(self, name: str, accept: Callable[[Any], bool] = lambda _goal: True) -> Action:
        """Return an action of the behavior, which has a server from now on."""
        found = self._find(Action, name)
        found.accept = accept
        return found

    def make_end(self, declared: Ros, _qos: QoS, /) -> _Used | _Publisher:
        """Return what the behavior uses."""
        kind, name = _KINDS.get(declared.kind, Topic), _full(declared.target)
        used = self._known.setdefault((kind, name), kind(self, name, declared.type))
        return _Publisher(used) if declared.kind == "publish" else used

    def _find(self, kind: type[_T], name: str) -> _T:
        found: _T | None = self._known.get((kind, _full(name)))
        if found is None:
            names = ", ".join(known for each, known in self._known if each is kind) or "none"
            raise UnknownName(f"the behavior uses no {kind.__name__.lower()} {name!r}; there are {names}")
        return found


def _full(name: str) -> str:
    return name if name.startswith("/") else f"/{name.removeprefix('~/')}"


class _Used:
    """What a behavior uses of ROS."""

    def __init__(self, ros: FakeRos, name: str, type_name: str) -> None:
        self._ros: Final = ros
        self.name: Final = name
        self.type_name: Final = type_name

    def arrived(self, part: str, message: Any, /, **fields: object) -> Any:  # noqa: ANN401
        """Return a message, or one with the given fields, as its receiver gets it; raises MessageError.

        `part` is the end of the name of its type.
        """
        name, types = f"{self.type_name}{part}", self._ros.types
        return types.decode(types.encode(types.coerce(name, message, **fields)), name)


class Topic(_Used):
    """A topic; `messages` are all that were published, by the behavior or the test."""

    def __init__(self, ros: FakeRos, name: str, type_name: str) -> None:
        super().__init__(ros, name, type_name)
        self.messages: Final[list[Any]] = []
        self._count = 0
        self._newest: Sample[Any] | None = None

    def publish(self, message: Any = None, /, **fields: object) -> None:  # noqa: ANN401
        """Publish a message, or one with the given fields."""
        at = self._ros.now()
        arrived = self.arrived("", message, **fields)
        self.messages.append(arrived)
        if self._ros.stand_ins:  # nobody reads their messages, perhaps for hours
            del self.messages[:-1]
        self._count += 1
        self._newest = Sample(arrived, self._count, math.nan, at, _age=lambda: self._ros.now() - at)

    def latest(self) -> Sample[Any] | None:
        """Return the newest sample, None before the first."""
        return self._newest

    def next(self, timeout: float) -> Sample[Any]:
        """Wait for the next sample that arrives."""
        seen = self._count
        if not self._ros.wait(lambda: self._count > seen, timeout):
            raise CallTimeoutError(f"{self.name}: no message within {timeout:g} s")
        assert self._newest is not None
        return self._newest


class _Publisher:
    """The publishing end of a topic, whose messages are calls of the behavior."""

    def __init__(self, topic: Topic) -> None:
        self._topic: Final = topic

    subscribers = 1

    def publish(self, message: Any, /) -> None:  # noqa: ANN401
        """Publish a message."""
        self._topic.publish(message)
        self._topic._ros.called(f"{self._topic.name}.publish", _fields(self._topic.messages[-1]), None, None)


class Service(_Used):
    """A service; `requests` are the requests of the behavior."""

    def __init__(self, ros: FakeRos, name: str, type_name: str) -> None:
        super().__init__(ros, name, type_name)
        self.requests: Final[list[Any]] = []
        self.answer: Answer | None = (lambda _request: {}) if ros.stand_ins else None

    def wait(self, timeout: float) -> None:
        """Wait until the test provides an answer."""
        if not self._ros.wait(lambda: self.answer is not None, timeout):
            raise CallTimeoutError(
                f"{self.name}: no server within {timeout:g} s: give ros.service() an answer"
            )

    def call(self, request: Any, /, *, timeout: float) -> Any:  # noqa: ANN401
        """Return the response of the test."""
        response, error = None, None
        try:
            self.wait(timeout)
            assert self.answer is not None
            arrived = self.arrived("_Request", request)
            if not self._ros.stand_ins:
                self.requests.append(arrived)
            response = self.arrived("_Response", _served(self.name, self.answer, arrived))
        except RosError as raised:
            error = raised
            raise
        finally:
            self._ros.called(f"{self.name}.call", _fields(request), response, error)
        return response

    def call_async(self, request: Any, /) -> Future[Any]:  # noqa: ANN401
        """Return a completed future with the response of the test."""
        future: Future[Any] = CallFuture()
        try:
            future.set_result(self.call(request, timeout=0.0))
        except RosError as error:
            future.set_exception(error)
        return future


class Action(_Used):
    """An action; `goals` are the accepted goals of the behavior."""

    def __init__(self, ros: FakeRos, name: str, type_name: str) -> None:
        super().__init__(ros, name, type_name)
        self.goals: Final[list[FakeGoal]] = []
        self.accept: Callable[[Any], bool] | None = (lambda _goal: True) if ros.stand_ins else None

    def send(self, goal: Any, /, *, timeout: float) -> FakeGoal:  # noqa: ANN401
        """Accept a goal; the test carries it out."""
        sent = FakeGoal(self._ros, self, self.arrived("_Goal", goal))
        error: RosError | None = None
        try:
            if not self._ros.wait(lambda: self.accept is not None, timeout):
                raise CallTimeoutError(
                    f"{self.name}: no server within {timeout:g} s: take it by ros.action()"
                )
            if self.accept is not None and not _served(self.name, self.accept, sent.request):
                raise GoalRejectedError(f"{self.name}: the goal was rejected")
        except RosError as raised:
            error = raised
            raise
        finally:
            self._ros.called(f"{self.name}.send", _fields(goal), None, error)
        if self._ros.stand_ins:
            sent.succeed()
        else:
            self.goals.append(sent)
        return sent


class FakeGoal:
    """A goal of the behavior, which the test carries out."""

    def __init__(self, ros: FakeRos, action: Action, request: Any) -> None:  # noqa: ANN401
        self._ros: Final = ros
        self._action: Final = action
        self._result: Any = None
        self.request: Final = request
        self.status = Status.EXECUTING
        self.feedback: Any = None

    def publish_feedback(self, feedback: Any = None, /, **fields: object) -> None:  # noqa: ANN401
        """Send the behavior feedback: a message, or one with the given fields."""
        self.feedback = self._action.arrived("_Feedback", feedback, **fields)

    def succeed(self, result: Any = None, /, **fields: object) -> None:  # noqa: ANN401
        """End the goal with success."""
        self._end(Status.SUCCEEDED, result, **fields)

    def abort(self, result: Any = None, /, **fields: object) -> None:  # noqa: ANN401
        """End the goal without success."""
        self._end(Status.ABORTED, result, **fields)

    @property
    def done(self) -> bool:
        """Whether it has ended."""
        return self._result is not None

    def result(self, timeout: float = 2.0) -> Any:  # noqa: ANN401
        """Wait for the end, and return the result."""
        if not self._ros.wait(lambda: self.done, timeout):
            raise CallTimeoutError(f"{self._action.name}: the goal did not end within {timeout:g} s")
        return self._result

    def cancel(self, timeout: float = 2.0) -> bool:  # noqa: ARG002
        """Cancel the goal immediately."""
        self._ros.called(f"{self._action.name}.cancel", {}, None, None)
        if not self.done:
            self._end(Status.CANCELED, None)
        return True

    def _end(self, status: Status, result: Any, /, **fields: object) -> None:  # noqa: ANN401
        self._result, self.status = self._action.arrived("_Result", result, **fields), status


_KINDS: Final[Mapping[str, type[Topic | Service | Action]]] = {"service": Service, "action": Action}
"""What is no topic."""


def _served(name: str, serve: Callable[[Any], object], sent: object) -> object:
    """Return what a function of the test makes of a message; if it fails, so does the call, as at a server.

    What ends the code that waits, or the test, passes.
    """
    try:
        return serve(sent)
    except RosError:
        raise
    except (Exception, SystemExit) as error:
        _logger.error("%s: its handler failed", name, exc_info=error)
        raise CallError(f"{name}: the handler failed: {describe(error)}") from error


def _fields(message: Any) -> dict[str, Any]:  # noqa: ANN401
    return {name: value for name, value in vars(message).items() if not name.startswith("_")}
