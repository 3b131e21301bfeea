"""The ends of topics, services and actions while a component is recorded or replayed.

User code gets readings from them, as from a clock: a recording takes them from a genuine end and writes them
down; a replay has no genuine end and returns the recorded readings.
"""

from __future__ import annotations

import base64
import math
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Future
from contextlib import contextmanager, suppress
from typing import Any, Final

import zenoh_ros2
from zenoh_ice import Sample
from zenoh_ros2 import MessageError, QoS, RosError, Types

from .._ros import End, Endpoints, types_of, used_by
from ..component import Component, Ros
from .clocks import Ask
from .values import readable

Differs = Callable[[str, object, object], object]
"""Called in a replay with a message that user code sends: the recorded one and the present one."""

_LARGEST_MESSAGE: Final = 1 << 20
"""Bytes of the largest message that is recorded."""


class _Asked:
    """An end whose results are readings; in a replay there is no genuine end."""

    def __init__(self, node: AskedNode, type_name: str, name: str, end: Any) -> None:  # noqa: ANN401
        self._node: Final = node
        self._type: Final = type_name
        self._name: Final = name
        self._end: Final = end

    def _ask(self, what: str, read: Callable[[], Any], waits: float | None = None) -> Any:  # noqa: ANN401
        """Return the JSON that a function returns, or raise its exception; in a replay, the recorded one."""

        def attempt() -> Any:  # noqa: ANN401
            try:
                return read()
            except RosError as error:
                return {"error": type(error).__name__, "text": str(error)}

        found = self._node.ask(f"ros {self._name} {what}", attempt, None if waits is None else lambda: waits)
        if isinstance(found, dict) and "error" in found:
            kind = getattr(zenoh_ros2, str(found["error"]), RosError)
            is_known = isinstance(kind, type) and issubclass(kind, RosError)
            raise (kind if is_known else RosError)(str(found.get("text")))
        return found

    def _report_sent(self, what: str, message: Any) -> None:  # noqa: ANN401
        """Record a message that is sent; a replay compares it with the recorded one."""
        sent = _written(self._node.types, message)
        known = self._node.ask(f"ros {self._name} sends", lambda: sent, None)
        if isinstance(known, dict) and known != sent:
            part = message.__msgtype__.removeprefix(self._type)
            recorded = _plain(self._read(known, part)) if "data" in known else known
            self._node.differs(f"{self._name}.{what}", recorded, _plain(message))

    def message(self, what: str, part: str, read: Callable[[], Any], waits: float | None = None) -> Any:  # noqa: ANN401
        """Return the message of a function, or the recorded one; a wait without a reading raises."""
        genuine: list[Any] = []  # user code gets this one, however large

        def write() -> dict[str, Any]:
            genuine.append(read())
            return {} if genuine[0] is None else _written(self._node.types, genuine[0])

        found = self._ask(what, write, waits)
        if found is None and waits is not None:
            missing = part.removeprefix("_").lower()
            raise zenoh_ros2.CallTimeoutError(f"{self._name}: no {missing} was recorded")
        return genuine[0] if genuine else self._read(found, part)

    def _read(self, found: Any, part: str = "") -> Any:  # noqa: ANN401
        """Return the recorded message, or None if there was none."""
        if not isinstance(found, dict) or not found:
            return None
        if "too_large" in found:
            raise MessageError(f"{self._name}: {found['too_large']} bytes were too large to be recorded")
        try:
            data = base64.b64decode(str(found.get("data")), validate=True)
        except ValueError as error:
            raise MessageError(f"{self._name}: what was recorded is malformed: {error}") from error
        return self._node.types.decode(data, self._type + part)


class _Publisher(_Asked):
    @property
    def subscribers(self) -> int:
        found = self._ask("subscribers", lambda: self._end.subscribers)
        return found if isinstance(found, int) else 0

    def publish(self, message: Any, /) -> None:  # noqa: ANN401
        self._report_sent("publish", message)
        self._ask("publish", lambda: self._end.publish(message))


class _Subscription(_Asked):
    _newest: Sample[Any] | None = None
    """The last sample that user code got."""
    _genuine: Sample[Any] | None = None
    """The genuine sample behind it; None in a replay."""

    def latest(self) -> Sample[Any] | None:
        return self._sample(self._ask("latest", lambda: self._described(self._end.latest())))

    def next(self, timeout: float) -> Sample[Any]:
        found = self._ask("next", lambda: self._described(self._end.next(timeout)), timeout)
        sample = self._sample(found)
        if sample is None:
            raise zenoh_ros2.CallTimeoutError(f"{self._name}: no message was recorded")
        return sample

    def _described(self, sample: Sample[Any] | None) -> dict[str, Any]:
        """Return a sample as it is recorded: empty if there is none, short if user code has it already."""
        if sample is None:
            return {}
        if self._genuine is sample:
            return {"same": True}
        about = {"sequence": sample.sequence, "wall_time": sample.wall_time, "age": sample.age}
        self._genuine = sample
        return {**_written(self._node.types, sample.value), **about}

    def _sample(self, found: Any) -> Sample[Any] | None:  # noqa: ANN401
        if found is None or found == {"same": True}:  # nothing was recorded: the newest that is known
            return self._newest
        genuine = self._genuine
        value = self._read(found) if genuine is None or not found else genuine.value
        if value is None:
            return None
        numbers = [found.get(name, 0.0) for name in ("sequence", "wall_time", "age")]
        if not all(isinstance(each, int | float) for each in numbers):
            raise MessageError(f"{self._name}: what was recorded is malformed")
        number, wall_time, age = numbers

        def read_age() -> float:
            passed = self._ask("age", lambda: genuine.age if genuine is not None else age)
            return float(passed) if isinstance(passed, int | float) else float(age)

        self._newest = Sample(value, int(number), math.nan, float(wall_time), _age=read_age)
        return self._newest


