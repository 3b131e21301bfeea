"""A component's topics, services and actions of ROS 2, as user code sees them.

Each has an end: at a node of ROS, or in the ROS of a test. All that user code does passes through `Used.do`,
where a recording writes down what the end gives, and a replay, which has no ends, answers in its place.
"""

from __future__ import annotations

import functools
import logging
import time
from collections.abc import Callable, Container, Iterator, Mapping, Sequence
from concurrent.futures import Future
from typing import Any, Final, Protocol, TypeVar

import zenoh_ros2
from hfsm_runtime.component import Component, type_texts_of
from hfsm_runtime.errors import ComponentError
from zenoh_ice import Sample, ZenohIceError
from zenoh_ros2 import Node, QoS, RosError, Status, Types

from ._declared import Ros, ros_of

_LIMIT: Final = 0.5
"""The longest wait in wall seconds for all goals of a component to be cancelled."""
_LEAST: Final = 0.05
"""The wait for each, however many there are."""

_logger = logging.getLogger(__name__)

_T = TypeVar("_T")


class Do(Protocol):
    """Let a function do something at an end, or answer in its place.

    `name` is that of the method. `gives` says what comes of it: the end of the name of a message's type;
    Sample, Goal or Future; None for nothing; or a number, the one that holds while none is known. `sent` is
    the message that is sent, and `timeout` the longest wait in s.
    """

    def __call__(
        self,
        name: str,
        act: Callable[[], _T],
        gives: object = None,
        /,
        *,
        sent: object = None,
        timeout: float | None = None,
    ) -> _T: ...


MakeEnd = Callable[[Ros, QoS], Any]
"""Make the end that a component declares; it behaves as one that `make_end` makes."""


def make_end(node: Node, declared: Ros, qos: QoS) -> Any:  # noqa: ANN401
    """Announce what a component declares. Raises RosError."""
    match declared.kind:
        case "publish":
            return node.create_publisher(declared.type, declared.target, qos)
        case "subscribe":
            return node.create_subscription(declared.type, declared.target, qos=qos)
        case "service":
            return node.create_client(declared.type, declared.target)
        case _:
            return zenoh_ros2.ActionClient(node, declared.type, declared.target)


class Used:
    """A topic, service or action of a component."""

    _part = ""
    """The end of the name of the type of what is sent."""

    def __init__(self, end: Any, types: Types, declared: Ros) -> None:  # noqa: ANN401
        self.end = end
        self.types: Final = types
        self.declared: Final = declared
        self.do: Do = directly
        self._make: Final[Callable[..., Any]] = functools.partial(types.coerce, declared.type + self._part)

    def _hfsm_stops(self) -> Iterator[Callable[[float], object]]:
        """Yield functions that stop what was begun, each within some s."""
        yield from ()


def directly(_name: str, act: Callable[[], _T], *_: object, **_more: object) -> _T:
    """Do something at an end."""
    return act()


class Publisher(Used):
    """A topic that the component publishes."""

    end: zenoh_ros2.Publisher
    _is_driving = False

    @property
    def subscribers(self) -> int:
        """The current number of subscribers."""
        return self.do("subscribers", lambda: self.end.subscribers, 0)

    def publish(self, message: Any = None, /, **fields: object) -> None:  # noqa: ANN401
        """Publish a message, or one with the given fields: the others are zero. Raises MessageError."""
        whole = self._make(message, **fields)
        self._is_driving = True  # set first: a stop may arrive during the publication
        self._send(whole)

    def _hfsm_stops(self) -> Iterator[Callable[[float], object]]:
        """Yield a function that publishes a default message, if that stops an earlier one."""
        if self.declared.stop and self._is_driving:
            self._is_driving = False
            yield lambda _limit: self._send(self._make(None))

    def _send(self, message: Any) -> None:  # noqa: ANN401
        self.do("publish", lambda: self.end.publish(message), sent=message)


class Subscription(Used):
    """A topic that the component listens to."""

    end: zenoh_ros2.Subscription

    @property
    def value(self) -> Any:  # noqa: ANN401
        """The newest message, or a default one before the first."""
        sample = self.latest()
        return self._make(None) if sample is None else sample.value

    def latest(self) -> Sample[Any] | None:
        """Return the newest sample, with its `value` and its `age`; None before the first."""
        return self.do("latest", lambda: self.end.latest(), Sample)  # noqa: PLW0108 - a replay has no end

    def next(self, timeout: float = 2.0) -> Sample[Any]:
        """Wait for the next sample, at most `timeout` s."""
        return self.do("next", lambda: self.end.next(timeout), Sample, timeout=timeout)


