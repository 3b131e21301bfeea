"""Start the command: `naoserver-ros2`, or `python -m visualhfsm_ros2.gateway`."""

from __future__ import annotations

import sys
from typing import NoReturn

from zenoh_ice.application import begin_loading, missing_package


def main() -> NoReturn:
    """Run the command, or report the missing package."""
    begin_loading()
    try:
        from visualhfsm_ros2.gateway._command import EXPECTED, app
        from zenoh_ice.application.cli import run
    except ImportError as error:
        cause = error.__cause__ or error
        if not isinstance(cause, ModuleNotFoundError):
            raise
        sys.exit(f"naoserver-ros2: error: {missing_package(cause, 'ros2')}")
    run(app, expected=EXPECTED)


if __name__ == "__main__":
    main()
