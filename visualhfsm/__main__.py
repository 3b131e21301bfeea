"""Start the command: `visualhfsm`, or `python -m visualhfsm`."""

from __future__ import annotations

from typing import NoReturn

from zenoh_ice.application import begin_loading


def main() -> NoReturn:
    """Run the command."""
    begin_loading()
    from visualhfsm._base.errors import VisualHfsmError
    from visualhfsm._commands.app import app
    from zenoh_ice.application.cli import run

    run(app, expected=(VisualHfsmError,))


if __name__ == "__main__":
    main()
