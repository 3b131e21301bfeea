"""Run components in virtual time, in one thread: the same way every time, as fast as the processor.

Tests, trials and replays stand on it; it knows neither pytest nor robots.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from zenoh_ice.lazy import import_on_use

from ._run import Change as Change
from ._run import VirtualRun as VirtualRun

if TYPE_CHECKING:
    from ._journal import Call as Call
    from ._journal import Fired as Fired
    from ._journal import Journal as Journal
    from ._ros import FakeRos as FakeRos
    from ._stubs import make_stub as make_stub
    from .clock import PacedClock as PacedClock
    from .clock import TaskClock as TaskClock
    from .errors import BehaviorFailed as BehaviorFailed
    from .errors import ExecutionError as ExecutionError
    from .errors import UnknownName as UnknownName
    from .execution import Condition as Condition
    from .execution import Execution as Execution
    from .network import VirtualNetwork as VirtualNetwork
    from .paced import PacedExecution as PacedExecution
    from .world import VirtualWorld as VirtualWorld

# Every component imports this package, few need servants or ROS: these names are imported on first use.
__getattr__, __dir__ = import_on_use(__name__)
