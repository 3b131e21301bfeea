"""One process of a stack: started in a session of its own, its output logged, ended with rising force."""

from __future__ import annotations

import asyncio
import contextlib
import os
import re
import signal
import sys
import time
from collections import deque
from pathlib import Path
from typing import TextIO

import startup
from deploy.stack import ProcessSpec

__all__ = ["StackProcess", "describe_exit"]

_TAIL_LINES = 15
_LONGEST_LINE = 8192
_CHUNK = 65536
_KILL_LIMIT = 2.0
"""Seconds in which a process must be gone after SIGKILL; only one stuck in the kernel takes longer."""


class StackProcess:
    """A started process.

    Its output goes line by line, each with the seconds since the launch, into `log`; a foreground process has
    the terminal instead. Everything it starts itself stays in its process group and ends with it.
    """

    def __init__(self, spec: ProcessSpec, log: Path, launched_at: float) -> None:
        self.spec = spec
        self.log = log
        self.ready = asyncio.Event()
        self.tail: deque[str] = deque(maxlen=_TAIL_LINES)
        self._launched_at = launched_at
        self._child: asyncio.subprocess.Process | None = None
        self._output: asyncio.Task[None] | None = None

    async def start(self) -> None:
        """Start the process; it is ready at once when the stack file gives no pattern to wait for."""
        foreground = self.spec.foreground
        place = "foreground" if foreground else "background"
        program, *arguments = self.spec.command
        tether = [sys.executable, "-I", "-S", startup.TETHER, str(os.getpid()), place]
        # Blocked in the child too: the tether lets it through when it does not end in a traceback any longer.
        blocked = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            self._child = await asyncio.create_subprocess_exec(
                *tether,
                sys.executable if program == "python" else program,
                *arguments,
                stdin=None if foreground else asyncio.subprocess.DEVNULL,
                stdout=None if foreground else asyncio.subprocess.PIPE,
                stderr=None if foreground else asyncio.subprocess.STDOUT,
                env={**os.environ, "PYTHONUNBUFFERED": "1", **self.spec.environment},
                # A foreground process must stay in the terminal's session to read its keys.
                **({"process_group": 0} if foreground else {"start_new_session": True}),
            )
        finally:
            if signal.SIGINT not in blocked:
                signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
        if self._child.stdout is not None:
            log = self.log.open("w", encoding="utf-8")
            self._output = asyncio.create_task(self._copy_output(self._child.stdout, log))
        if not self.spec.ready:
            self.ready.set()

    async def wait(self) -> int:
        """Wait for the end of the process and of its output.

        Returns its exit code, which is minus the number of the signal that ended it, if one did.
        """
        assert self._child is not None
        code = await self._child.wait()
        if self._output is not None:
            # A grandchild may hold the pipe open; what it writes after this is nobody's concern.
            await asyncio.wait({self._output}, timeout=0.5)
        return code

    async def stop(self, force: asyncio.Event) -> None:
        """End the process and its whole group: SIGINT, SIGTERM after `stop_timeout`, then SIGKILL.

        Setting `force` shortens every wait to nothing.
        """
        if self._child is None:
            return
        for number in (signal.SIGINT, signal.SIGTERM):
            if self._child.returncode is None:
                self._signal(number)
                await self._wait_at_most(self.spec.stop_timeout, force)
        self._signal(signal.SIGKILL)
        with contextlib.suppress(TimeoutError):
            await asyncio.wait_for(self.wait(), _KILL_LIMIT)
        if self._output is not None:
            self._output.cancel()
            await asyncio.wait({self._output})

    def _signal(self, number: signal.Signals) -> None:
        assert self._child is not None
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self._child.pid, number)

    async def _wait_at_most(self, seconds: float, force: asyncio.Event) -> None:
        assert self._child is not None
        ends = {asyncio.create_task(self._child.wait()), asyncio.create_task(force.wait())}
        await asyncio.wait(ends, timeout=seconds, return_when=asyncio.FIRST_COMPLETED)
        for end in ends:
            end.cancel()

    async def _copy_output(self, output: asyncio.StreamReader, log: TextIO) -> None:
        try:
            with log:
                await self._copy_lines(output, log)
        except OSError as error:
            self.tail.append(f"(its log ends here: {error})")
            while await output.read(_CHUNK):  # otherwise it would stand still once the pipe is full
                pass

    async def _copy_lines(self, output: asyncio.StreamReader, log: TextIO) -> None:
        rest = b""
        while chunk := await output.read(_CHUNK):
            *lines, rest = (rest + chunk).split(b"\n")
            if len(rest) > _LONGEST_LINE:
                lines, rest = [*lines, rest], b""
            for line in lines:
                self._note(line, log)
            log.flush()
        if rest:
            self._note(rest, log)

    def _note(self, raw: bytes, log: TextIO) -> None:
        line = raw.decode(errors="replace").rstrip("\r")
        log.write(f"{time.monotonic() - self._launched_at:9.3f} {line}\n")
        self.tail.append(line)
        if self.spec.ready and re.search(self.spec.ready, line):
            self.ready.set()


def describe_exit(code: int) -> str:
    """Say in words how a process ended, for example `was ended by SIGKILL`."""
    if code >= 0:
        return f"ended with exit code {code}"
    try:
        return f"was ended by {signal.Signals(-code).name}"
    except ValueError:
        return f"was ended by signal {-code}"
