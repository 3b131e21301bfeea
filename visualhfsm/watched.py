"""Commands that run as children of this process and always end with it; their output is reported."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final, Literal

from hfsm_command.child import ChildProcess, signal_name

Stream = Literal["out", "err"]

_LONGEST_LINE: Final = 4000
"""Characters of a line; the rest of a longer one is its continuation."""
_MOST_LINES: Final = 500
"""Lines that are reported at a time; of more, the oldest are dropped and counted."""
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
    """Split the output of a `ChildProcess` into lines, and report them on the event loop periodically."""

    def __init__(self, report: Callable[[Lines], None]) -> None:
        self._report = report
        self._rests: dict[Stream, bytes] = {"out": b"", "err": b""}
        self._pending: list[tuple[Stream, bytes]] = []
        self._dropped = 0
        self._flush: asyncio.TimerHandle | None = None

    def __call__(self, descriptor: int, data: bytes) -> None:
        """Take output; empty data marks its end."""
        name: Stream = "out" if descriptor == 1 else "err"
        *lines, rest = (self._rests[name] + data).rsplit(b"\n", _MOST_LINES)
        if len(lines) == _MOST_LINES:  # of a flood of lines, most are only counted
            self._dropped += lines[0].count(b"\n")
            lines[0] = lines[0].rpartition(b"\n")[2]
        while len(rest) > _LONGEST_LINE or (rest and not data):
            lines.append(rest[:_LONGEST_LINE])
            rest = rest[_LONGEST_LINE:]
        self._rests[name] = rest
        self._pending.extend((name, line) for line in lines)
        self._dropped += max(0, len(self._pending) - _MOST_LINES)
        del self._pending[:-_MOST_LINES]
        if not data:
            self._hand_on()
        elif self._pending and self._flush is None:
            self._flush = asyncio.get_running_loop().call_later(_PERIOD, self._hand_on)

    def _hand_on(self) -> None:
        if self._flush is not None:
            self._flush.cancel()
            self._flush = None
        if self._pending or self._dropped:
            lines = tuple((name, text) for name, line in self._pending for text in _pieces(line))
            dropped = self._dropped + max(0, len(lines) - _MOST_LINES)
            self._pending, self._dropped = [], 0
            self._report(Lines(lines[-_MOST_LINES:], dropped))


class WatchedProcess:
    """A command that can be started any number of times, once at a time, and whose end is reported.

    `report` gets its output, `ended` its exit code and whether `stop` ended it, both on the event loop.
    """

    def __init__(self, report: Callable[[Lines], None], ended: Callable[[int, bool], None]) -> None:
        self._report = report
        self._ended = ended
        self._child: ChildProcess | None = None
        self._watch: asyncio.Task[None] | None = None
        self._stopping = False

    @property
    def is_running(self) -> bool:
        """Whether the process runs."""
        return self._watch is not None and not self._watch.done()

    async def start(self, command: Sequence[str], environment: Mapping[str, str]) -> None:
        """Start a command. Raises OSError when no process can be started."""
        child = ChildProcess(LineReports(self._report))
        await child.start(command, environment)
        self._child = child
        self._stopping = False
        self._watch = asyncio.create_task(self._follow(child))

    async def stop(self, patience: Sequence[float]) -> None:
        """End the process as `ChildProcess.stop` does, if there is one, and wait until that is reported."""
        if self._child is None or self._watch is None or self._watch.done():
            return
        self._stopping = True
        await self._child.stop(patience)
        await self._watch

    def kill(self) -> None:
        """Kill the process with its whole group, unless it has ended, and do not wait."""
        if self._child is not None:
            self._child.kill()

    async def _follow(self, child: ChildProcess) -> None:
        self._ended(await child.wait(), self._stopping)


def describe_exit(code: int, *, stopped: bool) -> str:
    """Describe how a process ended; `stopped` when that was requested."""
    if code == 0 or (stopped and code in (_INTERRUPTED, _TERMINATED)):
        return "it was stopped" if stopped else "it has finished"
    if code > 0:
        hint = {1: " after an error", 2: ": its command line is wrong", _INTERRUPTED: " by Ctrl-C"}
        return f"it ended with exit code {code}{hint.get(code, '')}"
    return f"it was terminated by {signal_name(-code)}"


def _pieces(line: bytes) -> Iterator[str]:
    text = line.decode(errors="replace").rstrip("\r")
    for start in range(0, max(1, len(text)), _LONGEST_LINE):
        yield text[start : start + _LONGEST_LINE]
