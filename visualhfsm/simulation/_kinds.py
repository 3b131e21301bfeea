"""The kinds of robots, of cameras and of eyes in virtual time."""

from __future__ import annotations

from typing import Literal

RobotKind = Literal["fake", "sim"]
"""The fake robot, without physics, or the simulated one."""
CameraKind = Literal["auto", "drawn", "rendered"]
"""Where pictures come from; see `RobotUnderTest`."""
EyesKind = Literal["truth", "pictures"]
"""What serves `Sight`: the simulation's own knowledge, or what OpenCV sees in its pictures."""
