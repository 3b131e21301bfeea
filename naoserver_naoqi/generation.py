"""Which generation of the Nao it is: the cameras and the signs of the inertial unit depend on it."""

from __future__ import annotations

from naoserver_naoqi.link import CallFailed, Link, call

__all__ = ["is_nao6"]


def is_nao6(link: Link) -> bool:
    """Return whether the robot is a NAO6, not one before it. Raises CallTimeout or LinkLost."""
    try:
        version = str(call(link, "ALMemory.getData", "RobotConfig/Head/BaseVersion"))
    except CallFailed:
        return False
    return version.upper().replace("VERSION_", "V").startswith("V6")
