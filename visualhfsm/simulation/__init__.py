"""Run behaviors in virtual time, with the fake or the simulated robot, in one process.

`simulate` makes a `Behavior` of a document. Tests and trials stand on it; it knows no pytest.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from ._behavior import Behavior as Behavior
    from ._behavior import simulate as simulate
    from ._loading import DocumentInvalid as DocumentInvalid
    from ._loading import load_component as load_component
    from ._robot import Ball as Ball
    from ._robot import RobotUnderTest as RobotUnderTest

_MODULES: Final = {
    "Ball": "_robot",
    "Behavior": "_behavior",
    "DocumentInvalid": "_loading",
    "RobotUnderTest": "_robot",
    "load_component": "_loading",
    "simulate": "_behavior",
}


def __getattr__(name: str) -> Any:  # noqa: ANN401
    # The robot needs libraries that a behavior without one does not: names are imported on first use.
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f".{_MODULES[name]}", __name__), name)
