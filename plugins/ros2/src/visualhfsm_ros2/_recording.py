"""Ends that record what user code gets from other ends, and replay it.

What code gets is a reading, as of a clock: a recording takes it from a genuine end and writes it down; a
replay has no ends and returns the recorded reading.
"""

from __future__ import annotations

import base64
import math
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import contextmanager, suppress
from typing import Any, Final

import zenoh_ros2
from hfsm_runtime.component import Component
from hfsm_runtime.kinds import Ask, Differs
from zenoh_ice import Sample
from zenoh_ros2 import CallTimeoutError, MessageError, RosError, Status, Types

from ._ends import Endpoints, used_by
from .names import Ros

_LARGEST_MESSAGE: Final = 1 << 20
"""Bytes of the largest message that is recorded."""

_Reading = Any
"""JSON: a number, or a mapping with the encoded message, the error, or nothing if nothing came."""


class AskedEnd:
    """The end of a topic, service or action whose readings are asked for; genuine in a recording alone."""

    def __init__(
        self,
        declared: Ros,
        types: Types,
        ask: Ask,
        differs: Differs = lambda *_: None,
        genuine: Any = None,  # noqa: ANN401
    ) -> None:
        self._name: Final = declared.target
        self._type: Final = declared.type
        self._types: Final = types
        self._ask: Final = ask
        self._differs: Final = differs
        self._genuine: Final = genuine

    def number(self, what: str, act: Callable[[], Any], unknown: Any, timeout: float | None = None) -> Any:  # noqa: ANN401
        """Return a number of the type of the one that holds if none was recorded."""
        as_read = bool if isinstance(unknown, bool) else int
        _, found = self._reads(what, act, as_read, timeout)
        with suppress(ValueError):  # no status
            return type(unknown)(found) if isinstance(found, int) else unknown
        return unknown

    def message(self, what: str, act: Callable[[], Any], part: str, timeout: float | None = None) -> Any:  # noqa: ANN401
        """Return a message of a type whose name ends so; raises CallTimeoutError if that was waited for."""
        given, found = self._reads(what, act, self._written, timeout)
        given = self._read(found, part) if given is None else given
        if given is None and timeout is not None:
            raise CallTimeoutError(f"{self._name}: no {part.removeprefix('_').lower()} was recorded")
        return given

    def done(self, what: str, act: Callable[[], Any], timeout: float | None = None) -> Any:  # noqa: ANN401
        """Do something, and return what the genuine end gave, if there is one."""
        return self._reads(what, act, lambda _given: None, timeout)[0]

    def sends(self, what: str, message: Any) -> None:  # noqa: ANN401
        """Record a message that is sent; a replay compares it with the recorded one."""
        sent = self._written(message)
        known = self._ask(f"ros {self._name} sends", lambda: sent, None)
        if isinstance(known, dict) and known != sent:
            part = message.__msgtype__.removeprefix(self._type)
            recorded = _plain(self._read(known, part)) if "data" in known else known
            self._differs(f"{self._name}.{what}", recorded, _plain(message))

    def _reads(
        self,
        what: str,
        act: Callable[[], Any],
        as_read: Callable[[Any], _Reading],
        timeout: float | None = None,
    ) -> tuple[Any, _Reading]:
        """Return what an act gave, None in a replay, and the reading of it; raises the recorded error."""
        given: list[Any] = []  # user code gets this, however large

        def attempt() -> _Reading:
            try:
                given.append(act())
                return as_read(given[0])
            except RosError as error:
                return {"error": type(error).__name__, "text": str(error)}

        found = self._ask(f"ros {self._name} {what}", attempt, None if timeout is None else lambda: timeout)
        if isinstance(found, dict) and "error" in found:
            kind = getattr(zenoh_ros2, str(found["error"]), RosError)
            is_known = isinstance(kind, type) and issubclass(kind, RosError)
            raise (kind if is_known else RosError)(str(found.get("text")))
        return given[0] if given else None, found

    def _written(self, message: Any) -> dict[str, Any]:  # noqa: ANN401
        if message is None:
            return {}
        data = self._types.encode(message)
        if len(data) > _LARGEST_MESSAGE:
            return {"too_large": len(data)}
        return {"data": base64.b64encode(data).decode()}

    def _read(self, found: _Reading, part: str) -> Any:  # noqa: ANN401
        """Return the recorded message, or None if there was none."""
        if not isinstance(found, dict) or not found:
            return None
        if "too_large" in found:
            raise MessageError(f"{self._name}: {found['too_large']} bytes were too large to be recorded")
        try:
            data = base64.b64decode(str(found.get("data")), validate=True)
        except ValueError as error:
            raise MessageError(f"{self._name}: what was recorded is malformed: {error}") from error
        return self._types.decode(data, f"{self._type}{part}")


class _Publisher(AskedEnd):
    @property
    def subscribers(self) -> int:
        return int(self.number("subscribers", lambda: self._genuine.subscribers, 0))

    def publish(self, message: Any) -> None:  # noqa: ANN401
        self.sends("publish", message)
        self.done("publish", lambda: self._genuine.publish(message))