class Service(Used):
    """A service that the component calls."""

    end: zenoh_ros2.Client
    _part = "_Request"

    def wait(self, timeout: float = 2.0) -> None:
        """Wait until a server offers the service, at most `timeout` s."""
        self.do("wait", lambda: self.end.wait(timeout), False, timeout=timeout)

    def call(self, request: Any = None, /, *, timeout: float = 2.0, **fields: object) -> Any:  # noqa: ANN401
        """Call the service with a request, or one with the given fields, and return the response."""
        whole = self._make(request, **fields)
        return self.do(
            "call", lambda: self.end.call(whole, timeout=timeout), "_Response", sent=whole, timeout=timeout
        )

    def call_async(self, request: Any = None, /, **fields: object) -> Future[Any]:  # noqa: ANN401
        """Call the service without waiting: the response is the result of a future."""
        whole = self._make(request, **fields)
        return self.do("call_async", lambda: self.end.call_async(whole), Future, sent=whole)


class Goal:
    """A goal that an action's server has accepted."""

    def __init__(self, do: Do, end: zenoh_ros2.Goal | Goal) -> None:
        self._do: Final = do
        self._end: Final = end

    @property
    def status(self) -> Status:
        """Where it is."""
        return self._do("status", lambda: self._end.status, Status.UNKNOWN)

    @property
    def feedback(self) -> Any:  # noqa: ANN401
        """The newest feedback, or None."""
        return self._do("feedback", lambda: self._end.feedback, "_Feedback")

    @property
    def done(self) -> bool:
        """Whether it has ended, successfully or not."""
        return self._do("done", lambda: self._end.done, True)

    def result(self, timeout: float = 2.0) -> Any:  # noqa: ANN401
        """Wait for its end, at most `timeout` s, and return the result."""
        return self._do("result", lambda: self._end.result(timeout), "_Result", timeout=timeout)

    def cancel(self, timeout: float = 2.0) -> bool:
        """Ask the server to cancel it; return whether it will."""
        return self._do("cancel", lambda: self._end.cancel(timeout), False, timeout=timeout)


class Action(Used):
    """An action whose goals the component sends."""

    end: zenoh_ros2.ActionClient
    _part = "_Goal"
    _goals: Sequence[Goal] = ()

    def send(self, goal: Any = None, /, *, timeout: float = 2.0, **fields: object) -> Goal:  # noqa: ANN401
        """Send a goal, or one with the given fields. Raises zenoh_ros2.GoalRejectedError."""
        whole = self._make(goal, **fields)
        sent = self.do(
            "send",
            lambda: Goal(directly, self.end.send(whole, timeout=timeout)),
            Goal,
            sent=whole,
            timeout=timeout,
        )
        self._goals = [*(each for each in self._goals if not each.done), sent]
        return sent

    def _hfsm_stops(self) -> Iterator[Callable[[float], object]]:
        """Yield a function for each unfinished goal that cancels it."""
        while self._goals:
            *self._goals, goal = self._goals
            if not goal.done:
                yield goal.cancel


KINDS: Final[Mapping[str, type[Used]]] = {
    "publish": Publisher,
    "subscribe": Subscription,
    "service": Service,
    "action": Action,
}


class Endpoints:
    """The topics, services and actions that a component and its later versions use."""

    def __init__(self, make_end: MakeEnd, types: Types) -> None:
        self._make_end: Final = make_end
        self._types: Final = types
        self._made: dict[tuple[object, ...], Used] = {}

    def connect(self, component: Component) -> None:
        """Connect what a component declares and has not connected yet. Raises ComponentError.

        Another version of a component gets the ends that have the same declaration.
        """
        try:
            for name, text in type_texts_of(component).items():
                self._types.add(name, text)
            for attribute, declared in ros_of(component).items():
                if attribute not in vars(component):
                    vars(component)[attribute] = self._used(declared)
        except RosError as error:
            raise ComponentError(f"the component cannot start: {error}") from error
        if not hasattr(type(component), "ros"):
            vars(component)["ros"] = self._types

    def _used(self, declared: Ros) -> Used:
        key = (declared.kind, declared.target, declared.type, declared.stop, *sorted(declared.qos.items()))
        if key not in self._made:
            if declared.kind not in KINDS:
                raise ComponentError(f"self.{declared.name}: {declared.kind!r} is no kind of ROS interface")
            end = self._make_end(declared, QoS(**declared.qos))  # type: ignore[arg-type]
            self._made[key] = KINDS[declared.kind](end, self._types, declared)
        return self._made[key]


def used_by(component: Component) -> dict[str, Used]:
    """Return what a component uses of ROS and is connected, by attribute."""
    found = {name: vars(component).get(name) for name in ros_of(component)}
    return {name: used for name, used in found.items() if isinstance(used, Used)}


def stop(component: Component, names: Container[str]) -> None:
    """Stop what a component drives over ROS by the ends with some names; failures are logged."""
    end = time.monotonic() + _LIMIT
    for name, used in used_by(component).items():
        for stop_it in used._hfsm_stops() if name in names else ():
            try:
                stop_it(max(_LEAST, end - time.monotonic()))
            except (RosError, ZenohIceError) as error:
                _logger.warning("self.%s could not be stopped: %s", name, error)
