"""Start the command: `naoserver-naoqi`, or `python -m naoserver.naoqi`."""

from __future__ import annotations

import sys
from typing import NoReturn

from zenoh_ice.application import begin_loading, missing_package


def main() -> NoReturn:
    """Run the command, or report the missing package."""
    begin_loading()
    try:
        from naoserver.errors import RobotError
        from naoserver.naoqi._command import app
        from zenoh_ice.application.cli import run
    except ModuleNotFoundError as error:
        sys.exit(f"naoserver-naoqi: error: {missing_package(error, 'naoqi')}")
    run(app, expected=(RobotError,))


if __name__ == "__main__":
    main()
