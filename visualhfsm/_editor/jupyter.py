"""The editor in the launcher of Jupyter, and so for every user of a JupyterHub.

jupyter-server-proxy finds `editor_in_jupyter` by its entry point. It starts the editor at the first request,
passes on what the browser of the server's user sends, and starts another editor when that one dies. Jupyter
checks who the user is; the editor listens where only processes of this user can connect.
"""

from __future__ import annotations

import sys
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final

from zenoh_ice.application import tether_command

_START_LIMIT: Final = 120.0
"""Seconds in which the editor must answer: a whole class may start its editors at once."""
_NEEDED: Final = ("jedi", "starlette", "uvicorn", "websockets")
"""Packages without which the editor does not start."""
_ICON: Final = Path(__file__).parent / "static/icon.svg"


def editor_in_jupyter() -> dict[str, Any]:
    """Return how jupyter-server-proxy runs the editor, `visualhfsm/` below the address of a Jupyter server.

    The launcher shows it only where the packages of the editor are installed.
    """
    return {
        "command": _command,
        "unix_socket": True,
        "timeout": _START_LIMIT,
        "launcher_entry": {
            "title": "VisualHFSM",
            "icon_path": str(_ICON),
            "enabled": all(map(find_spec, _NEEDED)),
        },
    }


def _command(unix_socket: str) -> list[str]:
    """Return the command of the editor of this Jupyter server; the proxy replaces what is in braces in it.

    The page needs no base path, as the proxy takes that off. The editor ends with the server, even with one
    that is killed, but not at Ctrl-C in its terminal, where Jupyter asks first.
    """
    editor = [sys.executable, "-P", "-m", "visualhfsm", "edit", "--no-browser"]
    options = [f"--socket={unix_socket}", f"--root={_folder()}"]
    words = ["setsid", *tether_command(), *editor, *options]
    return [word.replace("{", "{{").replace("}", "}}") for word in words]


def _folder() -> Path:
    """Return the folder that Jupyter shows to its user."""
    from jupyter_server.serverapp import ServerApp

    return Path(ServerApp.instance().root_dir) if ServerApp.initialized() else Path.cwd()
