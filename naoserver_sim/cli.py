"""The entry of `naoserver-sim`: it tells what is not installed, and ends quietly while modules load."""

from __future__ import annotations

import sys
from typing import NoReturn

from startup import loading


def main() -> NoReturn:
    """Run the command `naoserver-sim`."""
    try:
        with loading():
            from naoserver.errors import RobotError
            from naoserver_sim.command import app
            from zenoh_ice.command import run
    except ModuleNotFoundError as error:
        sys.exit(f"naoserver-sim: error: {error.name} is not installed; type: pip install 'visualhfsm[sim]'")
    run(app, expected=(RobotError,))
