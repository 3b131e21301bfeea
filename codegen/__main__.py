"""Start the command: `codegen`, or `python -m codegen`."""

from __future__ import annotations

import errno
import os
import signal
import sys
from types import FrameType

from zenoh_ice.application import end_at_ctrl_c, say_version


def main() -> None:
    """Run the command; Ctrl-C and SIGTERM end it with exit code 130 and 143."""
    say_version()
    end_at_ctrl_c()
    signal.signal(signal.SIGINT, _stop)
    signal.signal(signal.SIGTERM, _stop)
    arguments = sys.argv[1:]
    try:
        if arguments[:1] == ["diff"]:  # no file: those have suffixes
            from ._diff import app

            app(arguments[1:], prog_name="codegen diff")
        else:
            from .command import app

            app(arguments, prog_name="codegen")
    except OSError as error:
        if error.errno not in (errno.ENOSPC, errno.EDQUOT):
            raise
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # for what is left: Python would try again to write it
        sys.exit(f"codegen: error: cannot write: {error.strerror}")


def _stop(number: int, _frame: FrameType | None) -> None:
    """Exit with an exception, so that an unfinished write is undone."""
    raise SystemExit(128 + number)


if __name__ == "__main__":
    main()
