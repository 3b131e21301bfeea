"""Run components in virtual time, in one thread: the same way every time, as fast as the processor.

Tests, trials and replays stand on it; it knows neither pytest nor robots. `Execution` is what tests, *Try it*
and other programs use, with servants and proxies of one process.
"""

from __future__ import annotations

from ._journal import Call, Fired, Journal
from ._run import Change, VirtualRun
from ._stubs import make_stub
from .clock import PacedClock, TaskClock
from .errors import BehaviorFailed, ExecutionError, UnknownName
from .execution import Condition, Execution
from .network import VirtualNetwork
from .paced import PacedExecution
from .world import VirtualWorld

__all__ = [
    "BehaviorFailed", "Call", "Change", "Condition", "Execution", "ExecutionError", "Fired",
    "Journal", "PacedClock", "PacedExecution", "TaskClock", "UnknownName", "VirtualNetwork", "VirtualRun",
    "VirtualWorld", "make_stub",
]  # fmt: skip
