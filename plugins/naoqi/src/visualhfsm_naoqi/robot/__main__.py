"""Start the command: `naoserver-naoqi`, or `python -m visualhfsm_naoqi.robot`."""

from __future__ import annotations

from typing import NoReturn

from visualhfsm_naoqi import lacking
from zenoh_ice.application import begin_loading, end_without


def main() -> NoReturn:
    """Run the command, or report the missing package."""
    begin_loading()
    try:
        from naoserver.errors import RobotError
        from visualhfsm_naoqi.robot._command import app
        from zenoh_ice.application.cli import run
    except ModuleNotFoundError as error:
        end_without("naoserver-naoqi", "Serve the real robot.", lacking(error))
    run(app, expected=(RobotError,))


if __name__ == "__main__":
    main()
