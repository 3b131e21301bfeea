"""Test behaviors with pytest: in virtual time, with the fake or the simulated robot, in one process.

The fixture `behavior` makes a `Behavior` of a document. See docs/how-to/testing.md.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from hfsm_runtime.virtual.errors import BehaviorFailed as BehaviorFailed
    from hfsm_runtime.virtual.errors import UnknownName as UnknownName
    from hfsm_runtime.virtual.journal import Call as Call

    from .behavior import Behavior as Behavior
    from .errors import DocumentInvalid as DocumentInvalid
    from .plugin import MakeBehavior as MakeBehavior
    from .properties import check_properties as check_properties
    from .robot import Ball as Ball
    from .robot import RobotUnderTest as RobotUnderTest

_MODULES: Final = {
    "Ball": "visualhfsm.testing.robot",
    "Behavior": "visualhfsm.testing.behavior",
    "BehaviorFailed": "hfsm_runtime.virtual.errors",
    "Call": "hfsm_runtime.virtual.journal",
    "DocumentInvalid": "visualhfsm.testing.errors",
    "MakeBehavior": "visualhfsm.testing.plugin",
    "RobotUnderTest": "visualhfsm.testing.robot",
    "UnknownName": "hfsm_runtime.virtual.errors",
    "check_properties": "visualhfsm.testing.properties",
}


def __getattr__(name: str) -> Any:  # noqa: ANN401
    # Every run of pytest loads the plugin, and with it this package, so its names are imported on first use.
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(_MODULES[name]), name)
