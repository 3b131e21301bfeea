"""Run components in virtual time, in one thread: the same way every time, as fast as the processor.

Tests, trials and replays stand on it; it knows neither pytest nor robots.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from zenoh_ice.lazy import import_on_use

from ._journal import Call, Fired, Journal
from ._run import Change, VirtualRun
from ._stubs import make_stub
from .clock import PacedClock, TaskClock
from .errors import BehaviorFailed, ExecutionError, UnknownName
from .execution import Condition, Execution
from .network import VirtualNetwork
from .paced import PacedExecution
from .world import VirtualWorld

if TYPE_CHECKING:
    from visualhfsm_ros2._virtual import FakeRos as FakeRos

__all__ = [
    "BehaviorFailed", "Call", "Change", "Condition", "Execution", "ExecutionError", "FakeRos", "Fired",
    "Journal", "PacedClock", "PacedExecution", "TaskClock", "UnknownName", "VirtualNetwork", "VirtualRun",
    "VirtualWorld", "make_stub",
]  # fmt: skip

__getattr__, __dir__ = import_on_use(__name__)  # few need its libraries
