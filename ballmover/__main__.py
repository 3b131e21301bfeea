"""Start the command: `ballmover`, or `python -m ballmover`."""

from __future__ import annotations

from typing import NoReturn

from zenoh_ice.application import begin_loading


def main() -> NoReturn:
    """Run the command."""
    begin_loading()
    from zenoh_ice.application.cli import run

    from ._cli import app

    run(app)


if __name__ == "__main__":
    main()
