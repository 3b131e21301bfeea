"""Intercept a component's readings of its clock, and of the module `time` where user code imported it."""

from __future__ import annotations

import builtins
import math
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from functools import cached_property
from types import ModuleType
from typing import Any, Final

from zenoh_ice.threads.clock import Clock, VirtualClock

from .._timeline import Timeline
from ..component import Component
from ..kinds import Ask

_TIME_FUNCTIONS: Final = (
    "time", "time_ns", "monotonic", "monotonic_ns", "perf_counter", "perf_counter_ns", "process_time",
    "sleep",
)  # fmt: skip
"""The functions of the module `time` that are intercepted."""

_NAMES: Final = {id(getattr(time, name)): name for name in _TIME_FUNCTIONS} | {id(time): ""}
"""The names of what is intercepted, by the identity of the genuine objects; none for the module."""

Genuine = list[tuple[dict[str, Any], str, object]]
"""Objects that something else replaces, each with its namespace and its name there."""


def restore(genuine: Genuine) -> None:
    """Put objects back in their places."""
    for namespace, name, value in genuine:
        namespace[name] = value


class InterceptedClock:
    """The clock that user code sees while it is recorded or replayed."""

    def __init__(self, clock: Clock, ask: Ask) -> None:
        self._clock = clock
        self._ask = ask

    @property
    def rate(self) -> float:
        """The seconds of this clock that pass in a second of wall time."""
        return float(self._ask("rate", lambda: self._clock.rate, None))

    @property
    def simulated(self) -> bool:
        """Whether the time is that of a simulation."""
        return self._clock.simulated

    def now(self) -> float:
        """Return the time in s."""
        return float(self._ask("now", self._clock.now, None))

    def sleep(self, seconds: float) -> None:
        """Wait for a duration in s."""
        self._ask("clock.sleep", lambda: self._clock.sleep(seconds), lambda: seconds)

    def wait(self, event: threading.Event, timeout: float) -> bool:
        """Wait for an event for at most `timeout` s; return whether it is set."""
        return bool(self._ask("clock.wait", lambda: self._clock.wait(event, timeout), lambda: timeout))


class InterceptedTimeline(Timeline):
    """Component time while it is recorded or replayed."""

    def __init__(self, clock: Clock, ask: Ask) -> None:
        super().__init__(clock)
        self._ask = ask

    def now(self) -> int:
        """Return the component time in ns."""
        return int(self._ask("component", super().now, None))


class InterceptedTime:
    """The module `time` that user code sees instead of the real one."""

    def __init__(self, ask: Ask) -> None:
        self._ask: Final = ask
        self._component: type | None = None
        self._modules: list[tuple[dict[str, Any], dict[str, Any] | None]] = []
        """The namespaces of its modules, each with its own builtins if it has any."""

    @cached_property
    def _module(self) -> ModuleType:
        """What is shown instead of the module, with what is shown instead of its functions."""
        module = ModuleType("time", time.__doc__)
        made = {name: _intercepted(name, getattr(time, name), self._ask) for name in _TIME_FUNCTIONS}
        vars(module).update({**vars(time), **made})
        return module

    @contextmanager
    def shown_to(self, component: type) -> Iterator[None]:
        """Show it to user code in a `with` block: see `show`."""
        genuine = self.show(component)
        try:
            yield
        finally:
            restore(genuine)

    def show(self, component: type) -> Genuine:
        """Show it to user code until what it returns is restored.

        It is replaced in the modules of the component and of its extension, where these have imported it or
        its functions, and in imports within their functions where a module has its own builtins.
        """
        genuine: Genuine = []
        if component is not self._component:
            self._component, self._modules = component, _modules(component)
        for module, own in self._modules:
            if not _NAMES.keys().isdisjoint(map(id, module.values())):
                for name, value in list(module.items()):
                    if id(value) in _NAMES:
                        genuine.append((module, name, value))
                        module[name] = vars(self._module).get(_NAMES[id(value)], self._module)
            if own is not None:
                genuine.append((own, "__import__", own["__import__"]))
                own["__import__"] = self._import
        return genuine

    def _import(self, name: str, *arguments: Any) -> Any:  # noqa: ANN401 - those of __import__
        return self._module if name == "time" else builtins.__import__(name, *arguments)


class TimeModule:
    """Let the module `time` follow a virtual clock in the code of a component.

    This holds for the thread that made this object, or took it over. Others, which user code starts, see wall
    time: they must not move the clock.
    """

    def __init__(self, clock: VirtualClock) -> None:
        self._clock: Final = clock
        # In whole seconds: sums with a fraction would be rounded differently in each run.
        self._date: Final = math.floor(time.time() - clock.now())
        self._thread = threading.get_ident()
        self._shown: Final = InterceptedTime(self._read)

    def take_over(self) -> None:
        """Let this thread be the one whose code sees virtual time."""
        self._thread = threading.get_ident()

    def shown_to(self, component: Component) -> AbstractContextManager[None]:
        """Let the module follow the clock in a `with` block, in the code of this component."""
        return self._shown.shown_to(type(component))

    def show(self, component: Component) -> Genuine:
        """Let the module follow the clock in the code of this component until what it returns is restored."""
        return self._shown.show(type(component))

    def _read(self, kind: str, read: Callable[[], Any], waits: Callable[[], float] | None) -> object:
        name = kind.removeprefix("time.")
        if threading.get_ident() != self._thread or name == "process_time":
            return read()
        if waits is not None and waits() >= 0:
            self._clock.sleep(waits())
            return None
        if name == "sleep":
            return read()  # which raises
        now = self._clock.now() + (self._date if name.startswith("time") else 0.0)
        return round(now * 1e9) if name.endswith("_ns") else now


def _modules(component: type) -> list[tuple[dict[str, Any], dict[str, Any] | None]]:
    """Return the namespaces of the modules of a component and of its extension, which is one of its bases.

    With each come the builtins that it has for itself.
    """
    names = {component.__module__: None}
    names.update((base.__module__, None) for base in component.__bases__ if base not in Component.__mro__)
    found = [vars(sys.modules[name]) for name in names if name in sys.modules]
    builtin = [module.get("__builtins__") for module in found]
    return [
        (module, own if isinstance(own, dict) and own is not vars(builtins) else None)
        for module, own in zip(found, builtin, strict=True)
    ]


def _intercepted(name: str, function: Callable[..., Any], ask: Ask) -> Callable[..., Any]:
    def read(*arguments: Any) -> Any:  # noqa: ANN401 - those of the function
        waits = (lambda: float(arguments[0])) if name == "sleep" and arguments else None
        return ask(f"time.{name}", lambda: function(*arguments), waits)

    return read
