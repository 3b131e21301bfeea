"""Start the command: `ballmover`, or `python -m ballmover`."""

from __future__ import annotations

from typing import NoReturn

import hfsm_command


def main() -> NoReturn:
    """Run the command."""
    hfsm_command.begin_loading()
    from hfsm_command.cli import run

    from .cli import app

    run(app)


if __name__ == "__main__":
    main()
