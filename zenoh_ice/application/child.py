"""Child processes on the event loop that always end with this one."""

from __future__ import annotations

import asyncio
import contextlib
import errno
import os
import signal
import subprocess
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any, Final, cast

from zenoh_ice.application import LAUNCHER, tether_command

_DRAIN: Final = 0.5
"""Seconds in which the output must end after the process; a grandchild may hold the pipe open."""
_KILL_LIMIT: Final = 2.0
"""Seconds within which a process must end after SIGKILL; only one stuck in the kernel takes longer."""


class ChildProcess:
    """A command in its own process group, which ends when this process does, however that happens.

    It can be started any number of times, once at a time. On the event loop, `receive` is called with its
    output: the descriptor, 1 or 2, and bytes; empty bytes are the last. Then `ended` is called with its exit
    code, which is minus the number of the signal that ended it, if one did, and whether `stop` was called.
    Processes of the group that outlive the command are killed.
    """

    def __init__(
        self,
        receive: Callable[[int, bytes], None],
        ended: Callable[[int, bool], None] = lambda _code, _stopped: None,
    ) -> None:
        self.receive = receive
        self._report_end = ended
        self._is_running = False
        self._transport: asyncio.SubprocessTransport | None = None
        self._events = _Events(self)
        self._ended: asyncio.Task[int] | None = None
        self._stopped = False

    @property
    def is_running(self) -> bool:
        """Whether the process starts or runs."""
        return self._is_running

    @property
    def pid(self) -> int | None:
        """The id of the process; None before it is started."""
        return self._transport.get_pid() if self._transport else None

    async def start(
        self,
        command: Sequence[str],
        environment: Mapping[str, str],
        *,
        foreground: bool = False,
        merged: bool = False,
        at_once: bool = False,
        waits: bool = False,
    ) -> None:
        """Start a command. Raises OSError when no process can be started, as while the former one runs.

        A foreground command uses our terminal, and `receive` gets nothing. `merged` sends stderr to stdout.
        One of ours that calls `begin_loading` can start `at_once`: it ties itself to this process, which
        saves the start of an interpreter. One that `waits` at its stdin gets that from `give`.
        """
        if self._is_running:
            raise OSError(errno.EBUSY, "the former process still runs")
        options: dict[str, Any] = {"stdin": subprocess.DEVNULL, "start_new_session": True}
        if foreground:
            # It must stay in the terminal's session to read its keys.
            options = {"stdin": None, "stdout": None, "stderr": None, "process_group": 0}
        elif merged:
            options["stderr"] = subprocess.STDOUT
        elif waits:
            options["stdin"] = subprocess.PIPE
        self._is_running = True  # nobody else starts one while this waits
        tether = [] if at_once else tether_command("foreground" if foreground else "background")
        variables = {LAUNCHER: str(os.getpid())} if at_once else {}
        variables["PYTHONUNBUFFERED"] = environment.get("PYTHONUNBUFFERED") or "1"
        # Blocked in the child too: the tether unblocks it once it would no longer end in a traceback.
        blocked = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            transport, events = await asyncio.get_running_loop().subprocess_exec(
                partial(_Events, self),
                *tether,
                *command,
                env={**environment, **variables},
                **options,
            )
        except BaseException:
            self._is_running = False
            raise
        finally:
            if signal.SIGINT not in blocked:
                signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
        self._stopped = False
        self._ended = asyncio.create_task(self._end(transport, events))

    def give(self, text: bytes, in_place_of: ChildProcess) -> bool:
        """Give a process that waits its whole stdin; from now on it reports as another one would.

        Return False if it has ended instead.
        """
        pipe = self._transport.get_pipe_transport(0) if self._transport else None
        if not isinstance(pipe, asyncio.WriteTransport) or pipe.is_closing():
            return False
        pipe.write(text)
        if pipe.is_closing():  # nobody reads any more
            return False
        self.receive, self._report_end = in_place_of.receive, in_place_of._report_end
        pipe.close()  # what was written arrives before
        return True

    async def wait(self) -> int:
        """Wait for the end of the process and its output, and return its exit code, as `ended` gets it."""
        assert self._ended is not None
        return await asyncio.shield(self._ended)

    async def stop(
        self, patience: Sequence[float], force: asyncio.Event | None = None, *, group: bool = False
    ) -> None:
        """End the process, if one runs, and wait until `ended` has been called.

        It gets SIGINT, then SIGTERM, then SIGKILL; `patience` has the seconds between them. Setting `force`
        skips every wait. The first signals go to the process alone, so that it can end its child processes,
        or to the whole `group`.
        """
        if self._transport is None or self._ended is None or self._ended.done():
            return
        self._stopped = True
        forced = asyncio.create_task((force or asyncio.Event()).wait())
        try:
            for number, seconds in zip((signal.SIGINT, signal.SIGTERM), patience, strict=True):
                if self._events.exited.is_set():
                    break
                if group:
                    self._signal_group(number)
                else:
                    with contextlib.suppress(ProcessLookupError):
                        self._transport.send_signal(number)
                either = {self._ended, forced}
                await asyncio.wait(either, timeout=seconds, return_when=asyncio.FIRST_COMPLETED)
        finally:
            forced.cancel()
        self.kill()
        await asyncio.wait({self._ended}, timeout=_KILL_LIMIT)

    def begin(self, transport: asyncio.SubprocessTransport, events: _Events) -> None:
        """Take over a process that has just begun: its output, for which it may be killed, comes later."""
        self._transport, self._events = transport, events

    def kill(self) -> None:
        """Kill the process with its whole group, unless it has ended, and do not wait."""
        if not self._events.exited.is_set():
            self._signal_group(signal.SIGKILL)

    def _signal_group(self, number: signal.Signals) -> None:
        if self.pid is not None:
            with contextlib.suppress(ProcessLookupError, PermissionError):
                os.killpg(self.pid, number)

    async def _end(self, transport: asyncio.SubprocessTransport, events: _Events) -> int:
        await events.exited.wait()
        self._signal_group(signal.SIGKILL)  # the processes that it left behind
        with contextlib.suppress(TimeoutError):
            await asyncio.wait_for(events.closed.wait(), _DRAIN)
        transport.close()
        code = transport.get_returncode()
        assert code is not None
        try:
            for descriptor in (1, 2):
                self.receive(descriptor, b"")
        finally:
            self._is_running = False
        self._report_end(code, self._stopped)
        return code


class _Events(asyncio.SubprocessProtocol):
    """What the event loop says of one process."""

    def __init__(self, process: ChildProcess) -> None:
        self._process = process
        self.exited = asyncio.Event()
        """Set once the process has ended; more of its output may follow."""
        self.closed = asyncio.Event()
        """Set once all of its output has arrived."""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Note that the process has begun."""
        self._process.begin(cast("asyncio.SubprocessTransport", transport), self)

    def pipe_data_received(self, fd: int, data: bytes) -> None:
        """Pass on the output."""
        self._process.receive(fd, data)

    def process_exited(self) -> None:
        """Note the end of the process."""
        self.exited.set()

    def connection_lost(self, error: Exception | None) -> None:  # noqa: ARG002
        """Note the end of the output."""
        self.closed.set()
