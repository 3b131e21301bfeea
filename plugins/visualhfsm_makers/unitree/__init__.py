"""Serve a G1 over DDS as its maker's robot does, so that its maker's programs drive it.

Besides the servants, it is another interface to implementations of `naoserver.robot.Robot`. Commands pass the
same guards as those of servants, never straight to the robot. docs/reference/unitree.md lists what it serves.
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

__all__ = ["ENTRANCE", "serve_as_unitree"]


def serve_as_unitree(robot: Robot, assembly: Assembly, url: str) -> AbstractContextManager[str]:
    """Serve a started G1 through the guards of `assembly` at `url`, dds:DOMAIN, on loopback alone.

    Use it in a `with` block that ends before the assembly is closed; it gets the URL. Its end stops what
    programs drove. Raises RobotError for another robot than a G1, for a domain
    that cannot be joined, or when the package cyclonedds is missing.
    """
    require_family(robot.body, "G1", "--unitree serves a Unitree G1")
    try:
        from visualhfsm_makers.unitree._service import serve
    except ModuleNotFoundError as error:
        raise RobotError(missing_package(error, "unitree")) from None
    return serve(robot, assembly, url)


ENTRANCE: Final = entrance_of(
    "Unitree",
    "unitree",
    serve_as_unitree,
    help="Serve a G1 over DDS on loopback too, for its maker's programs.",
    example=("naoserver-sim --body G1 --unitree", "its maker's programs drive it too"),
)
"""What `naoserver-sim` finds."""
