"""Start the processes of the benchmark, send them commands, and stop them."""

from __future__ import annotations

import json
import os
import queue
import subprocess
import sys
import tempfile
import threading
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from types import TracebackType
from typing import Any, Final, Self

from tests.support.processes import free_endpoint

from .interface import IDENTITY, REPOSITORY, generate

LIMIT: Final = 120.0  # s that a command may take
_END_LIMIT: Final = 15.0
# Without this, large replies of Ice take several times as long; ours run with the same settings.
TUNED_MEMORY: Final = {"MALLOC_MMAP_THRESHOLD_": "134217728", "MALLOC_TRIM_THRESHOLD_": "268435456"}


class Worker:
    """A process that executes commands; leaving the `with` block ends it."""

    def __init__(
        self,
        role: str,
        kind: str,
        endpoints: Sequence[str],
        package: Path,
        identity: str = IDENTITY,
    ) -> None:
        self.name: Final = f"{kind} {role}"
        self.endpoints: Final = endpoints
        command = [sys.executable, "-m", "benchmarks.transport.worker", role, kind, *endpoints]
        self._process = subprocess.Popen(
            [*command, "--package", str(package), "--identity", identity],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            cwd=REPOSITORY,
            # Ctrl-C goes to us, and we end it. No session: Linux would schedule each session separately.
            process_group=0,
            env={**os.environ, **TUNED_MEMORY},
        )
        self.pid: Final = self._process.pid
        self._answers: queue.SimpleQueue[str] = queue.SimpleQueue()
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        assert self._process.stdin is not None
        with suppress(BrokenPipeError):  # it was killed
            self._process.stdin.close()
        try:
            self._process.wait(_END_LIMIT if error is None else 1.0)
        except subprocess.TimeoutExpired:
            self.kill()

    def wait_until_ready(self) -> Self:
        """Wait until it has started."""
        self._answer(LIMIT)
        return self

    def start(self, do: str, **arguments: Any) -> None:  # noqa: ANN401
        """Send a command; `finish` returns its result."""
        assert self._process.stdin is not None
        self._process.stdin.write(json.dumps({"do": do, **arguments}) + "\n")
        self._process.stdin.flush()

    def finish(self, limit: float = LIMIT) -> Any:  # noqa: ANN401
        """Return the result of the started command. Raises RuntimeError if it failed."""
        return self._answer(limit).get("result")

    def do(self, do: str, **arguments: Any) -> Any:  # noqa: ANN401
        """Send a command and return its result."""
        self.start(do, **arguments)
        return self.finish()

    def kill(self) -> None:
        """End it like a crash."""
        self._process.kill()
        self._process.wait(_END_LIMIT)

    def _read(self) -> None:
        assert self._process.stdout is not None
        with self._process.stdout as stream:
            for line in stream:
                self._answers.put(line)
        self._answers.put("")

    def _answer(self, limit: float) -> dict[str, Any]:
        try:
            line = self._answers.get(timeout=limit)
        except queue.Empty:
            raise RuntimeError(f"{self.name} did not answer for {limit:g} s") from None
        if not line:
            raise RuntimeError(f"{self.name} ended unexpectedly")
        answer: dict[str, Any] = json.loads(line)
        if "error" in answer:
            raise RuntimeError(f"{self.name}: {answer['error']}")
        return answer


class Lab:
    """Starts servers and their clients, and ends them all."""

    def __init__(self, package: Path) -> None:
        self.package: Final = package
        self._stack = ExitStack()

    def pair(self, kind: str, clients: int = 1) -> tuple[Worker, list[Worker]]:
        """Return a server and its clients."""
        server = self.worker("server", kind, [free_endpoint()]).wait_until_ready()
        return server, self.clients(kind, server, clients)

    def clients(self, kind: str, server: Worker, number: int = 1) -> list[Worker]:
        """Return clients of a server."""
        workers = [self.worker("client", kind, server.endpoints) for _ in range(number)]
        return [worker.wait_until_ready() for worker in workers]

    def worker(
        self,
        role: str,
        kind: str,
        endpoints: Sequence[str],
        identity: str = IDENTITY,
    ) -> Worker:
        """Return a process that may not be ready yet."""
        return self._stack.enter_context(Worker(role, kind, endpoints, self.package, identity))

    def __enter__(self) -> Self:
        self._stack.__enter__()
        return self

    def __exit__(self, *exception: Any) -> None:  # noqa: ANN401
        self._stack.__exit__(*exception)


@contextmanager
def generated_package() -> Iterator[Path]:
    """Yield the temporary folder of the generated package."""
    with tempfile.TemporaryDirectory() as folder:
        generate(Path(folder))
        yield Path(folder)
