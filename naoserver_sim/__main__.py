"""Start the command: `naoserver-sim`, or `python -m naoserver_sim`."""

from __future__ import annotations

import sys
from typing import NoReturn

import startup


def main() -> NoReturn:
    """Run the command, or say what is not installed."""
    startup.end_at_ctrl_c()
    try:
        from naoserver.errors import RobotError
        from naoserver_sim.command import app
        from zenoh_ice.command import run
    except ModuleNotFoundError as error:
        sys.exit(f"naoserver-sim: error: {error.name} is not installed; type: pip install 'visualhfsm[sim]'")
    run(app, expected=(RobotError,))


if __name__ == "__main__":
    main()
