"""Start the command: `naoserver-naoqi`, or `python -m naoserver.naoqi`."""

from __future__ import annotations

from typing import NoReturn

from zenoh_ice.application import begin_loading, end_without, missing_package


def main() -> NoReturn:
    """Run the command, or report the missing package."""
    begin_loading()
    try:
        from naoserver.errors import RobotError
        from naoserver.naoqi._command import app
        from zenoh_ice.application.cli import run
    except ModuleNotFoundError as error:
        end_without("naoserver-naoqi", "Serve the real robot.", missing_package(error, "naoqi"))
    run(app, expected=(RobotError,))


if __name__ == "__main__":
    main()
