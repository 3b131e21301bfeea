"""How and where a component ended: by its last words, or by what it executed when it was cut short."""

from __future__ import annotations

import re
import signal
from typing import Final

from visualhfsm._origins import Origin, Origins
from visualhfsm._watched_process import describe_exit
from zenoh_ice.application.last_cycle import LastCycle

_NO_ERROR: Final = re.compile(r"[\d-]+ [\d:.]+ (DEBUG|INFO|WARNING) ")
"""The beginning of a line of the log that reports no error."""
_CRASH: Final = "Fatal Python error: "
_ABRUPT: Final = " ends the process before "


class LastWords:
    """What the output of a component says about its end."""

    def __init__(self) -> None:
        self.origin: Origin | None = None
        """Where its last error was raised."""
        self.are_final = False
        """Whether it reported that it crashes, or that its code ends the process at once."""
        self._in_crash = False

    def hear(self, line: str, origin: Origin | None) -> None:
        """Take a line of stderr, and the code to which it refers."""
        if line.startswith(_CRASH):
            self.are_final = self._in_crash = True
            self.origin = None
        elif origin is not None and not _NO_ERROR.match(line):
            if self._in_crash and self.origin is not None:
                return  # the innermost frame of a crash comes first
            self.origin = origin
            self.are_final = self.are_final or _ABRUPT in line


def describe_end(
    code: int, words: LastWords, cut_short: LastCycle | None, origins: Origins | None, *, stopped: bool
) -> tuple[str, Origin | None]:
    """Describe how a component ended, and return where; `stopped` when that was requested.

    `cut_short` is what it executed last if it did not end in an orderly way.
    """
    message = describe_exit(code, stopped=stopped)
    if stopped or (cut_short is None and code == 0):
        return message, None
    if cut_short is None or words.are_final:
        return message, words.origin
    if code == 0:
        message = "it ended at once, with exit code 0"
    if code == -signal.SIGKILL:
        message = f"{message}, by somebody or because memory ran out"
    if origins is None:
        return message, None
    name = origins.state_name(cut_short.automaton, cut_short.state)
    if name:
        when = "during" if cut_short.running else "after"
        message = f"{message}, {when} a cycle in the state {name}"
    return message, origins.element(cut_short.automaton, cut_short.state, cut_short.transition)
