"""Start the command: `naoserver-sim`, or `python -m naoserver_sim`."""

from __future__ import annotations

import sys
from typing import NoReturn

import hfsm_command


def main() -> NoReturn:
    """Run the command, or report the missing package."""
    hfsm_command.end_at_ctrl_c()
    try:
        from hfsm_command.cli import run
        from naoserver.errors import RobotError
        from naoserver_sim.command import app
    except ModuleNotFoundError as error:
        sys.exit(f"naoserver-sim: error: {hfsm_command.missing_package(error, 'sim')}")
    run(app, expected=(RobotError,))


if __name__ == "__main__":
    main()
