"""Exceptions of the ROS 2 node."""

from __future__ import annotations


class RosError(Exception):
    """The root of the exceptions of this package."""


class TypeUnknownError(RosError):
    """No message, service or action of this name is known."""


class DefinitionError(RosError):
    """The definition of a message, service or action is malformed, or contradicts a known one."""


class MessageError(RosError):
    """A message, or its bytes, does not fit its type; the text names the field."""


class InvalidNameError(RosError):
    """ROS does not allow a name."""


class CallError(RosError):
    """A service or an action's server is absent, was lost, or refused the request."""


class CallTimeoutError(CallError):
    """Nothing arrived within the time limit."""


class GoalRejectedError(CallError):
    """The action's server does not accept the goal."""


class NodeClosedError(RosError):
    """The node was closed before or during the operation."""
