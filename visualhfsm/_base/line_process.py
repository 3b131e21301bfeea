"""Child processes that answer questions, and end with this process.

Such a process isolates work that may take long or fail. Questions are one line each, and so are answers or
their parts, after an empty line when it is ready. The process ends when its input ends; its time and memory
are limited. At the end it is killed with all processes that it has started, unless they have left its group.
"""

from __future__ import annotations

import contextlib
import gc
import os
import resource
import select
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Final

from visualhfsm._base.environment import child_environment
from zenoh_ice.data.text import signal_name

_MEMORY: Final = 4 << 30
"""Limit of the memory of a process that answers questions, in bytes."""
_LONGEST_ANSWER: Final = 64 << 20  # bytes
_NEW_OBJECTS: Final = 100_000
"""New objects between two garbage collections: Python's default of 700 cost a quarter of the time."""
_KILL_LIMIT: Final = 2.0
"""Limit in seconds for the process to end after SIGKILL."""


class NoAnswerError(Exception):
    """The process took too long, or ended; it is restarted for the next question."""


class TooSlowError(NoAnswerError):
    """The process took too long."""


class KilledError(NoAnswerError):
    """The process was killed by someone else, or by the system for want of memory, or could not start."""


class NotReadyError(KilledError):
    """The process ended, or took too long, before it was ready: no question is to blame."""


class LineProcess:
    """A module that runs in a process and answers one question at a time; started on first use.

    `environment` is added to that of this process, which must be ready within `start_limit` s and answer
    with `longest_answer` bytes at most. Thread-safe: callers wait for their turn.
    """

    def __init__(
        self,
        module: str,
        environment: Mapping[str, str] | None = None,
        *,
        start_limit: float = 60.0,
        longest_answer: int = _LONGEST_ANSWER,
    ) -> None:
        self._module = module
        self._environment = environment or {}
        self._start_limit = start_limit
        self._longest_answer = longest_answer
        self._lock = threading.Lock()
        self._process: subprocess.Popen[bytes] | None = None
        self._ready: subprocess.Popen[bytes] | None = None
        self._unread = b""
        self._closed = False

    def ask(self, question: bytes, patience: float) -> bytes:
        """Return the answer to a question, a line without its newline, within `patience` s of being ready.

        Raises NoAnswerError.
        """
        with self._guarded():
            if self._process is not None and self._process.poll() is not None:
                self._stop()
            process = self._process or self._start()
            assert process.stdin is not None
            assert process.stdout is not None
            until = time.monotonic() + patience
            _write(process.stdin.fileno(), question + b"\n", until)
            return self._read_line(process.stdout.fileno(), until)

    def more(self, patience: float, soon: float = 0.0, late: Callable[[], None] = lambda: None) -> bytes:
        """Return the next part of an answer that has several, within `patience` s. Raises NoAnswerError.

        `late` is called if it does not come `soon`, in s; what that raises ends the process.
        """
        with self._guarded():
            if self._process is None or self._process.stdout is None:
                raise EOFError
            output, now = self._process.stdout.fileno(), time.monotonic()
            if b"\n" not in self._unread:
                try:
                    _wait(output, select.POLLIN, now + soon)
                except TooSlowError:
                    late()
            return self._read_line(output, now + patience)

    def signal(self, number: signal.Signals) -> None:
        """Send a signal to the process, if it runs and is ready; it must handle that."""
        process = self._ready
        if process is not None and process.returncode is None:
            with contextlib.suppress(ProcessLookupError):
                os.kill(process.pid, number)

    @contextlib.contextmanager
    def _guarded(self) -> Iterator[None]:
        """Use the process in a `with` block; it is ended if that fails."""
        with self._lock:
            if self._closed:
                raise NoAnswerError("it has been ended")
            try:
                yield
            except (OSError, EOFError) as error:
                code = self._stop(_KILL_LIMIT)
                raise (KilledError if code == -signal.SIGKILL else NoAnswerError)(_ended(code)) from error
            except BaseException:
                self._stop()
                raise

    def close(self) -> None:
        """End the process; waiting questions are not answered."""
        self._closed = True
        process = self._process
        if process is not None and process.returncode is None:
            kill_group(process)
        with self._lock:
            self._stop()

    def _start(self) -> subprocess.Popen[bytes]:
        """Start the process, and wait until it is ready."""
        # With -P, modules are not imported from the working directory, which may contain documents.
        try:
            self._process = subprocess.Popen(
                [sys.executable, "-P", "-m", self._module],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                bufsize=0,
                env={**child_environment(), **self._environment},
                start_new_session=True,
            )
        except OSError as error:
            raise NotReadyError(f"it cannot be started: {error.strerror}") from error
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        os.set_blocking(self._process.stdin.fileno(), False)  # a pipe that is full is waited for with a limit
        until = time.monotonic() + self._start_limit
        try:
            while self._read_line(self._process.stdout.fileno(), until):
                pass  # what is printed before
        except TooSlowError as error:
            raise NotReadyError(f"it was not ready within {self._start_limit:g} s") from error
        except EOFError as error:
            raise NotReadyError(f"{_ended(self._stop(_KILL_LIMIT))} before it was ready") from error
        self._ready = self._process
        return self._process

    def _read_line(self, descriptor: int, until: float) -> bytes:
        part = self._unread
        found = bytearray(part)
        while b"\n" not in part:
            _wait(descriptor, select.POLLIN, until)
            part = os.read(descriptor, 1 << 16)
            if not part:
                raise EOFError
            found += part
            if len(found) > self._longest_answer:
                raise NoAnswerError(f"its answer is longer than {self._longest_answer >> 20} MB")
        line, _, self._unread = bytes(found).partition(b"\n")
        return line

    def _stop(self, patience: float = 0.0) -> int:
        """End the process with its group; return its exit code, 0 if it lives on for `patience` s."""
        process, self._process, self._ready = self._process, None, None
        self._unread = b""
        if process is None:
            return 0
        try:
            code = process.wait(patience)
        except subprocess.TimeoutExpired:
            code = 0
        kill_group(process)
        for stream in (process.stdin, process.stdout):
            if stream is not None:
                stream.close()
        process.wait(_KILL_LIMIT)
        return code


