"""Check documents in a process beside, so that the editor never waits for a check.

The process gets one document at a time as a line of JSON, and answers with a line. It ends when its input
ends. No code of a document is run in it.
"""

from __future__ import annotations

import contextlib
import os
import resource
import select
import subprocess
import sys
import threading
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import msgspec

from codegen.hfsm.document import Document
from codegen.hfsm.model_checker import DEFAULT_LIMIT
from visualhfsm.child import child_environment

from .errors import EditError
from .fragments import written
from .problems import Problem, find_problems_in_text

__all__ = ["CheckProcess"]

_PATIENCE: Final = 20.0
"""Seconds that a check may take, and another time without the model checker."""
_MEMORY: Final = 4 << 30
_END: Final = 2.0


class _Question(msgspec.Struct, frozen=True):
    text: str
    path: str | None
    include: list[str]
    limit: int


class _TooSlowError(Exception):
    pass


class CheckProcess:
    """A process that checks documents, one after the other; it is started when it is first needed.

    Safe to be used from several threads: each waits for its turn.
    """

    def __init__(self, *, patience: float = _PATIENCE) -> None:
        self._patience = patience
        self._lock = threading.Lock()
        self._process: subprocess.Popen[bytes] | None = None
        self._closed = False

    def find_problems(
        self, document: Document, path: Path | None, include: Sequence[Path] = ()
    ) -> list[Problem]:
        """Return what is wrong in a document. Raises EditError when it cannot be written, or checked."""
        text = written(document)
        with self._lock:
            for limit in (DEFAULT_LIMIT, 0):
                try:
                    return self._ask(
                        _Question(text, None if path is None else str(path), [*map(str, include)], limit)
                    )
                except (_TooSlowError, OSError, msgspec.MsgspecError):
                    self._stop()
                    if self._closed:
                        break
        what = "the checks took too long, or ended by themselves"
        return [Problem(code="", severity="warning", message=f"{what}: this revision is not checked")]

    def close(self) -> None:
        """End the process; a check that is running ends without a result."""
        self._closed = True
        process = self._process
        if process is not None:
            process.kill()
        with self._lock:
            self._stop()

    def _ask(self, question: _Question) -> list[Problem]:
        if self._closed:
            raise EditError("Cannot check the document", "the checks have been ended")
        process = self._process or self._start()
        assert process.stdin is not None
        assert process.stdout is not None
        process.stdin.write(msgspec.json.encode(question) + b"\n")
        process.stdin.flush()
        line = _read_line(process.stdout.fileno(), time.monotonic() + self._patience)
        return msgspec.json.decode(line, type=list[Problem])

    def _start(self) -> subprocess.Popen[bytes]:
        # Not the directory of the documents, but only ours is searched for modules: -P.
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-m", __name__],
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
                with contextlib.suppress(OSError):  # what was not sent yet has no reader any more
                    stream.close()
        process.wait(_END)


def _read_line(descriptor: int, until: float) -> bytes:
    found = bytearray()
    while not found.endswith(b"\n"):
        left = until - time.monotonic()
        if left <= 0 or not select.select([descriptor], [], [], left)[0]:
            raise _TooSlowError
        part = os.read(descriptor, 1 << 16)
        if not part:
            raise _TooSlowError
        found += part
    return bytes(found)


def main() -> None:
    """Answer questions from stdin until it ends."""
    resource.setrlimit(resource.RLIMIT_AS, (_MEMORY, _MEMORY))
    output = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    os.nice(5)
    for line in sys.stdin.buffer:
        question = msgspec.json.decode(line, type=_Question)
        problems = find_problems_in_text(
            question.text,
            None if question.path is None else Path(question.path),
            [Path(directory) for directory in question.include],
            limit=question.limit,
        )
        output.write(msgspec.json.encode(problems) + b"\n")
        output.flush()


if __name__ == "__main__":
    main()
