"""Start the command: `naoserver-naoqi`, or `python -m naoserver_naoqi`."""

from __future__ import annotations

import sys
from typing import NoReturn

import hfsm_command


def main() -> NoReturn:
    """Run the command, or report the missing package."""
    hfsm_command.begin_loading()
    try:
        from hfsm_command.cli import run
        from naoserver.errors import RobotError
        from naoserver_naoqi.command import app
    except ModuleNotFoundError as error:
        sys.exit(f"naoserver-naoqi: error: {hfsm_command.missing_package(error, 'naoqi')}")
    run(app, expected=(RobotError,))


if __name__ == "__main__":
    main()
