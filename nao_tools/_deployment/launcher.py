"""Start the processes of a stack, watch over them, and end all of them when the first one ends."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import os
import re
import signal
import socket
import sys
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from datetime import datetime
from pathlib import Path
from typing import NamedTuple

import typer

from nao_tools._deployment.stack import ON_PURPOSE, ProcessSpec, Restarts, Stack, StackError, program_path
from zenoh_ice.application.child import ChildProcess
from zenoh_ice.application.logs import rotating
from zenoh_ice.data.text import signal_name

_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
_STDIN = 0
_ENDPOINT = re.compile(r"tcp/(?P<host>[\w.-]+):(?P<port>\d+)")
_DATED = re.compile(r"\d{4}-\d\d-\d\d |\{")  # how log lines begin, as text and as JSON
_TAIL_LINES = 15
_LONGEST_LINE = 8192


class _End(NamedTuple):
    """Why a stack ends: the launcher's exit code and what to report about it."""

    code: int
    message: str = ""


def start(stack: Stack, changes: dict[str, str], seconds: float | None) -> int:
    """Start the processes of a stack, stop all of them together, and return the exit code.

    `seconds` limits how long they run. Raises StackError for a variable that the stack does not have, and
    when its endpoint or the place of its logs cannot be used.
    """
    # With this variable, a stack declares that its foreground process counts the seconds itself.
    counts_itself = "seconds" in stack.variables
    if seconds is not None and counts_itself:
        changes["seconds"] = f"{seconds:g}"
    if stack.endpoint and "endpoint" not in changes:
        changes["endpoint"] = free_endpoint(stack.endpoint)
        if changes["endpoint"] != stack.endpoint:
            typer.echo(f"{stack.endpoint} is in use, perhaps by another robot server; using another endpoint")
    processes = stack.with_variables(changes)
    logs = Path(stack.log_dir)
    typer.echo(f"Starting {stack.name}: {', '.join(process.name for process in processes)}")
    typer.echo(f"  logs in {logs}{', endpoint ' + changes['endpoint'] if stack.endpoint else ''}")
    limit = None if counts_itself or not seconds else seconds
    return asyncio.run(Launcher(processes, logs, typer.echo, limit).run())


