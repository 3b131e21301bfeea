"""Serve a T1 as its maker's service of the walk over DDS, so that programs for `B1LocoClient` drive it.

Besides the servants, it is another interface to implementations of `naoserver.robot.Robot`. Commands pass the
same guards as those of servants, never straight to the robot. docs/reference/booster.md lists the calls.
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

__all__ = ["serve_as_booster"]


def serve_as_booster(
    robot: Robot, assembly: Assembly, url: str, *, disk: Path | None = None
) -> AbstractContextManager[str]:
    """Serve a started T1 through the guards of `assembly` at `url`, dds:DOMAIN, on loopback alone.

    Use it in a `with` block that ends before the assembly is closed; it gets the URL. Its end stops what
    programs drove. `disk` is of no use to it. Raises RobotError for another robot than a T1, for a domain
    that cannot be joined, or when the package cyclonedds is missing.
    """
    del disk
    require_family(robot.body, "T1", "--booster serves a Booster T1")
    try:
        from visualhfsm_makers.booster._service import serve
    except ModuleNotFoundError as error:
        raise RobotError(missing_package(error, "booster")) from None
    return serve(robot, assembly, url)
