"""The entrance of a maker's programs, which come in over DDS."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from typing import Annotated, Any, Final

import typer

from naoserver.robot import Robot
from naoserver.serving.assembly import Assembly
from naoserver.serving.entrances import Entrance

_DOMAIN: Final = "With --unitree or --booster: the domain of DDS; real robots are in 0."


def entrance_of(
    programs: str,
    option: str,
    serve: Callable[[Robot, Assembly, str], AbstractContextManager[str]],
    *,
    help: str,
    example: tuple[str, str],
) -> Entrance:
    """Return the entrance that a flag asks for, in the domain that another option gives."""

    def enter(robot: Robot, assembly: Assembly, options: Mapping[str, Any]) -> AbstractContextManager[str]:
        return serve(robot, assembly, f"dds:{options['dds_domain']}")

    return Entrance(
        programs=programs,
        options={
            option: (Annotated[bool, typer.Option(f"--{option}", help=help)], False),
            "dds_domain": (Annotated[int, typer.Option(min=0, max=232, help=_DOMAIN)], 1),
        },
        serve=enter,
        example=example,
        apart={"dds_domain": lambda domain, number: domain + number},
    )
