"""Start the command: `ballmover`, or `python -m ballmover`."""

from __future__ import annotations

from startup import loading


def main() -> None:
    """Run the command; Ctrl-C ends it cleanly even while it loads."""
    with loading():
        from zenoh_ice.command import run

        from .cli import app
    run(app)


if __name__ == "__main__":
    main()
