"""Start the command: `naoserver-naoqi`, or `python -m naoserver_naoqi`."""

from __future__ import annotations

import sys
from typing import NoReturn

import startup


def main() -> NoReturn:
    """Run the command, or say what is not installed."""
    startup.end_at_ctrl_c()
    try:
        from naoserver.errors import RobotError
        from naoserver_naoqi.command import app
        from zenoh_ice.command import run
    except ModuleNotFoundError as error:
        sys.exit(
            f"naoserver-naoqi: error: {error.name} is not installed; type: pip install 'visualhfsm[naoqi]'"
        )
    run(app, expected=(RobotError,))


if __name__ == "__main__":
    main()
