"""Start the command: `codegen`, or `python -m codegen`."""

from __future__ import annotations

import signal
from types import FrameType

import hfsm_command


def main() -> None:
    """Run the command; Ctrl-C and SIGTERM end it with exit code 130 and 143."""
    hfsm_command.end_at_ctrl_c()
    from .command import app

    signal.signal(signal.SIGINT, _stop)
    signal.signal(signal.SIGTERM, _stop)
    app(prog_name="codegen")


def _stop(number: int, _frame: FrameType | None) -> None:
    """Exit with an exception, so that an unfinished write is undone."""
    raise SystemExit(128 + number)


if __name__ == "__main__":
    main()
