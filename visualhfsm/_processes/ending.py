"""How and where a component ended: by its last words, or by what it executed when it was cut short."""

from __future__ import annotations

import re
import signal
from collections.abc import Mapping
from typing import Final, NamedTuple

from codegen.messages import Message
from visualhfsm._base.watched_process import describe_exit
from visualhfsm._document.origins import Origin, Origins
from visualhfsm._monitor.messages import Stopper
from visualhfsm._processes.failures import Failure, Failures
from zenoh_ice.application.last_cycle import LastCycle

_NO_ERROR: Final = re.compile(r"[\d-]+ [\d:.]+ (DEBUG|INFO|WARNING) ")
"""The beginning of a line of the log that reports no error."""
_CRASH: Final = "Fatal Python error: "
_ABRUPT: Final = " ends the process before "
_ABANDONED: Final = " is abandoned: its code must not block"
_STOPPED: Final[Mapping[Stopper | None, Message]] = {
    None: Message("it was stopped"),
    "window": Message("it was stopped in another window"),
    "viewer": Message("it was stopped by a viewer"),
}


class LastWords:
    """What the output of a component says about its end."""

    def __init__(self) -> None:
        self.origin: Origin | None = None
        """Where its last error was raised."""
        self.are_final = False
        """Whether it reported that it crashes, or that its code ends the process at once."""
        self.abandoned: Failure | None = None
        """The cycle that it did not wait for at its end, the first of several."""
        self.failures = Failures()
        """The errors that it reported."""
        self._in_crash = False

    def parse(self, line: str, origin: Origin | None) -> list[Failure]:
        """Take a line of stderr, and the code to which it refers; return the failures that it completes."""
        found = self.failures.parse(line, origin)
        if _ABANDONED in line and origin is not None:
            self.abandoned = self.abandoned or self.failures.last
        if line.startswith(_CRASH):
            self.are_final = self._in_crash = True
            self.origin = None
        elif origin is not None and not _NO_ERROR.match(line):
            if self._in_crash and self.origin is not None:
                return found  # the innermost frame of a crash comes first
            self.origin = origin
            self.are_final = self.are_final or _ABRUPT in line
        return found


class End(NamedTuple):
    """How a component ended, in words, and where; `state` is the name of the state, as far as it is known."""

    message: Message
    origin: Origin | None = None
    state: str = ""


def describe_end(
    code: int,
    words: LastWords,
    cut_short: LastCycle | None,
    origins: Origins | None,
    *,
    stopped: bool,
    by: Stopper | None = None,
) -> End:
    """Describe how a component ended; `stopped` when that was requested, `by` somebody who is to be named.

    `cut_short` is what it executed last if it did not end in an orderly way.
    """
    if stopped:
        return _describe_stop(code, words, cut_short, origins, _STOPPED[by])
    message = describe_exit(code)
    if code == -signal.SIGKILL:
        message = Message("{ending}, by somebody or because memory ran out", ending=message)
    if cut_short is None and code == 0:
        return End(message)
    state = "" if cut_short is None or origins is None else origins.state_name(*cut_short[:2])
    failure = words.failures.last or words.failures.printed
    if cut_short is None or words.are_final:
        if failure is not None and code != 0:
            failure = failure if failure.state else failure._replace(state=state)
            message = Message("it ended: {what}", what=failure.in_short)
        return End(message, words.origin, state)
    if code == 0:
        message = Message("it ended at once, with exit code 0")
    if origins is None:
        return End(message)
    if state:
        if cut_short.running:
            message = Message("{ending}, during a cycle in the state {state}", ending=message, state=state)
        else:
            message = Message("{ending}, after a cycle in the state {state}", ending=message, state=state)
    place = origins.element(cut_short.automaton, cut_short.state, cut_short.transition)
    return End(message, place, state)


def _describe_stop(
    code: int, words: LastWords, cut_short: LastCycle | None, origins: Origins | None, stopped: Message
) -> End:
    """Describe an end that was requested, and where the code hung that did not end by itself."""
    hung = words.abandoned
    place: Origin | None
    if hung is not None:
        where, place, state = hung.where, hung.origin, hung.state
    elif code == -signal.SIGKILL and cut_short is not None and cut_short.running and origins is not None:
        place = origins.element(cut_short.automaton, cut_short.state, cut_short.transition)
        where = state = origins.state_name(*cut_short[:2])
    else:
        return End(describe_exit(code, stopped))
    return End(Message("{ending} while hanging in {state}", ending=stopped, state=where), place, state)
