"""Start the processes of a stack, watch over them, and end all of them when the first one ends."""

from __future__ import annotations

import asyncio
import contextlib
import os
import re
import signal
import socket
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from deploy.process import StackProcess, describe_exit
from deploy.stack import ProcessSpec, StackError

__all__ = ["Launcher", "free_endpoint"]

_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
_STDIN = 0
_ENDPOINT = re.compile(r"tcp/(?P<host>[\w.-]+):(?P<port>\d+)")


@dataclass(frozen=True, slots=True)
class _End:
    """Why a stack ends: the launcher's exit code and what to report about it."""

    code: int
    message: str = ""


class Launcher:
    """Run a stack once.

    Processes start in parallel, except that one with `after` waits until those are ready. The stack ends when
    any process ends, when one is not ready in time, after `seconds`, or at SIGINT, SIGTERM or SIGHUP; its
    processes are then ended in reverse order. A second signal ends them at once.
    """

    def __init__(
        self,
        processes: Sequence[ProcessSpec],
        log_dir: Path,
        report: Callable[[str], None],
        seconds: float | None = None,
    ) -> None:
        self._specs = tuple(processes)
        self._log_dir = log_dir
        self._write = report
        self._seconds = seconds
        self._launched_at = 0.0
        self._processes: dict[str, StackProcess] = {}
        # The terminal is the foreground process's alone while that runs.
        self._has_foreground = any(spec.foreground for spec in processes)

    async def run(self) -> int:
        """Run the stack to its end.

        Returns the exit code of the foreground process, 0 when `seconds` have passed, 128 and the number of
        the signal that ended the stack, or 1 when a process failed. Raises StackError when there is no place
        for the logs.
        """
        self._launched_at = time.monotonic()
        try:
            self._log_dir.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise StackError(f"{self._log_dir}: logs cannot be written there: {error.strerror}") from error
        self._processes = {
            spec.name: StackProcess(spec, self._log_dir / f"{spec.name}.log", self._launched_at)
            for spec in self._specs
        }
        force = asyncio.Event()
        interrupted: asyncio.Future[_End] = asyncio.get_running_loop().create_future()
        with _signals(interrupted, force), _terminal_kept():
            tasks = [asyncio.create_task(self._supervise(process)) for process in self._processes.values()]
            try:
                ends, _ = await asyncio.wait(
                    {*tasks, interrupted}, timeout=self._seconds, return_when=asyncio.FIRST_COMPLETED
                )
            finally:
                for task in tasks:
                    task.cancel()
                await asyncio.gather(*tasks, return_exceptions=True)
                for process in reversed(self._processes.values()):
                    await process.stop(force)
        end = ends.pop().result() if ends else _End(0)
        if end.message:
            self._report(end.message)
        return end.code

    async def _supervise(self, process: StackProcess) -> _End:
        """Start a process in its turn, wait until it is ready, then until it ends."""
        spec = process.spec
        try:
            for name in spec.after:
                await self._processes[name].ready.wait()
            await process.start()
            watch = asyncio.create_task(process.wait())
            ready = asyncio.create_task(process.ready.wait())
            done, _ = await asyncio.wait(
                {watch, ready}, timeout=spec.ready_timeout, return_when=asyncio.FIRST_COMPLETED
            )
            ready.cancel()
            if not done:
                watch.cancel()
                return _End(1, self._failure(process, f"was not ready within {spec.ready_timeout:g} s"))
            if not watch.done() and spec.ready and not self._has_foreground:
                self._report(f"  {spec.name} is ready after {self._elapsed():.1f} s")
            return self._end_of(process, await watch)
        except OSError as error:
            return _End(1, f"{spec.name} cannot be started: {error}")

    def _end_of(self, process: StackProcess, code: int) -> _End:
        if process.spec.foreground and code < 0:
            _leave_full_screen()
            return _End(128 - code, f"{process.spec.name} {describe_exit(code)}")
        if process.spec.foreground:
            return _End(code)
        return _End(1, self._failure(process, f"{describe_exit(code)} after {self._elapsed():.1f} s"))

    def _failure(self, process: StackProcess, what: str) -> str:
        if not process.tail:
            return f"{process.spec.name} {what}, without a word in {process.log}"
        lines = "".join(f"\n    {line}" for line in process.tail)
        return f"{process.spec.name} {what}. The last lines of {process.log}:{lines}"

    def _elapsed(self) -> float:
        return time.monotonic() - self._launched_at

    def _report(self, message: str) -> None:
        # The terminal may be gone, which is one of the reasons for which a stack ends.
        with contextlib.suppress(OSError):
            self._write(message)


@contextlib.contextmanager
def _signals(interrupted: asyncio.Future[_End], force: asyncio.Event) -> Iterator[None]:
    """Let the first signal end the stack and every further one set `force`."""
    loop = asyncio.get_running_loop()

    def end(number: signal.Signals) -> None:
        if interrupted.done():
            force.set()
        else:
            interrupted.set_result(_End(128 + number))

    # Under nohup the end of the terminal is no reason.
    signals = [number for number in _SIGNALS if signal.getsignal(number) is not signal.SIG_IGN]
    for number in signals:
        loop.add_signal_handler(number, end, number)
    try:
        yield
    finally:
        for number in signals:
            loop.remove_signal_handler(number)


@contextlib.contextmanager
def _terminal_kept() -> Iterator[None]:
    """Take the terminal back from the foreground process at the end."""
    if not os.isatty(_STDIN) or os.tcgetpgrp(_STDIN) != os.getpgrp():
        yield
        return
    try:
        yield
    finally:
        # A background group that asks for the terminal is stopped unless it ignores the signal.
        before = signal.signal(signal.SIGTTOU, signal.SIG_IGN)
        with contextlib.suppress(OSError):
            os.tcsetpgrp(_STDIN, os.getpgrp())
        signal.signal(signal.SIGTTOU, before)


def _leave_full_screen() -> None:
    """Show the terminal's ordinary screen and its cursor, which a killed process may have hidden."""
    if sys.stdout.isatty():
        sys.stdout.write("\x1b[?1049l\x1b[?25h")
        sys.stdout.flush()


def free_endpoint(endpoint: str) -> str:
    """Return the endpoint, or one with a port picked by the system when somebody listens there already.

    Raises StackError for an endpoint that is not `tcp/HOST:PORT` or a host that is not this machine.
    """
    match = _ENDPOINT.fullmatch(endpoint)
    if match is None:
        raise StackError(f"endpoint {endpoint!r} is not of the form tcp/HOST:PORT")
    host = match["host"]
    try:
        return f"tcp/{host}:{_bind(host, int(match['port']))}"
    except (OSError, OverflowError):
        pass
    try:
        return f"tcp/{host}:{_bind(host, 0)}"
    except OSError as error:
        raise StackError(f"endpoint {endpoint}: cannot listen on {host}: {error.strerror}") from error


def _bind(host: str, port: int) -> int:
    with socket.socket() as probe:
        # As servers do, so that connections of a stack that has just ended do not count.
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        probe.bind((host, port))
        # With this option another listener shows only here.
        probe.listen(1)
        return int(probe.getsockname()[1])
