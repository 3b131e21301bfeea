"""The entry of `visualhfsm`: it ends quietly while modules load."""

from __future__ import annotations

from typing import NoReturn

from startup import loading


def main() -> NoReturn:
    """Run the command `visualhfsm`."""
    with loading():
        from visualhfsm.command import app
        from visualhfsm.errors import VisualHfsmError
        from zenoh_ice.command import run
    run(app, expected=(VisualHfsmError,))
