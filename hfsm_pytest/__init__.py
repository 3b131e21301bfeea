"""Test behaviors with pytest: in virtual time, with the fake or the simulated robot, in one process.

The fixture `behavior` makes a `Behavior` of a document. See docs/testing.md.
"""

from .behavior import Behavior
from .calls import Call
from .errors import BehaviorFailed, DocumentInvalid, UnknownName
from .loading import load_component
from .robot import Ball, RobotUnderTest

__all__ = [
    "Ball",
    "Behavior",
    "BehaviorFailed",
    "Call",
    "DocumentInvalid",
    "RobotUnderTest",
    "UnknownName",
    "load_component",
]
