"""Child processes that always end with this one: commands, and processes that answer questions.

A process that answers isolates work that may take long or fail. A question is a line, and its answer is a
line. It ends when its input ends. It must not run code of a document; its time and memory are limited.
"""

from __future__ import annotations

import asyncio
import contextlib
import gc
import os
import resource
import select
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal

from hfsm_command.child import ChildProcess, signal_name

Stream = Literal["out", "err"]

_MEMORY: Final = 4 << 30
"""Limit of the memory of a process that answers questions, in bytes."""
_NEW_OBJECTS: Final = 100_000
"""New objects after which it looks for garbage; with Python's 700, a quarter of its time went into that."""
_END: Final = 2.0
"""Seconds in which it must be gone after SIGKILL."""
_LONGEST_LINE: Final = 4000
"""Characters of a line; the rest of a longer one is its continuation."""
_MOST_LINES: Final = 500
"""Lines that are reported at a time; of more, the oldest are dropped and counted."""
_PERIOD: Final = 0.05
"""Seconds between two reports of lines."""
_INTERRUPTED: Final = 130
_TERMINATED: Final = 143


def child_environment(include: Iterable[Path] = ()) -> dict[str, str]:
    """Return the environment in which a child finds the packages that this process finds.

    `include` are directories with further packages, which come first.
    """
    path = [*map(str, include), *(entry for entry in sys.path if entry)]
    return {**os.environ, "PYTHONPATH": os.pathsep.join(path)}


class NoAnswerError(Exception):
    """The process took too long, or ended; it is restarted for the next question."""


class LineProcess:
    """A module that runs in a process, with one question at a time; it is started when it is first needed.

    Safe to be used from several threads: each waits for its turn.
    """

    def __init__(self, module: str) -> None:
        self._module = module
        self._lock = threading.Lock()
        self._process: subprocess.Popen[bytes] | None = None
        self._closed = False

    def ask(self, question: bytes, patience: float) -> bytes:
        """Return the answer to a question, a line without its end, within `patience` s.

        Raises NoAnswerError.
        """
        with self._lock:
            if self._closed:
                raise NoAnswerError("it has been ended")
            try:
                return self._ask(question, time.monotonic() + patience)
            except OSError as error:
                self._stop()
                raise NoAnswerError("it has ended") from error
            except BaseException:
                self._stop()
                raise

    def close(self) -> None:
        """End the process; a question that waits is not answered."""
        self._closed = True
        process = self._process
        if process is not None:
            process.kill()
        with self._lock:
            self._stop()

    def _ask(self, question: bytes, until: float) -> bytes:
        if self._process is not None and self._process.poll() is not None:
            self._stop()
        process = self._process or self._start()
        assert process.stdin is not None
        assert process.stdout is not None
        process.stdin.write(question + b"\n")
        process.stdin.flush()
        return _read_line(process.stdout.fileno(), until)

    def _start(self) -> subprocess.Popen[bytes]:
        # Not the directory of the documents, but only ours is searched for modules: -P.
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-m", self._module],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env=child_environment(),
            start_new_session=True,
        )
        return self._process

    def _stop(self) -> None:
        process, self._process = self._process, None
        if process is None:
            return
        process.kill()
        for stream in (process.stdin, process.stdout):
            if stream is not None:
                with contextlib.suppress(OSError):  # what was not sent yet has no reader
                    stream.close()
        process.wait(_END)


def answer_lines(answer: Callable[[bytes], bytes]) -> None:
    """Answer questions from stdin until it ends; other output goes to stderr."""
    resource.setrlimit(resource.RLIMIT_AS, (_MEMORY, _MEMORY))
    output = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    os.nice(5)
    gc.freeze()  # what was imported stays
    gc.set_threshold(_NEW_OBJECTS)
    for line in sys.stdin.buffer:
        output.write(answer(line) + b"\n")
        output.flush()


def _read_line(descriptor: int, until: float) -> bytes:
    found = bytearray()
    while not found.endswith(b"\n"):
        left = until - time.monotonic()
        if left <= 0 or not select.select([descriptor], [], [], left)[0]:
            raise NoAnswerError("it takes too long")
        part = os.read(descriptor, 1 << 16)
        if not part:
            raise NoAnswerError("it has ended")
        found += part
    return bytes(found[:-1])


@dataclass(frozen=True, slots=True)
class Lines:
    """Lines that were written since the last report; `dropped` older ones were too many."""

    lines: tuple[tuple[Stream, str], ...]
    dropped: int = 0


class LineReports:
    """Make lines of what a `ChildProcess` writes, and report them a few times a second, on the event loop."""

    def __init__(self, report: Callable[[Lines], None]) -> None:
        self._report = report
        self._rests: dict[Stream, bytes] = {"out": b"", "err": b""}
        self._pending: list[tuple[Stream, bytes]] = []
        self._dropped = 0
        self._flush: asyncio.TimerHandle | None = None

    def __call__(self, descriptor: int, data: bytes) -> None:
        """Take what was written; without data nothing more comes."""
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
        """Whether the process is there."""
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
