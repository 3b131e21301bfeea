"""Processes that serve and call, and the commands that they execute."""

from __future__ import annotations

import gc
import multiprocessing
import os
import subprocess
import sys
import threading
import time
from collections import deque
from collections.abc import Callable
from contextlib import ExitStack
from functools import partial
from multiprocessing.connection import Connection
from pathlib import Path
from types import TracebackType
from typing import Any, Final, Self

import numpy as np

from . import peers
from .peers import Kind

_BENCHMARKS: Final = Path(__file__).resolve().parents[1]
# Without this, large replies of Ice take several times as long; ours run with the same settings.
_TUNED_MEMORY: Final = {"MALLOC_MMAP_THRESHOLD_": "134217728", "MALLOC_TRIM_THRESHOLD_": "268435456"}
_LIMIT: Final = 120.0  # s that a command may take
_END_LIMIT: Final = 15.0
_WARM_UP: Final = 20  # calls that are not counted: the processes are just waking up


class Worker:
    """A process that executes commands; leaving the `with` block ends it."""

    def __init__(self, role: str, kind: Kind, endpoint: str, folder: Path) -> None:
        self._name: Final = f"{role} of {kind.name}"
        self._pipe, other = multiprocessing.Pipe()
        # Not as `benchmarks.transport`: the folder above holds our own tree, and this kind may use another.
        program = [kind.python, "-P", "-m", "transport.workers"]
        path = os.pathsep.join(filter(None, (str(_BENCHMARKS), os.environ.get("PYTHONPATH"))))
        self._process: Final = subprocess.Popen(
            [*program, str(other.fileno()), role, kind.peer, endpoint, str(folder)],
            env={**os.environ, **_TUNED_MEMORY, **kind.environment, "PYTHONPATH": path},
            stdin=subprocess.DEVNULL,
            pass_fds=[other.fileno()],
        )
        other.close()
        self.answer()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._pipe.close()
        try:
            self._process.wait(_END_LIMIT)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait(_END_LIMIT)

    def do(self, command: str, *arguments: object) -> Any:  # noqa: ANN401
        """Execute a command and return its result; raises RuntimeError if it fails."""
        self.begin(command, *arguments)
        return self.answer()

    def begin(self, command: str, *arguments: object) -> None:
        """Let it execute a command, without waiting for the result."""
        self._pipe.send((command, arguments))

    def answer(self) -> Any:  # noqa: ANN401
        """Wait for the result of the command that was begun."""
        if not self._pipe.poll(_LIMIT):
            raise RuntimeError(f"{self._name} did not answer for {_LIMIT:g} s")
        try:
            answer = self._pipe.recv()
        except EOFError:
            raise RuntimeError(f"{self._name} ended unexpectedly") from None
        if isinstance(answer, Exception):
            raise RuntimeError(f"{self._name}: {type(answer).__name__}: {answer}")
        return answer


def _work(pipe: Connection, role: str, peer: str, endpoint: str, folder: Path) -> None:
    """Execute commands until the pipe is closed."""
    with pipe, ExitStack() as stack:
        tasks: object
        if role == "server":
            tasks = ServerTasks(stack.enter_context(peers.serve(peer, endpoint, folder)))
        else:
            tasks = ClientTasks(stack.enter_context(peers.connect(peer, endpoint, folder)), stack)
        gc.collect()
        gc.freeze()
        pipe.send(None)
        while True:
            try:
                command, arguments = pipe.recv()
            except (EOFError, KeyboardInterrupt):
                return
            try:
                pipe.send(getattr(tasks, command)(*arguments))
            except Exception as error:  # noqa: BLE001 - reported to the process that sent the command
                pipe.send(error)


class ServerTasks:
    """Sends on the stream of images, at a rate or as fast as it can."""

    def __init__(self, server: peers.Server) -> None:
        self._server = server
        self._stop = threading.Event()
        self._sender: threading.Thread | None = None

    def start(self, rate: float, size: tuple[int, int]) -> None:
        """Send images until `stop`; a rate of 0 is without pauses."""
        self._stop.clear()
        self._sender = threading.Thread(target=self._send, args=(rate, size))
        self._sender.start()

    def stop(self) -> None:
        """Stop sending."""
        self._stop.set()
        if self._sender is not None:
            self._sender.join(_END_LIMIT)

    def _send(self, rate: float, size: tuple[int, int]) -> None:
        sent, start = 0, time.monotonic()
        while not self._stop.wait(max(start + sent / rate - time.monotonic(), 0.0) if rate else 0.0):
            self._server.send_image(time.monotonic_ns(), peers.pixels(*size))
            sent += 1


class ClientTasks:
    """Calls a server and follows its stream."""

    def __init__(self, client: peers.Client, stack: ExitStack) -> None:
        self._client = client
        self._stack = stack
        self._latencies: list[float] = []

    def call(self, count: int, size: tuple[int, int] | None = None) -> list[float]:
        """Call for four doubles, or for an image, a number of times; return s per call."""
        call = self._client.step if size is None else partial(self._image, *size)
        return _timed(call, count)

    def call_together(self, start: float, seconds: float) -> list[float]:
        """Call for four doubles from a moment of the monotonic clock on; return s per call."""
        call, clock, times = self._client.step, time.monotonic, []
        for _ in range(_WARM_UP):
            call()
        time.sleep(max(0.0, start - clock()))
        before = clock()
        while before < start + seconds:
            call()
            after = clock()
            times.append(after - before)
            before = after
        return times

    def pipeline(self, count: int, width: int) -> float:
        """Keep `width` calls in flight; return calls per second."""
        call = self._client.begin_step
        flying = deque(call() for _ in range(width))
        start = time.perf_counter()
        for _ in range(count):
            flying.popleft().result()
            flying.append(call())
        rate = count / (time.perf_counter() - start)
        for future in flying:
            future.result()
        return rate

    def follow(self) -> None:
        """Follow the stream of images from now on."""
        self._stack.enter_context(self._client.follow(self._take))

    def arrived(self) -> list[float]:
        """Return the latencies in s of the images that arrived since the last time."""
        arrived, self._latencies = self._latencies, []
        return arrived

    def _take(self, image: Any) -> None:  # noqa: ANN401
        np.frombuffer(image.pixels, np.uint8)[-1]  # it is read, as by any subscriber
        self._latencies.append((time.monotonic_ns() - image.stamp) * 1e-9)

    def _image(self, width: int, height: int) -> None:
        if np.frombuffer(self._client.image(width, height), np.uint8).size != 3 * width * height:
            raise RuntimeError("the image is not complete")


def _timed(call: Callable[[], object], count: int) -> list[float]:
    for _ in range(_WARM_UP):
        call()
    clock, times = time.perf_counter, []
    for _ in range(count):
        start = clock()
        call()
        times.append(clock() - start)
    return times


if __name__ == "__main__":
    file, role, peer, endpoint, path = sys.argv[1:]
    _work(Connection(int(file)), role, peer, endpoint, Path(path))
