"""Start the command: `naoserver-sim`, or `python -m naoserver_sim`."""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Iterator
from typing import Final, NoReturn

import hfsm_command

_GL: Final = "MUJOCO_GL"


def main() -> NoReturn:
    """Run the command, or report the missing package."""
    hfsm_command.end_at_ctrl_c()
    try:
        from hfsm_command.cli import run
        from naoserver.errors import RobotError

        with _no_windows():
            from naoserver_sim.command import app
    except ModuleNotFoundError as error:
        sys.exit(f"naoserver-sim: error: {hfsm_command.missing_package(error, 'sim')}")
    run(app, expected=(RobotError,))


@contextlib.contextmanager
def _no_windows() -> Iterator[None]:
    """Keep MuJoCo, while it is imported, from looking for GLFW, which starts a process.

    The cameras need no windows, and make their GL contexts later as the variable says.
    """
    chosen = os.environ.get(_GL)
    os.environ[_GL] = "disable"
    try:
        yield
    finally:
        if chosen is None:
            del os.environ[_GL]
        else:
            os.environ[_GL] = chosen


if __name__ == "__main__":
    main()
