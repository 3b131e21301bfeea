"""The entry of `python -m deploy`: it ends quietly while modules load."""

from __future__ import annotations

from startup import loading


def main() -> None:
    """Run the command."""
    with loading():
        from deploy.command import run
    run()
