"""Start the command: `ballmover`, or `python -m ballmover`."""

from __future__ import annotations

import sys


def main() -> None:
    """Run the command; Ctrl-C ends it cleanly even while it loads."""
    try:
        from zenoh_ice.command import run

        from .cli import app
    except KeyboardInterrupt:
        sys.exit(130)
    run(app)


if __name__ == "__main__":
    main()
