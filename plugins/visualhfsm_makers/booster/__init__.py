"""Serve a T1 as its maker's service of the walk over DDS, so that programs for `B1LocoClient` drive it.

Besides the servants, it is another interface to implementations of `naoserver.robot.Robot`. Commands pass the
same guards as those of servants, never straight to the robot. docs/reference/booster.md lists the calls.
"""

from __future__ import annotations

from contextlib import AbstractContextManager
from typing import TYPE_CHECKING, Final

from naoserver.bodies import require_family
from naoserver.errors import RobotError
from visualhfsm_makers._entrance import entrance_of
from zenoh_ice.application import missing_package

if TYPE_CHECKING:
    from naoserver.robot import Robot
    from naoserver.serving.assembly import Assembly

__all__ = ["ENTRANCE", "serve_as_booster"]


def serve_as_booster(robot: Robot, assembly: Assembly, url: str) -> AbstractContextManager[str]:
    """Serve a started T1 through the guards of `assembly` at `url`, dds:DOMAIN, on loopback alone.

    Use it in a `with` block that ends before the assembly is closed; it gets the URL. Its end stops what
    programs drove. Raises RobotError for another robot than a T1, for a domain
    that cannot be joined, or when the package cyclonedds is missing.
    """
    require_family(robot.body, "T1", "--booster serves a Booster T1")
    try:
        from visualhfsm_makers.booster._service import serve
    except ModuleNotFoundError as error:
        raise RobotError(missing_package(error, "booster")) from None
    return serve(robot, assembly, url)


ENTRANCE: Final = entrance_of(
    "Booster",
    "booster",
    serve_as_booster,
    help="Serve a T1 over DDS on loopback too, for programs that use B1LocoClient.",
    example=("naoserver-sim --body T1 --booster", "programs written for B1LocoClient drive it too"),
)
"""What `naoserver-sim` finds."""
