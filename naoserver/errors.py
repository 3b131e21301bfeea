"""Errors between the servants and a robot."""

from __future__ import annotations


class RobotError(Exception):
    """The root of this layer's errors; the message says what went wrong, where, and what to do."""


class HardwareFailure(RobotError):
    """A device of the robot, or its substitute, does not work.

    If a missing package is the reason, the message names it and the command that installs it.
    """


class CommandRefused(RobotError):
    """The robot refuses commands of this client: it is stopped, or another client holds it."""

    def __init__(self, message: str, holder: str = "") -> None:
        super().__init__(message)
        self.holder = holder
        """The holder of the robot; empty when it is stopped."""


class InvalidCommand(RobotError):
    """A command cannot be obeyed: a value is not finite or out of its domain, or a joint is unknown."""

    def __init__(self, field: str, message: str) -> None:
        super().__init__(message)
        self.field = field
        """The joint, parameter or member that holds the value."""


class JointTaken(InvalidCommand):
    """Another activity moves a joint, and is to end first."""

    def __init__(self, joint: str, activity: str, message: str) -> None:
        super().__init__(joint, message)
        self.activity = activity
