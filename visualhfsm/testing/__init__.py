"""Test behaviors with pytest: in virtual time, with the fake or the simulated robot, in one process.

The fixture `behavior` makes a `Behavior` of a document. See docs/how-to/testing.md.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from .behavior import Behavior as Behavior
    from .errors import BehaviorFailed as BehaviorFailed
    from .errors import DocumentInvalid as DocumentInvalid
    from .errors import UnknownName as UnknownName
    from .journal import Call as Call
    from .plugin import MakeBehavior as MakeBehavior
    from .properties import check_properties as check_properties
    from .robot import Ball as Ball
    from .robot import RobotUnderTest as RobotUnderTest

_MODULES: Final = {
    "Ball": "robot",
    "Behavior": "behavior",
    "BehaviorFailed": "errors",
    "Call": "journal",
    "DocumentInvalid": "errors",
    "MakeBehavior": "plugin",
    "RobotUnderTest": "robot",
    "UnknownName": "errors",
    "check_properties": "properties",
}


def __getattr__(name: str) -> Any:  # noqa: ANN401
    # Every run of pytest loads the plugin, and with it this package, so its names are imported on first use.
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f".{_MODULES[name]}", __name__), name)
