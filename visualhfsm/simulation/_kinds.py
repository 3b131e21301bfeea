"""The kinds of robots and of cameras in virtual time."""

from __future__ import annotations

from typing import Literal

RobotKind = Literal["fake", "sim"]
"""The fake robot, without physics, or the simulated one."""
CameraKind = Literal["auto", "drawn", "rendered"]
"""Where pictures come from; see `RobotUnderTest`."""
