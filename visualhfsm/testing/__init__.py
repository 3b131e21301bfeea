"""Test behaviors with pytest: in virtual time, with the fake or the simulated robot, in one process.

The fixture `behavior` makes a `Behavior` of a document. See docs/how-to/testing.md.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from zenoh_ice.lazy import import_on_use

if TYPE_CHECKING:
    from hfsm_runtime.virtual import BehaviorFailed as BehaviorFailed
    from hfsm_runtime.virtual import Call as Call
    from hfsm_runtime.virtual import UnknownName as UnknownName
    from visualhfsm.simulation import Ball as Ball
    from visualhfsm.simulation import Behavior as Behavior
    from visualhfsm.simulation import DocumentInvalid as DocumentInvalid
    from visualhfsm.simulation import RobotUnderTest as RobotUnderTest

    from ._plugin import MakeBehavior as MakeBehavior
    from ._plugin import RunTrials as RunTrials
    from ._properties import check_properties as check_properties

# Every run of pytest loads the plugin, and with it this package, so its names are imported on first use.
__getattr__, __dir__ = import_on_use(__name__)
