"""Start the command: `visualhfsm`, or `python -m visualhfsm`."""

from __future__ import annotations

from typing import NoReturn

from zenoh_ice.application import begin_loading


def main() -> NoReturn:
    """Run the command."""
    begin_loading()
    from visualhfsm._command import app
    from visualhfsm._errors import VisualHfsmError
    from zenoh_ice.application.cli import run

    run(app, expected=(VisualHfsmError,))


if __name__ == "__main__":
    main()
