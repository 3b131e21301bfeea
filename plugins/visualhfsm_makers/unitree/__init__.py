"""Serve a G1 over DDS as its maker's robot does, so that its maker's programs drive it.

Besides the servants, it is another interface to implementations of `naoserver.robot.Robot`. Commands pass the
same guards as those of servants, never straight to the robot. docs/reference/unitree.md lists what it serves.
"""

from __future__ import annotations

from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING

from naoserver.bodies import require_family
from naoserver.errors import RobotError
from zenoh_ice.application import missing_package

if TYPE_CHECKING:
    from naoserver.protocol.robot import Robot
    from naoserver.serving.assembly import Assembly

__all__ = ["serve_as_unitree"]


def serve_as_unitree(
    robot: Robot, assembly: Assembly, url: str, *, disk: Path | None = None
) -> AbstractContextManager[str]:
    """Serve a started G1 through the guards of `assembly` at `url`, dds:DOMAIN, on loopback alone.

    Use it in a `with` block that ends before the assembly is closed; it gets the URL. Its end stops what
    programs drove. `disk` is of no use to it. Raises RobotError for another robot than a G1, for a domain
    that cannot be joined, or when the package cyclonedds is missing.
    """
    del disk
    require_family(robot.body, "G1", "--unitree serves a Unitree G1")
    try:
        from visualhfsm_makers.unitree._service import serve
    except ModuleNotFoundError as error:
        raise RobotError(missing_package(error, "unitree")) from None
    return serve(robot, assembly, url)
