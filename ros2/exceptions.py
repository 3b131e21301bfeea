"""Exceptions of the ROS 2 node."""

from __future__ import annotations


class RosError(Exception):
    """The root of what this package raises."""


class TypeUnknownError(RosError):
    """No message, service or action of this name is known."""


class DefinitionError(RosError):
    """The text of a message, service or action cannot be read, or contradicts one that is known."""


class MessageError(RosError):
    """A message, or its bytes, does not fit its type; the text names the field."""


class InvalidNameError(RosError):
    """A name is none that ROS allows."""


class CallError(RosError):
    """A service or an action's server is absent, was lost, or refused the request."""


class CallTimeoutError(CallError):
    """Nothing came within the limit."""


class GoalRejectedError(CallError):
    """The action's server does not accept the goal."""


class NodeClosedError(RosError):
    """The node was closed before or during the operation."""
