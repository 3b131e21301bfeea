"""Run components on threads in a test, and wait for their effects."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from hfsm_runtime import Automaton, Component
from hfsm_runtime._limits import LIMITS, RuntimeLimits
from hfsm_runtime._runtime import Runtime
from hfsm_runtime.errors import OnError
from tests.support.automata import component
from zenoh_ice import WallClock

__all__ = ["running"]


@contextmanager
def running(
    root: Automaton | Callable[[Component], Automaton],
    on_error: OnError | None = None,
    limits: RuntimeLimits = LIMITS,
) -> Iterator[Runtime]:
    """Run automata by the wall clock during a `with` block."""
    runtime = Runtime(component(root), WallClock(), on_error, limits=limits)
    runtime.start()
    try:
        yield runtime
    finally:
        runtime.stop()
