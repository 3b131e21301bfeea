"""Start the command: `naoserver-ros2`, or `python -m naoserver_ros2`."""

from __future__ import annotations

import sys
from typing import NoReturn

import hfsm_command


def main() -> NoReturn:
    """Run the command, or report the missing package."""
    hfsm_command.begin_loading()
    try:
        from hfsm_command.cli import run
        from naoserver_ros2.command import EXPECTED, app
    except ImportError as error:
        cause = error.__cause__ or error
        if not isinstance(cause, ModuleNotFoundError):
            raise
        sys.exit(f"naoserver-ros2: error: {hfsm_command.missing_package(cause, 'ros2')}")
    run(app, expected=EXPECTED)


if __name__ == "__main__":
    main()
