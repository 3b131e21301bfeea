"""The output of commands as lines, and how they ended in words."""

from __future__ import annotations

import asyncio
import signal
import time
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from operator import itemgetter
from typing import Final, Literal

from codegen.messages import Message
from zenoh_ice.data.text import signal_name

Stream = Literal["out", "err"]

_LONGEST_LINE: Final = 4000
"""Characters of a line; the rest of a longer one is its continuation."""
_LINES: Final = 2000
"""Lines that are reported in a second, and at a time; of more, the oldest are left out and counted, those of
stdout first: what a process says of errors must not drown in what it prints."""
_CHARACTERS: Final = 400_000
"""Characters, in the same way."""
_LAST: Final = 0.1
"""The part of both that is reported at the end in any case: the last lines say why a process ended."""
_PERIOD: Final = 0.05
"""Seconds between two reports of lines."""
_INTERRUPTED: Final = 130
_TERMINATED: Final = 143


@dataclass(frozen=True, slots=True)
class Lines:
    """Lines that were written since the last report; `dropped` older ones were too many."""

    lines: tuple[tuple[Stream, str], ...]
    dropped: int = 0


class LineReports:
    """Split the output of a `ChildProcess` into lines, and report them on the event loop periodically.

    It takes whatever comes, so that the process never waits, but splits only what it reports: the process may
    write a hundred times as much.
    """

    def __init__(self, report: Callable[[Lines], None]) -> None:
        self._report = report
        self._rests: dict[Stream, bytes] = {"out": b"", "err": b""}
        self._written: deque[tuple[Stream, bytes]] = deque()
        """Whole lines that wait, as they came."""
        self._size = 0
        self._dropped = 0
        self._flush: asyncio.TimerHandle | None = None
        self._allowed = 1.0
        """The part of the limits that may be reported now; it grows with time."""
        self._reported_at = 0.0

    def __call__(self, descriptor: int, data: bytes) -> None:
        """Take output; empty data marks its end."""
        name: Stream = "out" if descriptor == 1 else "err"
        whole, newline, rest = (self._rests[name] + data).rpartition(b"\n")
        if newline:
            self._keep(name, whole)
        if len(rest) > _LONGEST_LINE or (rest and not data):
            self._keep(name, rest)
            rest = b""
        self._rests[name] = rest
        if not data:
            self._allowed = max(self._allowed, _LAST)
            self._hand_on()
        elif self._written and self._flush is None:
            self._flush = asyncio.get_running_loop().call_later(_PERIOD, self._hand_on)

    def _keep(self, name: Stream, lines: bytes) -> None:
        self._written.append((name, lines))
        self._size += len(lines)
        while self._size > _CHARACTERS and len(self._written) > 1:
            index = next((index for index, (stream, _) in enumerate(self._written) if stream == "out"), 0)
            _, oldest = self._written[index]
            del self._written[index]
            self._size -= len(oldest)
            self._dropped += _count(oldest)

    def _hand_on(self) -> None:
        if self._flush is not None:
            self._flush.cancel()
            self._flush = None
        now = time.monotonic()
        self._allowed = min(1.0, self._allowed + now - self._reported_at)
        self._reported_at = now
        if self._written or self._dropped:
            lines = self._newest()
            dropped, self._dropped = self._dropped, 0
            self._report(Lines(tuple(lines), dropped))

    def _newest(self) -> list[tuple[Stream, str]]:
        """Return the newest lines that the limits allow, in their order, and count the others."""
        found: list[tuple[int, Stream, str]] = []
        room, characters = int(self._allowed * _LINES), int(self._allowed * _CHARACTERS)
        newest = reversed([*enumerate(self._written)])
        for index, (name, written) in sorted(newest, key=lambda each: each[1][0] == "out"):
            lines = written.rsplit(b"\n", max(0, room))
            if len(lines) > room:  # the first are more than one line
                self._dropped += _count(lines.pop(0))
            for text in (piece for line in reversed(lines) for piece in reversed([*_pieces(line)])):
                room -= 1
                characters -= len(text)
                if room < 0 or characters < 0:
                    self._dropped += 1
                else:
                    found.append((index, name, text))
        self._written.clear()
        self._size = 0
        characters_used = sum(len(text) for *_, text in found)
        self._allowed -= max(len(found) / _LINES, characters_used / _CHARACTERS)
        found.reverse()
        found.sort(key=itemgetter(0))
        return [(name, text) for _, name, text in found]


def describe_exit(code: int, stopped: Message | None = None) -> Message:
    """Describe how a process ended; `stopped` describes an end that was requested, if one was."""
    if stopped is not None and code in (0, _INTERRUPTED, _TERMINATED, -signal.SIGINT):
        return stopped
    if code < 0:
        return Message("it was terminated by {signal}", signal=signal_name(-code))
    match code:
        case 0:
            return Message("it has finished")
        case 1:
            return Message("it ended with exit code 1 after an error")
        case 2:
            return Message("it ended with exit code 2: its command line is wrong")
        case _ if code == _INTERRUPTED:
            return Message("it ended with exit code {code} by Ctrl-C", code=code)
    return Message("it ended with exit code {code}", code=code)


def _count(lines: bytes) -> int:
    return lines.count(b"\n") + 1


def _pieces(line: bytes) -> Iterator[str]:
    text = line.decode(errors="replace").rstrip("\r")
    for start in range(0, max(1, len(text)), _LONGEST_LINE):
        yield text[start : start + _LONGEST_LINE]
