"""What fails while a component runs, and how and where in the document it ended.

That is what its output says of errors, and of its end; when it was cut short, what it executed then.
"""

from __future__ import annotations

import re
import signal
from collections.abc import Mapping
from typing import Final, NamedTuple

from codegen.messages import Message
from visualhfsm._base.output_lines import describe_exit
from visualhfsm._base.recognition import recognized
from visualhfsm._document.origins import Origin, Origins
from visualhfsm._monitor.messages import Stopper
from zenoh_ice.application.last_cycle import LastCycle

_RECORD: Final = re.compile(r"[\d-]+ [\d:.]+ ([A-Z]+) ")
"""The beginning of a record of the log, with its level."""
_ERROR: Final = re.compile(
    r"[\d-]+ [\d:.]+ (?:ERROR|CRITICAL) +[^:]+: (?P<where>.+?): (?P<what>.+) at \S+:\d+ \([^()]+\)"
    r"(?: \(\d+ times more since it was last logged\))?",
    re.DOTALL,
)
"""A record of an error in the code of a state, `where`; `hfsm_runtime/_supervision.py` writes it."""
_REFUSED: Final = re.compile(
    r"[^ :]+: error: (?:[^ :]+:\d+: )?(?P<what>.+?)(?: at \S+:\d+ \([^()]+\))?", re.DOTALL
)
"""The last line of a component that could not start."""
_TRACEBACK: Final = "Traceback (most recent call last):"
_CRASH: Final = "Fatal Python error: "
_EXCEPTION: Final = re.compile(
    r"(?P<kind>[A-Za-z_][\w.]*(?:Error|Exception|Interrupt|Exit))\b(?:: (?P<what>.*))?"
)
_ENDS: Final = re.compile(r"(?P<call>[\w.]+\(.*?\)) ends the ")
"""The beginning of what the runtime says of code that ends the process."""
_LONGEST_TEXT: Final = 4000
"""Characters of a message that is collected from several lines."""
_MOST_FAILURES: Final = 50
"""Failures of a run that are kept; each place and message counts once."""
_NO_ERROR: Final = re.compile(r"[\d-]+ [\d:.]+ (DEBUG|INFO|WARNING) ")
"""The beginning of a line of the log that reports no error."""
_ABRUPT: Final = " ends the process before "
_ABANDONED: Final = " is abandoned: its code must not block"
_STOPPED: Final[Mapping[Stopper | None, Message]] = {
    None: Message("it was stopped"),
    "window": Message("it was stopped in another window"),
    "viewer": Message("it was stopped by a viewer"),
}


class Failure(NamedTuple):
    """An error while a component ran: where, in which state, and what it says."""

    origin: Origin
    state: str
    """The name of the state whose code, or a transition out of which, failed; empty if it is unknown."""
    message: Message

    @property
    def where(self) -> str:
        """What people call the state or the transition; empty if it is unknown."""
        return self.origin.transition or self.state

    @property
    def in_short(self) -> Message:
        """What happened, and in which state or transition, in short: `float division by zero in left`."""
        found, ends = _EXCEPTION.fullmatch(self.message), _ENDS.match(self.message)
        what = self.message
        if ends is not None:
            what = Message.verbatim(ends["call"])
        elif found is not None and " " in (found["what"] or ""):
            what = recognized(found["what"].partition("; ")[0])
        where = self.where
        if not where:
            return what
        if "," in what:
            return Message("{what}, in {state}", what=what, state=where)
        return Message("{what} in {state}", what=what, state=where)


class Failures:
    """Finds the errors in the lines that one run of a component writes to stderr."""

    def __init__(self) -> None:
        self.last: Failure | None = None
        """The newest one."""
        self.printed: Failure | None = None
        """The newest traceback outside of the log: what ended the component, or what code has caught."""
        self._known: set[tuple[Origin, str]] = set()
        self._text = ""
        """The beginning of a message that has several lines."""
        self._reported: Failure | None = None
        """The error whose traceback may follow."""
        self._frames: list[Origin] | None = None
        """The code that a traceback has led through; None outside of one."""

    def parse(self, line: str, origin: Origin | None) -> list[Failure]:
        """Take a line of stderr, and the code to which it refers; return the failures that it completes."""
        if self._frames is not None:
            return self._in_traceback(line, origin)
        if line.startswith(_TRACEBACK):
            self._frames, self._text = [], ""
            return []
        if line.startswith(_CRASH):
            self._text = line.removeprefix(_CRASH)
            return []
        record = _RECORD.match(line)
        if record is not None or _REFUSED.match(line):
            self._text, self._reported = line, None
        elif self._text:
            self._text = f"{self._text}\n{line}"[:_LONGEST_TEXT]
        if (
            not self._text
            or origin is None
            or (record is not None and record[1] not in ("ERROR", "CRITICAL"))
        ):
            return []
        return self._complete(origin)

    def end(self, message: Message, origin: Origin | None, state: str) -> list[Failure]:
        """Take how the run ended, and where, unless its output has said what was wrong there."""
        if origin is None or (self.last is not None and origin.place.part):
            return []
        if self.printed is not None and self.printed.origin == origin:
            return self._add(self.printed)
        return self._add(Failure(origin, state, Message("the component ended here: {how}", how=message)))

    def _complete(self, origin: Origin) -> list[Failure]:
        """Return the failure of a text whose last line has its place."""
        text, self._text = self._text, ""
        found = _ERROR.fullmatch(text)
        if found is not None:
            self._reported = Failure(origin, found["where"].rpartition("/")[2], recognized(found["what"]))
            return self._add(self._reported)
        refused = _REFUSED.fullmatch(text)
        what = refused["what"] if refused else text.partition("\n")[0]
        return [] if _RECORD.match(text) else self._add(Failure(origin, "", recognized(what)))

    def _in_traceback(self, line: str, origin: Origin | None) -> list[Failure]:
        assert self._frames is not None
        reported = self._reported
        if origin is not None:
            self._frames.append(origin)
            if reported is not None and len(self._frames) == 1 and origin.place != reported.origin.place:
                # The code of a state has called a function, which failed.
                what = Message("this calls code that fails: {what}", what=reported.message)
                return self._add(Failure(origin, reported.state, what), is_last=False)
            return []
        if line.startswith((" ", "\t")) or not line:
            return []
        frames, self._frames = self._frames, None
        if reported is None and frames and _EXCEPTION.match(line):
            self.printed = Failure(frames[-1], "", recognized(line))
        return []

    def _add(self, failure: Failure, *, is_last: bool = True) -> list[Failure]:
        if is_last:
            self.last = failure
        key = failure.origin, failure.message
        if key in self._known or len(self._known) >= _MOST_FAILURES:
            return []
        self._known.add(key)
        return [failure]


class LastWords:
    """What the output of a component says about its end."""

    def __init__(self) -> None:
        self.origin: Origin | None = None
        """Where its last error was raised."""
        self.are_final = False
        """True once it reported that it crashes, or that its code ends the process at once."""
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
