"""Start the command: `ballmover`, or `python -m ballmover`."""

from __future__ import annotations

from typing import NoReturn

import startup


def main() -> NoReturn:
    """Run the command."""
    startup.end_at_ctrl_c()
    from zenoh_ice.command import run

    from .cli import app

    run(app)


if __name__ == "__main__":
    main()
