"""Run `python -m deploy STACK.toml`."""

from __future__ import annotations

import startup


def main() -> None:
    """Run the command."""
    startup.end_at_ctrl_c()
    from deploy.command import app
    from zenoh_ice.command import run

    run(app)


if __name__ == "__main__":
    main()
