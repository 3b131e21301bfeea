"""Steer a running component: breakpoints, variables, events, explanations and new documents."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, Final

import msgspec

from ..component import Component, parameters_of
from ..errors import ValueTypeError
from ..runtime import Runtime
from . import explanation
from .breakpoints import Breakpoint
from .expressions import plain
from .reloading import Reloaded, Reloading

__all__ = ["Steering"]

_LARGEST_VALUE: Final = 65_536
"""Bytes of JSON that are taken for a value."""
_LONGEST_NAME: Final = 200


class Steering:
    """What the monitor of a component lets others do with it, on top of what `Runtime` does.

    `connect` connects the proxies of a component that are not connected yet.
    """

    def __init__(self, runtime: Runtime, connect: Callable[[Component], None]) -> None:
        self._runtime = runtime
        self._guards = explanation.GuardLog()
        self._reloading = Reloading(runtime, connect)
        runtime.tree.observers.append(self._guards)

    def set_breakpoints(self, breakpoints: Iterable[Breakpoint]) -> None:
        """Replace all breakpoints; raises UnknownElementError and ValueTypeError, and then replaces none."""
        runtime = self._runtime
        with runtime.tree.lock:
            runtime.breakpoints.set(breakpoints, runtime.tree, parameters_of(runtime.component))

    def set_variable(self, automaton: int, name: str, text: str) -> None:
        """Set a variable of an automaton, or with 0 a parameter of the component, to a value in JSON.

        Raises UnknownElementError and ValueTypeError.
        """
        _check_name(name)
        self._runtime.set_variable(automaton, name, read_json(text))

    def send_event(self, name: str, text: str) -> None:
        """Send an event, with data in JSON or empty, to every active automaton.

        Raises EventError and ValueTypeError.
        """
        _check_name(name)
        self._runtime.send(name, read_json(text) if text else None)

    def explain(self, automaton: int) -> explanation.Explanation:
        """Say why an automaton is where it is; raises UnknownElementError."""
        runtime = self._runtime
        with runtime.tree.lock:
            return explanation.explain(runtime.tree, runtime.run(automaton), self._guards, runtime.timeline)

    def reload(self) -> Reloaded:
        """Replace the component by what its file holds now; raises ReloadRefusedError."""
        reloaded = self._reloading.reload()
        self._guards.clear()  # they were those of the former version
        return reloaded


def read_json(text: str) -> Any:  # noqa: ANN401 - whatever JSON knows
    """Return a value that came over the network as JSON; raises ValueTypeError."""
    if len(text.encode()) > _LARGEST_VALUE:
        raise ValueTypeError(f"the value has more than {_LARGEST_VALUE} bytes")
    try:
        return plain(msgspec.json.decode(text.encode()))
    except (ValueError, RecursionError) as error:  # msgspec's own errors are ValueErrors
        raise ValueTypeError(f"the value is not JSON that can be taken: {error}") from None


def _check_name(name: str) -> None:
    if not name or len(name) > _LONGEST_NAME or not name.isprintable():
        raise ValueTypeError(f"a name has 1 to {_LONGEST_NAME} characters that can be seen")
