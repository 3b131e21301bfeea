"""Start the command: `naoserver-sim`, or `python -m naoserver_sim`."""

from __future__ import annotations

import os
import sys
from typing import Final, NoReturn

from zenoh_ice.application import begin_loading, end_without, missing_package
from zenoh_ice.application.processor import IN_PART, is_in_part, lacks_of_mujoco

_GL: Final = "MUJOCO_GL"
_LOAD_LIMIT: Final = 30.0  # s


def main() -> NoReturn:
    """Run the command, or report the missing package."""
    begin_loading()
    # On import, MuJoCo would look for GLFW, which starts a process. The cameras need no windows, and
    # create their GL contexts later, according to the variable.
    chosen = os.environ.get(_GL, "")
    os.environ[_GL] = "disable"
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # its threads spin at first; all matrices are small
    if (lack := lacks_of_mujoco()) and not _is_loaded_elsewhere():
        sys.exit(f"naoserver-sim: error: {lack}: use another computer, or give a virtual machine its host's")
    try:
        from naoserver.errors import RobotError
        from naoserver_sim._command import make_app
        from zenoh_ice.application.cli import run
    except ModuleNotFoundError as error:
        end_without("naoserver-sim", "Serve the simulated robot.", missing_package(error, "sim"))
    except ImportError as error:
        if not is_in_part(str(error)):
            raise
        sys.exit(f"naoserver-sim: error: {': '.join(IN_PART)}")
    os.environ[_GL] = chosen
    run(make_app(), expected=(RobotError,))


def _is_loaded_elsewhere() -> bool:
    """Return whether another process can load MuJoCo, as one that was built for this processor."""
    import subprocess

    program = [sys.executable, "-P", "-c", "import mujoco"]
    try:
        return subprocess.run(program, capture_output=True, timeout=_LOAD_LIMIT, check=False).returncode >= 0
    except subprocess.TimeoutExpired:
        return True


if __name__ == "__main__":
    main()
