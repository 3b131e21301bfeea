"""Run `python -m deploy STACK.toml`."""

from __future__ import annotations

import hfsm_command


def main() -> None:
    """Run the command."""
    hfsm_command.end_at_ctrl_c()
    from deploy.command import app
    from hfsm_command.cli import run

    run(app)


if __name__ == "__main__":
    main()
