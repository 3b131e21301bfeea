"""The commands of a benchmark server: send on its streams."""

from __future__ import annotations

import threading
import time
from contextlib import AbstractContextManager, ExitStack
from typing import Any, Self

from .content import JOINTS, frame
from .peers import Server
from .processor_time import thread_times


class ServerTasks:
    """Sends joint states or images, as fast as it can or at a rate."""

    thread_times = staticmethod(thread_times)

    def __init__(self, opened: AbstractContextManager[Server]) -> None:
        self._stack = ExitStack()
        self._server = self._stack.enter_context(opened)
        self._numbers: dict[str, int] = {}
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.stop_sending()
        self._stack.close()

    def send(
        self, stream: str, count: int | None, rate: float = 0.0, size: tuple[int, int] = (0, 0)
    ) -> dict[str, Any]:
        """Send values, `rate` per second or without pauses, with consecutive numbers."""
        content: Any = list(JOINTS) if stream == "joints" else frame(*size)
        number = first = self._numbers.get(stream, 0)
        start = time.monotonic()
        while (count is None or number - first < count) and not self._stop.is_set():
            if rate:
                pause = start + (number - first) / rate - time.monotonic()
                if pause > 0:
                    time.sleep(pause)
            number += 1
            self._server.send(stream, time.monotonic_ns(), number, content)
        self._numbers[stream] = number
        return {"last": number, "sent": number - first, "wall": time.monotonic() - start}

    def start_sending(self, stream: str, rate: float, size: tuple[int, int] = (0, 0)) -> None:
        """Send until `stop_sending`, while other commands are executed."""
        self._stop.clear()
        self._thread = threading.Thread(target=self.send, args=(stream, None, rate, size))
        self._thread.start()

    def stop_sending(self) -> None:
        """Stop sending."""
        self._stop.set()
        if self._thread is not None:
            self._thread.join(10.0)
            self._thread = None
        self._stop.clear()
