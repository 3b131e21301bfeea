"""Start the command: `visualhfsm`, or `python -m visualhfsm`."""

from __future__ import annotations

from typing import NoReturn

import startup


def main() -> NoReturn:
    """Run the command."""
    startup.end_at_ctrl_c()
    from visualhfsm.command import app
    from visualhfsm.errors import VisualHfsmError
    from zenoh_ice.command import run

    run(app, expected=(VisualHfsmError,))


if __name__ == "__main__":
    main()
