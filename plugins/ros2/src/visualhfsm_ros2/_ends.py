"""A component's topics, services and actions of ROS 2, as user code sees them.

Each has an end: at a node of ROS (`_node`), in the ROS of a test (`_virtual`), or one that records what
another end gives, and answers from the recording in a replay (`_recording`). Messages are made here, for all
ends alike.
"""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Future
from typing import Any, Final

import zenoh_ros2
from hfsm_runtime.component import Component, type_texts_of
from hfsm_runtime.errors import ComponentError
from zenoh_ice import Sample, ZenohIceError
from zenoh_ros2 import QoS, RosError, Types

from .names import Ros, ros_of

_LIMIT: Final = 0.5
"""The longest wait in wall seconds for all goals of a component to be cancelled."""
_LEAST: Final = 0.05
"""The wait for each, however many there are."""

_logger = logging.getLogger(__name__)

MakeEnd = Callable[[Ros, QoS], Any]
"""Make the end that a component declares; it behaves as one at a node. Raises RosError."""


class Used:
    """A topic, service or action of a component."""

    _part = ""
    """The end of the name of the type of what is sent."""

    def __init__(self, end: Any, types: Types, declared: Ros) -> None:  # noqa: ANN401
        self.end = end
        self.types: Final = types
        self.declared: Final = declared

    def _make(self, message: object, **fields: object) -> Any:  # noqa: ANN401
        return self.types.coerce(self.declared.type + self._part, message, **fields)

    def _hfsm_stops(self) -> Iterator[Callable[[float], object]]:
        """Yield functions that stop what was begun, each within some s."""
        yield from ()


class Publisher(Used):
    """A topic that the component publishes."""

    end: zenoh_ros2.Publisher
    _is_driving = False

    @property
    def subscribers(self) -> int:
        """The current number of subscribers."""
        return self.end.subscribers

    def publish(self, message: Any = None, /, **fields: object) -> None:  # noqa: ANN401
        """Publish a message, or one with the given fields: the others are zero. Raises MessageError."""
        whole = self._make(message, **fields)
        self._is_driving = True  # set first: a stop may arrive during the publication
        self.end.publish(whole)

    def _hfsm_stops(self) -> Iterator[Callable[[float], object]]:
        """Yield a function that publishes a default message, if that stops an earlier one."""
        if self.declared.stop and self._is_driving:
            self._is_driving = False
            yield lambda _limit: self.end.publish(self._make(None))


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
        return self.end.latest()

    def next(self, timeout: float = 2.0) -> Sample[Any]:
        """Wait for the next sample, at most `timeout` s."""
        return self.end.next(timeout)


class Service(Used):
    """A service that the component calls."""

    end: zenoh_ros2.Client
    _part = "_Request"

    def wait(self, timeout: float = 2.0) -> None:
        """Wait until a server offers the service, at most `timeout` s."""
        self.end.wait(timeout)

    def call(self, request: Any = None, /, *, timeout: float = 2.0, **fields: object) -> Any:  # noqa: ANN401
        """Call the service with a request, or one with the given fields, and return the response."""
        return self.end.call(self._make(request, **fields), timeout=timeout)

    def call_async(self, request: Any = None, /, **fields: object) -> Future[Any]:  # noqa: ANN401
        """Call the service without waiting: the response is the result of a future."""
        return self.end.call_async(self._make(request, **fields))


class Action(Used):
    """An action whose goals the component sends."""

    end: zenoh_ros2.ActionClient
    _part = "_Goal"
    _goals: Sequence[zenoh_ros2.Goal] = ()

    def send(self, goal: Any = None, /, *, timeout: float = 2.0, **fields: object) -> zenoh_ros2.Goal:  # noqa: ANN401
        """Send a goal, or one with the given fields. Raises zenoh_ros2.GoalRejectedError."""
        sent = self.end.send(self._make(goal, **fields), timeout=timeout)
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


def stop(component: Component) -> None:
    """Stop what a component drives over ROS; failures are logged."""
    end = time.monotonic() + _LIMIT
    for name, used in used_by(component).items():
        for stop_it in used._hfsm_stops():
            try:
                stop_it(max(_LEAST, end - time.monotonic()))
            except (RosError, ZenohIceError) as error:
                _logger.warning("self.%s could not be stopped: %s", name, error)
