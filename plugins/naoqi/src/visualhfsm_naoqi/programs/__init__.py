"""Serve any Nao as NAOqi over libqi, so that programs written for NAOqi drive it.

Besides the servants, it is another interface to implementations of `naoserver.robot.Robot`: the simulated
robot (`naoserver-sim --qi`) and the fake one (`python -m visualhfsm_naoqi.programs`), which replaces a real
robot in the tests of `visualhfsm_naoqi.robot`. Commands pass the same guards as those of servants, never
straight to the robot.

Where versions of NAOqi differ, it behaves as 2.8 on a NAO6. docs/virtual-nao.md lists the services.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

from naoserver.bodies import require_family
from naoserver.errors import RobotError
from naoserver.serving.entrances import Entrance, later_port
from visualhfsm_naoqi import lacking

if TYPE_CHECKING:
    from naoserver.robot import Robot
    from naoserver.serving.assembly import Assembly

_QI: Final = "Serve it as NAOqi too, for programs that use qi, such as at tcp://127.0.0.1:9559."
_DISK: Final = "With --qi: the folder that stands for the robot's disk, where its sounds are."

Disk = Annotated[Path | None, typer.Option(metavar="DIR", help=_DISK, exists=True, file_okay=False)]


def serve_as_naoqi(
    robot: Robot, assembly: Assembly, url: str, *, disk: Path | None = None
) -> AbstractContextManager[str]:
    """Serve a started Nao as NAOqi at `url`, say tcp://127.0.0.1:9559, through the guards of `assembly`.

    The folder `disk` represents the robot's disk, with sounds to play and its recordings; by default it is a
    temporary folder.

    Use it in a `with` block that ends before the assembly is closed. The block gets the URL, with the port
    that the system picked for port 0; its end cancels running calls and closes every connection. Raises
    RobotError for another robot than a Nao, when it cannot listen there, or when the package qi is missing.
    """
    require_family(robot.body, "H25", "--qi serves NAOqi, the system of the Nao")
    try:
        from visualhfsm_naoqi.programs._service import serve
    except ModuleNotFoundError as error:
        raise RobotError(lacking(error)) from None
    return serve(robot, assembly, url, disk=disk)


def _enter(robot: Robot, assembly: Assembly, options: Mapping[str, Any]) -> AbstractContextManager[str]:
    return serve_as_naoqi(robot, assembly, options["qi"], disk=options["disk"])


ENTRANCE: Final = Entrance(
    programs="NAOqi",
    options={
        "qi": (Annotated[str | None, typer.Option(metavar="URL", help=_QI)], None),
        "disk": (Disk, None),
    },
    serve=_enter,
    example=("naoserver-sim --qi tcp://127.0.0.1:9559", "programs written for NAOqi drive it too"),
    apart={"qi": later_port},
)
"""What `naoserver-sim` finds."""
