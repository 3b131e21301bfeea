"""The entry of `codegen`: it ends quietly at Ctrl-C, while modules load and later."""

from __future__ import annotations

import signal
from types import FrameType

from startup import loading


def main() -> None:
    """Run the command `codegen`; Ctrl-C and SIGTERM end it with exit code 130 and 143."""
    with loading():
        from .commands import app
    signal.signal(signal.SIGINT, _stop)
    signal.signal(signal.SIGTERM, _stop)
    app(prog_name="codegen")


def _stop(number: int, _frame: FrameType | None) -> None:
    """Let what is being written be undone on the way out."""
    raise SystemExit(128 + number)
