"""Start the command: `codegen`, or `python -m codegen`."""

from __future__ import annotations

import signal
import sys
from types import FrameType

from zenoh_ice.application import end_at_ctrl_c


def main() -> None:
    """Run the command; Ctrl-C and SIGTERM end it with exit code 130 and 143."""
    end_at_ctrl_c()
    signal.signal(signal.SIGINT, _stop)
    signal.signal(signal.SIGTERM, _stop)
    from zenoh_ice.application.failures import errors_reported

    arguments = sys.argv[1:]
    with errors_reported():
        if arguments[:1] == ["diff"]:  # no file: those have suffixes
            from ._diff import app

            app(arguments[1:], prog_name="codegen diff")
        else:
            from .command import app

            app(arguments, prog_name="codegen")


def _stop(number: int, _frame: FrameType | None) -> None:
    """Exit with an exception, so that an unfinished write is undone."""
    raise SystemExit(128 + number)


if __name__ == "__main__":
    main()
