"""Run a replay in a process of its own, which is ended on every way out."""

from __future__ import annotations

import os
import queue
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import IO, Final

import msgspec

from hfsm_recording.outcome import Line, Outcome
from visualhfsm.child import child_environment
from visualhfsm.errors import VisualHfsmError

__all__ = ["replay_in_process"]

_SILENCE: Final = 90.0
"""Seconds without a word after which the process is given up: it reports each second how far it is."""
_LOOK: Final = 0.2  # s after which it is looked whether a signal came
_LONGEST_LINE: Final = 64 << 20
_END: Final = 5.0
_TAIL: Final = 2000


def replay_in_process(
    arguments: Sequence[str],
    include: Sequence[Path],
    report: Callable[[Line], None],
    stop: threading.Event,
    *,
    shows_output: bool,
) -> Outcome | None:
    """Run `hfsm_runtime.replay` with these arguments; return how it ended, or None when `stop` was set.

    `report` gets each line. `include` are directories in which the component finds packages. Raises
    VisualHfsmError.
    """
    command = [sys.executable, "-m", "hfsm_runtime.replay", *arguments]
    with tempfile.TemporaryFile() as errors:
        child = subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=None if shows_output else errors,
            env=child_environment(include),
            start_new_session=True,  # Ctrl-C is ours; the child is ended below
        )
        try:
            outcome = _listen(child, report, stop)
            if outcome is None and not stop.is_set():
                raise VisualHfsmError(_failure(child, errors))
            return outcome
        finally:
            _end(child)


def _listen(
    child: subprocess.Popen[bytes], report: Callable[[Line], None], stop: threading.Event
) -> Outcome | None:
    assert child.stdout is not None
    lines: queue.SimpleQueue[bytes] = queue.SimpleQueue()
    reader = threading.Thread(target=_read, args=(child.stdout, lines), name="replay", daemon=True)
    reader.start()
    decoder = msgspec.json.Decoder(Line)
    heard = time.monotonic()
    while not stop.is_set():
        try:
            text = lines.get(timeout=_LOOK)
        except queue.Empty:
            if time.monotonic() - heard < _SILENCE:
                continue
            raise VisualHfsmError(f"the replay has said nothing for {_SILENCE:g} s and was ended") from None
        heard = time.monotonic()
        if not text:
            return None
        try:
            line = decoder.decode(text)
        except msgspec.MsgspecError as error:
            raise VisualHfsmError(f"the replay said what cannot be understood: {error}") from error
        report(line)
        if isinstance(line, Outcome):
            return line
    return None


def _read(stream: IO[bytes], lines: queue.SimpleQueue[bytes]) -> None:
    try:
        while line := stream.readline(_LONGEST_LINE):
            lines.put(line)
    except (OSError, ValueError):  # closed meanwhile
        pass
    lines.put(b"")


def _failure(child: subprocess.Popen[bytes], errors: IO[bytes]) -> str:
    try:
        code = child.wait(_END)
    except subprocess.TimeoutExpired:
        return "the replay closed its output and goes on"
    errors.seek(max(0, errors.seek(0, os.SEEK_END) - _TAIL))
    text = " ".join(errors.read().decode("utf-8", "replace").split())
    reason = text.rpartition("error: ")[2] if "error: " in text else text
    return reason or f"the replay ended with exit code {code}"


def _end(child: subprocess.Popen[bytes]) -> None:
    if child.poll() is None:
        child.terminate()
        try:
            child.wait(_END)
        except subprocess.TimeoutExpired:
            child.kill()
            child.wait(_END)
    if child.stdout is not None:
        child.stdout.close()