class _Client(_Asked):
    def wait(self, timeout: float) -> object:
        return self._ask("wait", lambda: bool(self._end.wait(timeout)), timeout)

    def call(self, request: Any, /, *, timeout: float) -> Any:  # noqa: ANN401
        self._report_sent("call", request)
        return self.message("call", "_Response", lambda: self._end.call(request, timeout=timeout), timeout)

    def call_async(self, request: Any, /) -> Future[Any]:  # noqa: ANN401
        futures: list[Future[Any]] = []
        self._report_sent("call_async", request)
        self._ask("call_async", lambda: futures.append(self._end.call_async(request)))
        return _Response(self, futures[0] if futures else None)


class _Response(Future[Any]):
    """A response that user code asks for."""

    def __init__(self, client: _Client, genuine: Future[Any] | None) -> None:
        super().__init__()
        self._client: Final = client
        self._genuine: Final = genuine

    def done(self) -> bool:
        genuine = self._genuine
        return self._client._ask("done", lambda: genuine is not None and genuine.done()) is not False

    def result(self, timeout: float | None = None) -> Any:  # noqa: ANN401
        def read() -> Any:  # noqa: ANN401
            return self._genuine and self._genuine.result(timeout)

        return self._client.message("result", "_Response", read, timeout or 0.0)


class _ActionClient(_Asked):
    def send(self, goal: Any, /, *, timeout: float) -> _Goal:  # noqa: ANN401
        goals: list[Any] = []
        self._report_sent("send", goal)
        self._ask("send", lambda: goals.append(self._end.send(goal, timeout=timeout)), timeout)
        return _Goal(self._node, self._type, self._name, goals[0] if goals else None)


class _Goal(_Asked):
    @property
    def status(self) -> zenoh_ros2.Status:
        found = self._ask("status", lambda: int(self._end.status))
        with suppress(ValueError):
            return zenoh_ros2.Status(found if isinstance(found, int) else 0)
        return zenoh_ros2.Status(0)

    @property
    def feedback(self) -> Any:  # noqa: ANN401
        return self.message("feedback", "_Feedback", lambda: self._end.feedback)

    @property
    def done(self) -> bool:
        return self._ask("done", lambda: self._end.done) is not False

    def result(self, timeout: float = 2.0) -> Any:  # noqa: ANN401
        return self.message("result", "_Result", lambda: self._end.result(timeout), timeout)

    def cancel(self, timeout: float = 2.0) -> object:
        return self._ask("cancel", lambda: bool(self._end.cancel(timeout)), timeout)


_KINDS: Final[Mapping[str, Callable[..., End]]] = {
    "publish": _Publisher,
    "subscribe": _Subscription,
    "service": _Client,
    "action": _ActionClient,
}


class AskedNode:
    """A node of ROS whose ends give readings."""

    def __init__(self, types: Types, ask: Ask, differs: Differs = lambda *_: None) -> None:
        self.types: Final = types
        self.ask: Final = ask
        self.differs: Final = differs

    def make_end(self, declared: Ros, _qos: QoS | None = None, genuine: End | None = None) -> End:
        """Return an end; a recording has a `genuine` one, a replay has none."""
        return _KINDS[declared.kind](self, declared.type, declared.target, genuine)


def _written(types: Types, message: Any) -> dict[str, Any]:  # noqa: ANN401
    data = types.encode(message)
    if len(data) > _LARGEST_MESSAGE:
        return {"too_large": len(data)}
    return {"data": base64.b64encode(data).decode()}


def _plain(value: Any) -> Any:  # noqa: ANN401
    """Return a message as readable JSON."""
    if hasattr(value, "__msgtype__"):
        return {name: _plain(each) for name, each in vars(value).items() if not name.startswith("_")}
    return readable(value.tolist() if hasattr(value, "tolist") else value)


@contextmanager
def recorded_ros(component: Component, ask: Ask) -> Iterator[None]:
    """Record what a component gets from ROS, in a `with` block."""
    node = AskedNode(types_of(component), ask)
    genuine = {used: used.end for used in used_by(component).values()}
    for used, end in genuine.items():
        used.end = node.make_end(used.declared, genuine=end)
    try:
        yield
    finally:
        for used, end in genuine.items():
            used.end = end


def replayed_ros(component: Component, ask: Ask, differs: Differs) -> None:
    """Give a component what was recorded in place of ROS."""
    types = types_of(component)
    Endpoints(AskedNode(types, ask, differs).make_end, types).connect(component)
