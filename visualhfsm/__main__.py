"""Start the command: `visualhfsm`, or `python -m visualhfsm`."""

from __future__ import annotations

from typing import NoReturn

import hfsm_command


def main() -> NoReturn:
    """Run the command."""
    hfsm_command.begin_loading()
    from hfsm_command.cli import run
    from visualhfsm.command import app
    from visualhfsm.errors import VisualHfsmError

    run(app, expected=(VisualHfsmError,))


if __name__ == "__main__":
    main()
