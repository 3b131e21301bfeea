"""Test behaviors with pytest: in virtual time, with the fake or the simulated robot, in one process.

The fixture `behavior` makes a `Behavior` of a document. See docs/testing.md.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from .behavior import Behavior
    from .calls import Call
    from .errors import BehaviorFailed, DocumentInvalid, UnknownName
    from .plugin import MakeBehavior
    from .properties import check_properties
    from .robot import Ball, RobotUnderTest

__all__ = [
    "Ball",
    "Behavior",
    "BehaviorFailed",
    "Call",
    "DocumentInvalid",
    "MakeBehavior",
    "RobotUnderTest",
    "UnknownName",
    "check_properties",
]

_MODULES: Final = {
    "Ball": "robot",
    "Behavior": "behavior",
    "BehaviorFailed": "errors",
    "Call": "calls",
    "DocumentInvalid": "errors",
    "MakeBehavior": "plugin",
    "RobotUnderTest": "robot",
    "UnknownName": "errors",
    "check_properties": "properties",
}


def __getattr__(name: str) -> Any:  # noqa: ANN401
    # Every run of pytest loads the plugin, and with it this: what it has is imported when it is asked for.
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f".{_MODULES[name]}", __name__), name)
