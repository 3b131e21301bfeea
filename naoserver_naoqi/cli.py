"""The entry of `naoserver-naoqi`: it tells what is not installed, and ends quietly while modules load."""

from __future__ import annotations

import sys
from typing import NoReturn

from startup import loading


def main() -> NoReturn:
    """Run the command `naoserver-naoqi`."""
    try:
        with loading():
            from naoserver.errors import RobotError
            from naoserver_naoqi.command import app
            from zenoh_ice.command import run
    except ModuleNotFoundError as error:
        sys.exit(
            f"naoserver-naoqi: error: {error.name} is not installed; type: pip install 'visualhfsm[naoqi]'"
        )
    run(app, expected=(RobotError,))