class Launcher:
    """Run a stack once.

    Processes start in parallel, but one with `after` waits until the processes listed there are ready. One
    that is restarted on failure may end without the others, unless it never was ready. The stack ends when
    another process ends or is not ready in time, when none is left, after `seconds`, or at SIGINT, SIGTERM or
    SIGHUP; its processes are then ended in reverse order. A second signal ends them at once.
    """

    def __init__(
        self,
        processes: Sequence[ProcessSpec],
        log_dir: Path,
        report: Callable[[str], None],
        seconds: float | None = None,
    ) -> None:
        self._log_dir = log_dir
        self._write = report
        self._seconds = seconds
        self._launched_at = time.monotonic()
        self._processes = {spec.name: _StackProcess(spec, log_dir / f"{spec.name}.log") for spec in processes}
        self._left = set(self._processes)  # those that may still run
        self._failed = False
        # While the foreground process runs, it alone has the terminal.
        self._has_foreground = any(spec.foreground for spec in processes)

    async def run(self) -> int:
        """Run the stack to its end.

        Returns the exit code of the foreground process, 0 when `seconds` have passed, 128 and the number of
        the signal that ended the stack, or 1 when a process failed. Raises StackError when there is no place
        for the logs.
        """
        try:
            # Readable by our user alone: the editor prints the secret of its page.
            self._log_dir.mkdir(mode=0o700, parents=True, exist_ok=True)
        except OSError as error:
            raise StackError(f"{self._log_dir}: cannot write logs there: {error.strerror}") from error
        loop = asyncio.get_running_loop()
        interrupted: asyncio.Future[_End] = loop.create_future()
        force = asyncio.Event()

        def interrupt(number: signal.Signals) -> None:
            if interrupted.done():
                force.set()
            else:
                interrupted.set_result(_End(128 + number))

        for number in _SIGNALS:
            if signal.getsignal(number) is not signal.SIG_IGN:  # as the end of the terminal under nohup
                loop.add_signal_handler(number, interrupt, number)
        with _terminal_kept():
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

    async def _supervise(self, process: _StackProcess) -> _End:
        """Start a process in its turn, and again by its restart policy; return why the stack ends then."""
        spec = process.spec
        restarts = Restarts(spec)
        was_ready = False
        for name in spec.after:
            await self._processes[name].ready.wait()
        while True:
            started_at = time.monotonic()
            try:
                code, what = await self._run_once(process)
            except OSError as error:
                return _End(1, f"{spec.name} cannot be started: {error}")
            was_ready = was_ready or process.ready.is_set()
            ran = time.monotonic() - started_at if process.ready.is_set() else 0.0
            pause = restarts.pause_after(code, ran)
            if pause is None:
                break
            self._report(f"{spec.name} {what} ({process.log}); starting it again in {pause:g} s")
            await process.stop()  # one that was not ready in time still runs
            await asyncio.sleep(pause)
        if spec.restart == "never" or not was_ready:
            return self._end_of(process, code, what)
        if code in ON_PURPOSE:
            self._report(f"{spec.name} {what}")
        else:
            self._report(f"{self._failure(process, what)}\n  not starting {spec.name} again")
            self._failed = True
        self._left.remove(spec.name)
        if self._left:
            await asyncio.Event().wait()  # the others run on
        return _End(1 if self._failed else 0)

    async def _run_once(self, process: _StackProcess) -> tuple[int, str]:
        """Run a process to its end; return its exit code, and a description of how it ended.

        One that is not ready in time has exit code 1, and may still run. Raises OSError when it cannot start.
        """
        spec = process.spec
        child = await process.start()
        watch = asyncio.create_task(child.wait())
        ready = asyncio.create_task(process.ready.wait())
        try:
            done, _ = await asyncio.wait(
                {watch, ready}, timeout=spec.ready_timeout, return_when=asyncio.FIRST_COMPLETED
            )
            if not done:
                return 1, f"was not ready within {spec.ready_timeout:g} s"
            if not watch.done() and spec.ready and not self._has_foreground:
                self._report(f"  {spec.name} is ready after {self._elapsed():.1f} s")
            code = await watch
        finally:
            ready.cancel()
            watch.cancel()
        return code, f"{_describe_exit(code)} after {self._elapsed():.1f} s"

    def _end_of(self, process: _StackProcess, code: int, what: str) -> _End:
        if process.spec.foreground and code < 0:
            if sys.stdout.isatty():
                # Restore the ordinary screen and the cursor, which a killed process may have hidden.
                sys.stdout.write("\x1b[?1049l\x1b[?25h")
                sys.stdout.flush()
            return _End(128 - code, f"{process.spec.name} {_describe_exit(code)}")
        if process.spec.foreground:
            return _End(code)
        return _End(1, self._failure(process, what))

    def _failure(self, process: _StackProcess, what: str) -> str:
        if not process.tail:
            return f"{process.spec.name} {what} and wrote nothing to {process.log}"
        lines = "".join(f"\n    {line}" for line in process.tail)
        return f"{process.spec.name} {what}. The last lines of {process.log}:{lines}"

    def _elapsed(self) -> float:
        return time.monotonic() - self._launched_at

    def _report(self, message: str) -> None:
        # The terminal may be gone: that is one reason for a stack to end.
        with contextlib.suppress(OSError):
            self._write(message)


@contextlib.contextmanager
def _terminal_kept() -> Iterator[None]:
    """Take the terminal back from the foreground process at the end."""
    owned = os.isatty(_STDIN) and os.tcgetpgrp(_STDIN) == os.getpgrp()
    try:
        yield
    finally:
        if owned:
            # A background group that asks for the terminal is stopped unless it ignores the signal.
            before = signal.signal(signal.SIGTTOU, signal.SIG_IGN)
            with contextlib.suppress(OSError):
                os.tcsetpgrp(_STDIN, os.getpgrp())
            signal.signal(signal.SIGTTOU, before)


