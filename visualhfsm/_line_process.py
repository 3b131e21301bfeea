"""Child processes that answer questions, and end with this process.

Such a process isolates work that may take long or fail. Questions and answers are one line each. The process
ends when its input ends. It must not run code of a document; its time and memory are limited.
"""

from __future__ import annotations

import contextlib
import gc
import os
import resource
import select
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from typing import Final

from visualhfsm._environment import child_environment

_MEMORY: Final = 4 << 30
"""Limit of the memory of a process that answers questions, in bytes."""
_NEW_OBJECTS: Final = 100_000
"""New objects between two garbage collections: Python's default of 700 cost a quarter of the time."""
_KILL_LIMIT: Final = 2.0
"""Limit in seconds for the process to end after SIGKILL."""


class NoAnswerError(Exception):
    """The process took too long, or ended; it is restarted for the next question."""


class LineProcess:
    """A module that runs in a process and answers one question at a time; started on first use.

    Thread-safe: callers wait for their turn.
    """

    def __init__(self, module: str) -> None:
        self._module = module
        self._lock = threading.Lock()
        self._process: subprocess.Popen[bytes] | None = None
        self._closed = False

    def ask(self, question: bytes, patience: float) -> bytes:
        """Return the answer to a question, a line without its newline, within `patience` s.

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
        """End the process; waiting questions are not answered."""
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
        # With -P, modules are not imported from the working directory, which may contain documents.
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
                with contextlib.suppress(OSError):  # unsent data has no reader any more
                    stream.close()
        process.wait(_KILL_LIMIT)


def answer_lines(answer: Callable[[bytes], bytes]) -> None:
    """Answer questions from stdin until it ends; other output goes to stderr."""
    resource.setrlimit(resource.RLIMIT_AS, (_MEMORY, _MEMORY))
    output = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    os.nice(5)
    gc.freeze()  # imported modules are never garbage
    gc.set_threshold(_NEW_OBJECTS)
    for line in sys.stdin.buffer:
        output.write(answer(line) + b"\n")
        output.flush()


def _read_line(descriptor: int, until: float) -> bytes:
    waiting = select.poll()  # `select` takes no descriptor above 1023
    waiting.register(descriptor, select.POLLIN)
    found = bytearray()
    while not found.endswith(b"\n"):
        left = until - time.monotonic()
        if left <= 0 or not waiting.poll(left * 1000):
            raise NoAnswerError("it takes too long")
        part = os.read(descriptor, 1 << 16)
        if not part:
            raise NoAnswerError("it has ended")
        found += part
    return bytes(found[:-1])
