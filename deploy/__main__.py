"""Run `python -m deploy STACK.toml`."""

from __future__ import annotations

from startup import loading


def main() -> None:
    """Run the command; Ctrl-C ends it cleanly even while it loads."""
    with loading():
        from deploy.command import run
    run()


if __name__ == "__main__":
    main()
