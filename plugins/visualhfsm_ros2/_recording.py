"""Record what user code does with topics, services and actions of ROS, and replay it.

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
from zenoh_ros2 import MessageError, RosError, Types

from ._ends import Endpoints, Goal, Used, directly, used_by

_LARGEST_MESSAGE: Final = 1 << 20
"""Bytes of the largest message that is recorded."""


class Asked:
    """Take what user code gets from a topic, service or action as readings."""

    def __init__(self, used: Used, ask: Ask, differs: Differs = lambda *_: None) -> None:
        self._name: Final = used.declared.target
        self._type: Final = used.declared.type
        self._types: Final = used.types
        self._ask: Final = ask
        self._differs: Final = differs
        self._newest: Sample[Any] | None = None
        """The last sample that user code got."""
        self._genuine: Sample[Any] | None = None
        """The genuine sample behind it; None in a replay."""

    def __call__(
        self,
        name: str,
        act: Callable[[], Any],
        gives: object = None,
        /,
        *,
        sent: object = None,
        timeout: float | None = None,
    ) -> Any:  # noqa: ANN401
        """Do something and record what comes of it; in a replay return, or raise, what was recorded."""
        if sent is not None:
            self._report_sent(name, sent)
        genuine: list[Any] = []  # user code gets this one, however large; in a replay there is none

        def attempt() -> Any:  # noqa: ANN401
            try:
                genuine.append(act())
                return self._reading(genuine[0], gives)
            except RosError as error:
                return {"error": type(error).__name__, "text": str(error)}

        found = self._reads(name, attempt, timeout)
        if isinstance(found, dict) and "error" in found:
            kind = getattr(zenoh_ros2, str(found["error"]), RosError)
            is_known = isinstance(kind, type) and issubclass(kind, RosError)
            raise (kind if is_known else RosError)(str(found.get("text")))
        if gives in (Goal, Future):
            handle: Any = _Goal if gives is Goal else _Response
            return handle(self, genuine[0] if genuine else None)
        if isinstance(gives, int):
            return _number(gives, found)
        if gives is Sample:
            given = self._sample(found)
        else:
            given = genuine[0] if genuine else self._message(found, gives)
        if given is None and gives is not None and timeout is not None:
            missing = gives.removeprefix("_").lower() if isinstance(gives, str) else "message"
            raise zenoh_ros2.CallTimeoutError(f"{self._name}: no {missing} was recorded")
        return given

    def _reads(self, what: str, read: Callable[[], Any], waits: float | None = None) -> Any:  # noqa: ANN401
        return self._ask(f"ros {self._name} {what}", read, None if waits is None else lambda: waits)

    def _report_sent(self, what: str, message: Any) -> None:  # noqa: ANN401
        """Record a message that is sent; a replay compares it with the recorded one."""
        sent = self._written(message)
        known = self._reads("sends", lambda: sent)
        if isinstance(known, dict) and known != sent:
            part = message.__msgtype__.removeprefix(self._type)
            recorded = _plain(self._message(known, part)) if "data" in known else known
            self._differs(f"{self._name}.{what}", recorded, _plain(message))

    def _reading(self, given: Any, gives: object) -> Any:  # noqa: ANN401
        """Return what is recorded: empty if nothing came, short for a sample that user code has already."""
        if isinstance(gives, int):
            return bool(given) if isinstance(gives, bool) else int(given)
        if gives in (None, Goal, Future):
            return None
        if given is None:
            return {}
        if gives is not Sample:
            return self._written(given)
        if self._genuine is given:
            return {"same": True}
        self._genuine = given
        about = {"sequence": given.sequence, "wall_time": given.wall_time, "age": given.age}
        return {**self._written(given.value), **about}

    def _written(self, message: Any) -> dict[str, Any]:  # noqa: ANN401
        data = self._types.encode(message)
        if len(data) > _LARGEST_MESSAGE:
            return {"too_large": len(data)}
        return {"data": base64.b64encode(data).decode()}

    def _message(self, found: Any, part: object) -> Any:  # noqa: ANN401
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

    def _sample(self, found: Any) -> Sample[Any] | None:  # noqa: ANN401
        if found is None or found == {"same": True}:  # nothing was recorded: the newest that is known
            return self._newest
        genuine = self._genuine
        value = self._message(found, "") if genuine is None or not found else genuine.value
        if value is None:
            return None
        numbers = [found.get(name, 0.0) for name in ("sequence", "wall_time", "age")]
        if not all(isinstance(each, int | float) for each in numbers):
            raise MessageError(f"{self._name}: what was recorded is malformed")
        number, wall_time, age = numbers

        def read_age() -> float:
            passed = self._reads("age", lambda: genuine.age if genuine is not None else age)
            return float(passed) if isinstance(passed, int | float) else float(age)

        self._newest = Sample(value, int(number), math.nan, float(wall_time), _age=read_age)
        return self._newest


class _Goal(Goal):
    """A goal of user code."""

    __module__ = "hfsm_runtime._recording.ros"  # as recordings name the value of a variable that holds one


class _Response(Future[Any]):
    """A response that user code asks for."""

    def __init__(self, asked: Asked, genuine: Any) -> None:  # noqa: ANN401
        super().__init__()
        self._asked: Final = asked
        self._genuine: Final = genuine  # None in a replay, where nobody asks it

    def done(self) -> bool:
        return bool(self._asked("done", lambda: self._genuine.done(), True))  # noqa: PLW0108 - see there

    def result(self, timeout: float | None = None) -> Any:  # noqa: ANN401
        return self._asked(
            "result", lambda: self._genuine.result(timeout), "_Response", timeout=timeout or 0.0
        )


def _number(unknown: Any, found: Any) -> Any:  # noqa: ANN401
    """Return a recorded number, or what holds if none is known."""
    with suppress(ValueError):  # no status
        return type(unknown)(found) if isinstance(found, int) else unknown
    return unknown


def _plain(value: Any) -> Any:  # noqa: ANN401
    """Return the fields of a message, without its classes."""
    if hasattr(value, "__msgtype__"):
        return {name: _plain(each) for name, each in vars(value).items() if not name.startswith("_")}
    return value.tolist() if hasattr(value, "tolist") else value


@contextmanager
def recorded(component: Component, ask: Ask) -> Iterator[None]:
    """Record what a component gets from ROS, in a `with` block."""
    all_used = used_by(component).values()
    for used in all_used:
        used.do = Asked(used, ask)
    try:
        yield
    finally:
        for used in all_used:
            used.do = directly


def replayed(component: Component, ask: Ask, differs: Differs) -> None:
    """Give a component what was recorded in place of ROS."""
    Endpoints(lambda *_: None, Types()).connect(component)
    for used in used_by(component).values():
        used.do = Asked(used, ask, differs)