class _StackProcess:
    """A started process.

    Its output goes line by line into `log`, which rotates; lines without date and time get them. A foreground
    process has the terminal instead. Its child processes stay in its process group and end with it.
    """

    def __init__(self, spec: ProcessSpec, log: Path) -> None:
        self.spec = spec
        self.log = log
        self.ready = asyncio.Event()
        self.tail: deque[str] = deque(maxlen=_TAIL_LINES)
        self._logging = True
        self._handler: logging.Handler | None = None
        self._rest = b""
        self._child = ChildProcess(self._receive)

    async def start(self) -> ChildProcess:
        """Start the process; it is ready at once when the stack file gives no pattern to wait for."""
        self.ready.clear()
        self.tail.clear()
        program, *arguments = self.spec.command
        if not self.spec.foreground:
            self._handler = rotating(self.log)
            self._handler.handleError = lambda record: self._cannot_log()  # type: ignore[method-assign]  # noqa: ARG005
        try:
            await self._child.start(
                [program_path(program), *arguments],
                {**os.environ, **self.spec.environment},
                foreground=self.spec.foreground,
                merged=True,
            )
        except BaseException:
            self._close_log()
            raise
        if not self.spec.ready:
            self.ready.set()
        return self._child

    async def stop(self, force: asyncio.Event | None = None) -> None:
        """End the process and its whole group: SIGINT, SIGTERM after `stop_timeout`, then SIGKILL.

        Setting `force` shortens every wait to nothing.
        """
        await self._child.stop([self.spec.stop_timeout] * 2, force, group=True)

    def _receive(self, _descriptor: int, data: bytes) -> None:
        """Copy output line by line into the log; empty data end it."""
        *lines, self._rest = (self._rest + data).split(b"\n")
        if len(self._rest) > _LONGEST_LINE or (not data and self._rest):
            lines, self._rest = [*lines, self._rest], b""
        for line in lines:
            self._note(line)
        if not data:
            self._close_log()

    def _close_log(self) -> None:
        if self._handler is not None:
            with contextlib.suppress(OSError):  # reported by `_cannot_log`
                self._handler.close()
            self._handler = None

    def _cannot_log(self) -> None:
        """Stop logging, but continue to read: otherwise the process would block once the pipe is full."""
        self._logging = False
        self.tail.append(f"(cannot write more of its log: {sys.exception()})")

    def _note(self, raw: bytes) -> None:
        line = raw.decode(errors="replace").rstrip("\r")
        if self._logging and self._handler is not None:
            now = datetime.now().astimezone().replace(tzinfo=None)
            stamp = "" if _DATED.match(line) else now.isoformat(" ", "milliseconds") + " "
            self._handler.emit(logging.makeLogRecord({"msg": stamp + line}))
        self.tail.append(line)
        if self.spec.ready and re.search(self.spec.ready, line):
            self.ready.set()


def _describe_exit(code: int) -> str:
    """Describe how a process ended, for example `was terminated by SIGKILL`."""
    if code >= 0:
        return f"ended with exit code {code}"
    return f"was terminated by {signal_name(-code)}"


def free_endpoint(endpoint: str) -> str:
    """Return the endpoint, or one with a port picked by the system if its port is in use.

    Raises StackError for an endpoint that is not `tcp/HOST:PORT` or a host that is not this machine.
    """
    match = _ENDPOINT.fullmatch(endpoint)
    if match is None:
        raise StackError(f"endpoint {endpoint!r} is not of the form tcp/HOST:PORT")
    with contextlib.suppress(OSError, OverflowError):
        return _listen(match["host"], int(match["port"]))
    try:
        return _listen(match["host"], 0)
    except OSError as error:
        raise StackError(f"endpoint {endpoint}: cannot listen there: {error.strerror}") from error


def _listen(host: str, port: int) -> str:
    # As servers do: connections left by a stack that has just ended must not block the port.
    with socket.create_server((host, port), backlog=1) as probe:
        return f"tcp/{host}:{probe.getsockname()[1]}"
