"""The program of the far end: it talks through standard input and output, of which code sees neither."""

from __future__ import annotations

import contextlib
import io
import os
import resource
import sys
from typing import Final

from visualhfsm_classes.contained._code import FarComponent
from visualhfsm_classes.contained._link import Link
from visualhfsm_classes.contained._protocol import READY, Begin, Limits, Pipe, PipeError, PrintedTooMuch


class Output(io.TextIOWrapper):
    """Where code prints: nobody reads it, and there is an end to it."""

    def __init__(self) -> None:
        super().__init__(open(os.devnull, "wb"))  # noqa: PTH123, SIM115 - until the process ends
        self.most = 0
        """The number of characters that may be printed; 0 is no limit."""
        self._printed = 0

    def write(self, text: str) -> int:
        """Drop a text. Raises PrintedTooMuch."""
        self._printed += len(text)
        if 0 < self.most < self._printed:
            raise PrintedTooMuch(f"printed more than {self.most >> 20} MB")
        return len(text)


OUTPUT: Final = Output()


def main() -> None:
    """Serve the near end until it closes the pipe."""
    pipe = Pipe(os.dup(0), os.dup(1))
    nothing = os.open(os.devnull, os.O_RDWR)
    for file in range(3):
        os.dup2(nothing, file)
    sys.stdout = sys.stderr = OUTPUT
    link = Link(pipe)
    component = FarComponent(link)

    def serve(message: object) -> object:
        if isinstance(message, Begin):
            _limit(message.limits)
        return component.serve(message)

    link.serve = serve
    with contextlib.suppress(PipeError):
        pipe.send(READY)
        link.run()
    os._exit(0)  # code may have left threads, and handlers that run at the end


def _limit(limits: Limits) -> None:
    """Give up what code of others must not have; there is no way back."""
    OUTPUT.most = limits.output
    for kind, most in (
        (resource.RLIMIT_AS, limits.memory),
        (resource.RLIMIT_FSIZE, limits.file),
        (resource.RLIMIT_NOFILE, limits.files),
        (resource.RLIMIT_CPU, limits.cpu),
        (resource.RLIMIT_NPROC, limits.threads),
    ):
        if most:
            resource.setrlimit(kind, (most, most))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


main()