class _Subscription(AskedEnd):
    _newest: Sample[Any] | None = None
    """The last sample that user code got."""
    _source: Sample[Any] | None = None
    """The genuine sample behind it; None in a replay."""

    def latest(self) -> Sample[Any] | None:
        return self._sample(self._reads("latest", lambda: self._genuine.latest(), self._as_read)[1])  # noqa: PLW0108

    def next(self, timeout: float) -> Sample[Any]:
        found = self._sample(
            self._reads("next", lambda: self._genuine.next(timeout), self._as_read, timeout)[1]
        )
        if found is None:
            raise CallTimeoutError(f"{self._name}: no message was recorded")
        return found

    def _as_read(self, given: Sample[Any] | None) -> _Reading:
        """Return the reading of a sample, which is short for one that user code has already."""
        if given is None:
            return {}
        if self._source is given:
            return {"same": True}
        self._source = given
        about = {"sequence": given.sequence, "wall_time": given.wall_time, "age": given.age}
        return {**self._written(given.value), **about}

    def _sample(self, found: _Reading) -> Sample[Any] | None:
        if found is None or found == {"same": True}:  # nothing was recorded: the newest that is known
            return self._newest
        source = self._source
        value = self._read(found, "") if source is None or not found else source.value
        if value is None:
            return None
        numbers = [found.get(name, 0.0) for name in ("sequence", "wall_time", "age")]
        if not all(isinstance(each, int | float) for each in numbers):
            raise MessageError(f"{self._name}: what was recorded is malformed")
        number, wall_time, age = numbers

        def read_age() -> float:
            read: Callable[[], float] = lambda: source.age if source is not None else age  # noqa: E731
            passed = self._ask(f"ros {self._name} age", read, None)
            return float(passed) if isinstance(passed, int | float) else float(age)

        self._newest = Sample(value, int(number), math.nan, float(wall_time), _age=read_age)
        return self._newest


class _Client(AskedEnd):
    def wait(self, timeout: float) -> None:
        self.number("wait", lambda: self._genuine.wait(timeout), unknown=False, timeout=timeout)

    def call(self, request: Any, *, timeout: float) -> Any:  # noqa: ANN401
        self.sends("call", request)
        return self.message(
            "call", lambda: self._genuine.call(request, timeout=timeout), "_Response", timeout
        )

    def call_async(self, request: Any) -> Future[Any]:  # noqa: ANN401
        self.sends("call_async", request)
        return _Response(self, self.done("call_async", lambda: self._genuine.call_async(request)))


class _ActionClient(AskedEnd):
    def send(self, goal: Any, *, timeout: float) -> _Goal:  # noqa: ANN401
        self.sends("send", goal)
        return _Goal(self, self.done("send", lambda: self._genuine.send(goal, timeout=timeout), timeout))


class _Goal:
    """A goal of user code."""

    __module__ = "hfsm_runtime._recording.ros"  # as recordings name the value of a variable that holds one

    def __init__(self, end: AskedEnd, genuine: Any) -> None:  # noqa: ANN401
        self._end: Final = end
        self._genuine: Final = genuine  # None in a replay, where nobody asks it

    @property
    def status(self) -> Status:
        return Status(self._end.number("status", lambda: self._genuine.status, Status.UNKNOWN))

    @property
    def feedback(self) -> Any:  # noqa: ANN401
        return self._end.message("feedback", lambda: self._genuine.feedback, "_Feedback")

    @property
    def done(self) -> bool:
        return bool(self._end.number("done", lambda: self._genuine.done, unknown=True))

    def result(self, timeout: float = 2.0) -> Any:  # noqa: ANN401
        return self._end.message("result", lambda: self._genuine.result(timeout), "_Result", timeout)

    def cancel(self, timeout: float = 2.0) -> bool:
        return bool(
            self._end.number("cancel", lambda: self._genuine.cancel(timeout), unknown=False, timeout=timeout)
        )


class _Response(Future[Any]):
    """A response that user code asks for."""

    def __init__(self, end: AskedEnd, genuine: Any) -> None:  # noqa: ANN401
        super().__init__()
        self._end: Final = end
        self._genuine: Final = genuine  # None in a replay, where nobody asks it

    def done(self) -> bool:
        return bool(self._end.number("done", lambda: self._genuine.done(), unknown=True))  # noqa: PLW0108

    def result(self, timeout: float | None = None) -> Any:  # noqa: ANN401
        return self._end.message("result", lambda: self._genuine.result(timeout), "_Response", timeout or 0.0)


def _plain(value: Any) -> Any:  # noqa: ANN401
    """Return the fields of a message, without its classes."""
    if hasattr(value, "__msgtype__"):
        return {name: _plain(each) for name, each in vars(value).items() if not name.startswith("_")}
    return value.tolist() if hasattr(value, "tolist") else value


ENDS: Final = {
    "publish": _Publisher,
    "subscribe": _Subscription,
    "service": _Client,
    "action": _ActionClient,
}


@contextmanager
def recorded(component: Component, ask: Ask) -> Iterator[None]:
    """Record what a component gets from ROS, in a `with` block."""
    genuine = {used: used.end for used in used_by(component).values()}
    for used, end in genuine.items():
        used.end = ENDS[used.declared.kind](used.declared, used.types, ask, genuine=end)
    try:
        yield
    finally:
        for used, end in genuine.items():
            used.end = end


def replayed(component: Component, ask: Ask, differs: Differs) -> None:
    """Give a component what was recorded in place of ROS."""
    types = Types()
    Endpoints(lambda declared, _: ENDS[declared.kind](declared, types, ask, differs), types).connect(
        component
    )
