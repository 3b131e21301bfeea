"""Run a component as a separate process, watch its output, and end it."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path
from types import TracebackType
from typing import Self

import psutil

from tests.support.limits import CALL_LIMIT, END_LIMIT, EVENT_LIMIT, RUN_LIMIT, START_LIMIT
from tests.support.ports import free_port

__all__ = ["STEADY", "ComponentProcess", "announced", "assert_gone", "children", "free_endpoint", "module"]

REPOSITORY = Path(__file__).resolve().parents[2]
STEADY = {"VISUALHFSM_LEASE": str(CALL_LIMIT)}
"""The environment of a process whose link a busy machine must not break."""


def module(name: str, *arguments: str) -> list[str]:
    """Return the command that runs a Python module with the interpreter of the tests."""
    return [sys.executable, "-m", name, *arguments]


def announced(entry: str, *arguments: str) -> list[str]:
    """Return the command that runs the `main` of a module, and prints `starting` when it handles Ctrl-C."""
    code = (
        "from zenoh_ice.application import end_at_ctrl_c; end_at_ctrl_c(); print('starting', flush=True)\n"
        f"from {entry} import main; main()"
    )
    return [sys.executable, "-c", code, *arguments]


def free_endpoint() -> str:
    """Return an endpoint on loopback whose port no other test uses."""
    return f"tcp/127.0.0.1:{free_port()}"


def children(module: str, *options: str) -> list[psutil.Process]:
    """Return the processes that were started here, directly or not, of a Python module with some options."""

    def is_one(process: psutil.Process) -> bool:
        deadline = time.monotonic() + EVENT_LIMIT
        try:
            while not (command := process.cmdline()):  # it is just becoming another program
                assert time.monotonic() < deadline
                time.sleep(0.001)
        except psutil.NoSuchProcess:  # it has ended
            return False
        return {module, *options} <= {*command}

    return [each for each in psutil.Process().children(recursive=True) if is_one(each)]


def assert_gone(processes: list[psutil.Process]) -> None:
    """Fail if some of these processes do not end; those that nobody has waited for yet, zombies, have ended."""
    deadline = time.monotonic() + END_LIMIT
    while (alive := [process for process in processes if _is_alive(process)]) and time.monotonic() < deadline:
        time.sleep(0.01)
    assert [" ".join(process.cmdline()) for process in alive] == []


def _is_alive(process: psutil.Process) -> bool:
    try:
        return bool(process.is_running()) and process.status() != psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return False


class ComponentProcess:
    """A process whose output, both streams together, is kept line by line.

    Leaving the `with` block ends it by SIGINT. One that has not ended by END_LIMIT fails, with what its threads did.
    """

    def __init__(
        self, command: list[str], environment: dict[str, str] | None = None, cwd: Path = REPOSITORY
    ) -> None:
        self.command = command
        of_python = {"PYTHONUNBUFFERED": "1", "PYTHONFAULTHANDLER": "1"}
        self._environment = {**os.environ, **of_python, **(environment or {})}
        self.cwd = cwd
        self._lines: list[str] = []
        self._changed = threading.Condition()

    def __enter__(self) -> Self:
        self.process = subprocess.Popen(
            self.command,
            cwd=self.cwd,
            env=self._environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            errors="replace",
            start_new_session=True,
        )
        self._reader = threading.Thread(target=self._read, name="output of a component", daemon=True)
        self._reader.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGINT)
        try:
            self.process.wait(END_LIMIT)
        except subprocess.TimeoutExpired:
            self.process.send_signal(signal.SIGABRT)  # Python writes what its threads do
            self._reader.join(EVENT_LIMIT)
            self.process.kill()
            self.process.wait(END_LIMIT)
            raise AssertionError(f"{self.command} did not end at SIGINT:\n{self.output}") from None
        finally:
            self._reader.join(END_LIMIT)
            # Otherwise closing would wait for the end of that process, without a limit, and without a signal's handler.
            assert not self._reader.is_alive(), (
                f"{self.command} left a process with its output:\n{self.output}"
            )
            assert self.process.stdout is not None
            self.process.stdout.close()

    def freeze(self) -> None:
        """Stop all threads of the process with SIGSTOP; SIGCONT continues it."""
        self.process.send_signal(signal.SIGSTOP)
        deadline = time.monotonic() + EVENT_LIMIT
        tasks = Path(f"/proc/{self.process.pid}/task")
        while not all(_state(task) == "T" for task in tasks.iterdir()):
            assert time.monotonic() < deadline, f"{self.command} does not stop"
            time.sleep(0.001)

    @property
    def output(self) -> str:
        """The output so far."""
        with self._changed:
            return "".join(self._lines)

    def wait_for(self, pattern: str, limit: float = START_LIMIT) -> re.Match[str]:
        """Wait until a line of the output matches; raises AssertionError with the output otherwise."""
        expression = re.compile(pattern)
        deadline = time.monotonic() + limit
        seen = 0
        with self._changed:
            while True:
                for line in self._lines[seen:]:
                    if match := expression.search(line):
                        return match
                seen = len(self._lines)
                left = deadline - time.monotonic()
                ended = self.process.poll() is not None and not self._reader.is_alive()
                if left <= 0 or ended:
                    state = f"ended with {self.process.returncode}" if ended else f"silent for {limit:g} s"
                    raise AssertionError(f"{self.command} {state}; no {pattern!r} in\n{''.join(self._lines)}")
                self._changed.wait(min(left, 0.1))

    def wait(self, limit: float = RUN_LIMIT) -> int:
        """Wait for the end of the process; return its exit code."""
        code = self.process.wait(limit)
        self._reader.join(EVENT_LIMIT)
        return code

    def _read(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            with self._changed:
                self._lines.append(line)
                self._changed.notify_all()


def _state(task: Path) -> str:
    return (task / "stat").read_text().rpartition(")")[2].split()[0]
