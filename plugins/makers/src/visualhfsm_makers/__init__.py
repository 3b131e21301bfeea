"""Serve a robot over DDS as its maker does, so that programs of the makers of the G1 and the T1 drive it.

Besides the servants, it is another interface to implementations of `naoserver.robot.Robot`. Commands pass the
same guards as those of servants, never straight to the robot. docs/unitree.md and docs/booster.md list
what is served.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import AbstractContextManager
from importlib import import_module
from typing import Annotated, Any, Final

import typer

from naoserver.bodies import require_family
from naoserver.errors import RobotError
from naoserver.robot import Robot
from naoserver.serving.assembly import Assembly
from naoserver.serving.entrances import Entrance
from zenoh_ice.application import missing_package

_DOMAIN: Final = "With --unitree or --booster: the domain of DDS; real robots are in 0."


def _entrance_of(maker: str, family: str, *, help: str, example: tuple[str, str]) -> Entrance:
    """Return the entrance for programs of a maker, which serves the maker's robot, of a family."""
    programs = maker.capitalize()

    def serve(robot: Robot, assembly: Assembly, options: Mapping[str, Any]) -> AbstractContextManager[str]:
        """Serve a started robot in a domain of DDS, on loopback alone; the end stops what programs drove.

        Raises RobotError for a robot of another family, for a domain that cannot be joined, or when the
        package cyclonedds is missing.
        """
        require_family(robot.body, family, f"--{maker} serves a {programs} {family}")
        try:
            service = import_module(f"visualhfsm_makers._{maker}._service")
        except ModuleNotFoundError as error:
            raise RobotError(missing_package(error, maker)) from None
        served: AbstractContextManager[str] = service.serve(robot, assembly, f"dds:{options['dds_domain']}")
        return served

    return Entrance(
        programs=programs,
        options={
            maker: (Annotated[bool, typer.Option(f"--{maker}", help=help)], False),
            "dds_domain": (Annotated[int, typer.Option(min=0, max=232, help=_DOMAIN)], 1),
        },
        serve=serve,
        example=example,
        apart={"dds_domain": lambda domain, number: domain + number},
    )


UNITREE: Final = _entrance_of(
    "unitree",
    "G1",
    help="Serve a G1 over DDS on loopback too, for its maker's programs.",
    example=("naoserver-sim --body G1 --unitree", "its maker's programs drive it too"),
)
BOOSTER: Final = _entrance_of(
    "booster",
    "T1",
    help="Serve a T1 over DDS on loopback too, for programs that use B1LocoClient.",
    example=("naoserver-sim --body T1 --booster", "programs written for B1LocoClient drive it too"),
)
