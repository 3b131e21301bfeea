"""Test behaviors with pytest: in virtual time, with the fake or the simulated robot, in one process.

The fixture `behavior` makes a `Behavior` of a document. See docs/how-to/testing.md.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from hfsm_runtime.virtual import BehaviorFailed as BehaviorFailed
    from hfsm_runtime.virtual import Call as Call
    from hfsm_runtime.virtual import UnknownName as UnknownName
    from visualhfsm.simulation import Ball as Ball
    from visualhfsm.simulation import Behavior as Behavior
    from visualhfsm.simulation import DocumentInvalid as DocumentInvalid
    from visualhfsm.simulation import RobotUnderTest as RobotUnderTest

    from ._plugin import MakeBehavior as MakeBehavior
    from ._properties import check_properties as check_properties

_MODULES: Final = {
    "Ball": "visualhfsm.simulation",
    "Behavior": "visualhfsm.simulation",
    "BehaviorFailed": "hfsm_runtime.virtual",
    "Call": "hfsm_runtime.virtual",
    "DocumentInvalid": "visualhfsm.simulation",
    "MakeBehavior": "visualhfsm.testing._plugin",
    "RobotUnderTest": "visualhfsm.simulation",
    "UnknownName": "hfsm_runtime.virtual",
    "check_properties": "visualhfsm.testing._properties",
}


def __getattr__(name: str) -> Any:  # noqa: ANN401
    # Every run of pytest loads the plugin, and with it this package, so its names are imported on first use.
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(_MODULES[name]), name)
