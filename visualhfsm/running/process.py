"""A child process whose output is read line by line, and of which nothing is left on any way out."""

from __future__ import annotations

import asyncio
import contextlib
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal

import startup

__all__ = ["ChildProcess", "Lines", "Stream"]

Stream = Literal["out", "err"]

_LONGEST_LINE: Final = 4000
"""Characters of a line; the rest of a longer one is its continuation."""
_MOST_LINES: Final = 500
"""Lines that are handed on at a time; of more the oldest are left out and counted."""
_PERIOD: Final = 0.05
"""Seconds between two times that lines are handed on."""
_DRAIN: Final = 0.5
"""Seconds in which the output must end after the process; a grandchild may hold the pipe open."""
_KILL_LIMIT: Final = 2.0
"""Seconds in which a process must be gone after SIGKILL; only one stuck in the kernel takes longer."""


@dataclass(frozen=True, slots=True)
class Lines:
    """Lines that were written since the last time; `dropped` older ones were too many to be handed on."""

    lines: tuple[tuple[Stream, str], ...]
    dropped: int = 0


class ChildProcess(asyncio.SubprocessProtocol):
    """A command in another session, which ends when this process does, however that happens.

    `report` gets its output on the event loop. Signals reach the process alone, so that it can end what it
    has started itself; what is left of its group when it has ended is killed.
    """

    def __init__(self, report: Callable[[Lines], None]) -> None:
        self._report = report
        self._transport: asyncio.SubprocessTransport | None = None
        self._rests: dict[Stream, bytes] = {"out": b"", "err": b""}
        self._pending: list[tuple[Stream, bytes]] = []
        self._dropped = 0
        self._flush: asyncio.TimerHandle | None = None
        self._exited = asyncio.Event()
        self._closed = asyncio.Event()
        self._ended: asyncio.Task[int] | None = None

    @property
    def pid(self) -> int | None:
        """The id of the process; None before it is started."""
        return self._transport.get_pid() if self._transport else None

    async def start(
        self, command: Sequence[str], environment: Mapping[str, str], directory: Path | None = None
    ) -> None:
        """Start a command. Raises OSError when no process can be started."""
        tether = [sys.executable, "-I", "-S", startup.TETHER, str(os.getpid()), "background"]
        # Blocked in the child too: the tether lets it through when it does not end in a traceback any longer.
        blocked = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            self._transport, _ = await asyncio.get_running_loop().subprocess_exec(
                lambda: self,
                *tether,
                *command,
                stdin=subprocess.DEVNULL,
                cwd=directory,
                env={**environment, "PYTHONUNBUFFERED": "1"},
                start_new_session=True,
            )
        finally:
            if signal.SIGINT not in blocked:
                signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
        self._ended = asyncio.create_task(self._end(self._transport))

    async def wait(self) -> int:
        """Wait for the end of the process and its output.

        Returns its exit code, which is minus the number of the signal that ended it, if one did.
        """
        assert self._ended is not None
        return await asyncio.shield(self._ended)

    async def stop(self, patience: Sequence[float]) -> None:
        """End the process: SIGINT, then SIGTERM, then SIGKILL; `patience` has the seconds between them."""
        if self._transport is None or self._ended is None:
            return
        for number, seconds in zip((signal.SIGINT, signal.SIGTERM), patience, strict=True):
            if not self._exited.is_set():
                with contextlib.suppress(ProcessLookupError):
                    self._transport.send_signal(number)
                await asyncio.wait({self._ended}, timeout=seconds)
        self.kill()
        await asyncio.wait({self._ended}, timeout=_KILL_LIMIT)

    def kill(self) -> None:
        """Kill the process with its whole group, unless it has ended, and do not wait."""
        if not self._exited.is_set():
            self._kill_group()

    def _kill_group(self) -> None:
        pid = self.pid
        if pid is not None:
            with contextlib.suppress(ProcessLookupError, PermissionError):
                os.killpg(pid, signal.SIGKILL)

    async def _end(self, transport: asyncio.SubprocessTransport) -> int:
        await self._exited.wait()
        self._kill_group()  # what it left behind
        with contextlib.suppress(TimeoutError):
            await asyncio.wait_for(self._closed.wait(), _DRAIN)
        transport.close()
        for name, rest in self._rests.items():
            if rest:
                self._take(name, [rest])
        self._hand_on()
        code = transport.get_returncode()
        assert code is not None
        return code

    # Called by the event loop.

    def pipe_data_received(self, fd: int, data: bytes) -> None:
        """Take what was written."""
        name: Stream = "out" if fd == 1 else "err"
        *lines, rest = (self._rests[name] + data).rsplit(b"\n", _MOST_LINES)
        if len(lines) == _MOST_LINES:  # the first of them may be many: of a flood most is only counted
            self._dropped += lines[0].count(b"\n")
            lines[0] = lines[0].rpartition(b"\n")[2]
        while len(rest) > _LONGEST_LINE:
            lines.append(rest[:_LONGEST_LINE])
            rest = rest[_LONGEST_LINE:]
        self._rests[name] = rest
        if lines:
            self._take(name, lines)

    def process_exited(self) -> None:
        """Take notice of the end of the process; its output may still be on its way."""
        self._exited.set()

    def connection_lost(self, error: Exception | None) -> None:  # noqa: ARG002
        """Take notice that all of its output has come."""
        self._closed.set()

    # Lines.

    def _take(self, name: Stream, lines: Sequence[bytes]) -> None:
        self._pending.extend((name, line) for line in lines)
        self._dropped += max(0, len(self._pending) - _MOST_LINES)
        del self._pending[:-_MOST_LINES]
        if self._flush is None:
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


def _pieces(line: bytes) -> Iterator[str]:
    text = line.decode(errors="replace").rstrip("\r")
    for start in range(0, max(1, len(text)), _LONGEST_LINE):
        yield text[start : start + _LONGEST_LINE]
