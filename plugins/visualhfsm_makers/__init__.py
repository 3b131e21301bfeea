"""Serve a robot over DDS as its maker does, so that programs of the makers of the G1 and the T1 drive it.

Besides the servants, it is another interface to implementations of `naoserver.robot.Robot`. Commands pass the
same guards as those of servants, never straight to the robot. docs/reference/unitree.md and booster.md list
what is served.
"""

from __future__ import annotations

from contextlib import AbstractContextManager
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Final

from naoserver.bodies import require_family
from naoserver.errors import RobotError
from zenoh_ice.application import missing_package

if TYPE_CHECKING:
    from naoserver.protocol.robot import Robot
    from naoserver.serving.assembly import Assembly

__all__ = ["BOOSTER", "UNITREE", "Maker"]


class Maker:
    """A maker as an entrance of a robot server: the option of its name serves its robot, of a `family`."""

    def __init__(self, name: str, family: str) -> None:
        self._name: Final = name
        self._family: Final = family

    def __call__(
        self, robot: Robot, assembly: Assembly, url: str, *, disk: Path | None = None
    ) -> AbstractContextManager[str]:
        """Serve a started robot through the guards of `assembly` at `url`, dds:DOMAIN, on loopback alone.

        Use it in a `with` block that ends before the assembly is closed; it gets the URL. Its end stops what
        programs drove. `disk` is of no use to it. Raises RobotError for a robot of another family, for a
        domain that cannot be joined, or when the package cyclonedds is missing.
        """
        del disk
        require_family(
            robot.body, self._family, f"--{self._name} serves a {self._name.capitalize()} {self._family}"
        )
        try:
            service = import_module(f"visualhfsm_makers._{self._name}._service")
        except ModuleNotFoundError as error:
            raise RobotError(missing_package(error, self._name)) from None
        served: AbstractContextManager[str] = service.serve(robot, assembly, url)
        return served


UNITREE: Final = Maker("unitree", "G1")
BOOSTER: Final = Maker("booster", "T1")
