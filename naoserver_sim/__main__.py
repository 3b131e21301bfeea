"""Start the command: `naoserver-sim`, or `python -m naoserver_sim`."""

from __future__ import annotations

import os
import sys
from typing import Final, NoReturn

from zenoh_ice.application import begin_loading, missing_package

_GL: Final = "MUJOCO_GL"


def main() -> NoReturn:
    """Run the command, or report the missing package."""
    begin_loading()
    # On import, MuJoCo would look for GLFW, which starts a process. The cameras need no windows, and
    # create their GL contexts later, according to the variable.
    chosen = os.environ.get(_GL, "")
    os.environ[_GL] = "disable"
    try:
        from naoserver.errors import RobotError
        from naoserver_sim._command import app
        from zenoh_ice.application.cli import run
    except ModuleNotFoundError as error:
        sys.exit(f"naoserver-sim: error: {missing_package(error, 'sim')}")
    os.environ[_GL] = chosen
    run(app, expected=(RobotError,))


if __name__ == "__main__":
    main()