def answer_lines(answer: Callable[[bytes], bytes | Iterable[bytes]], memory: int = _MEMORY) -> None:
    """Say that the process is ready, and answer questions from stdin until it ends.

    An answer is a line, or several, which are its parts. Other output goes to stderr. `memory` is the limit
    of the address space in bytes.
    """
    resource.setrlimit(resource.RLIMIT_AS, (memory, memory))
    output = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    os.nice(5)
    gc.freeze()  # imported modules are never garbage
    gc.set_threshold(_NEW_OBJECTS)

    def is_read(line: bytes) -> bool:
        try:
            output.write(line + b"\n")
            output.flush()
        except BrokenPipeError:  # the process that asked has ended
            return False
        return True

    goes_on = is_read(b"")
    while goes_on and (question := sys.stdin.buffer.readline()):
        answered = answer(question)
        goes_on = all(map(is_read, (answered,) if isinstance(answered, bytes) else answered))


def _ended(code: int) -> str:
    return f"it was ended by {explain_signal(-code)}" if code < 0 else "it has ended"


def explain_signal(number: int) -> str:
    """Return the name of a signal, for SIGILL with what it means."""
    name = signal_name(number)
    lacks = "the processor of this computer lacks an instruction that a package needs, such as those of AVX"
    return f"{name} ({lacks})" if number == signal.SIGILL else name


def kill_group(process: subprocess.Popen[bytes]) -> None:
    """Kill what is left of the group of a process, whose id stays taken while one of the group lives."""
    with contextlib.suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)


def _write(descriptor: int, text: bytes, until: float) -> None:
    """Write a text to a pipe that does not block: its reader may hang, and a pipe holds 64 kB."""
    left = memoryview(text)
    while left:
        _wait(descriptor, select.POLLOUT, until)
        left = left[os.write(descriptor, left) :]


def _wait(descriptor: int, event: int, until: float) -> None:
    """Wait until a pipe can be read or written, or has lost its other end."""
    waiting = select.poll()  # `select` takes no descriptor above 1023
    waiting.register(descriptor, event)
    left = until - time.monotonic()
    if left <= 0 or not waiting.poll(left * 1000):
        raise TooSlowError("it takes too long")
