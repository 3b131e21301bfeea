"""Where servants that are coroutines run: an event loop on a thread of its own."""

from __future__ import annotations

import logging
import threading
from collections.abc import Coroutine
from concurrent.futures import Future
from typing import TYPE_CHECKING, Any, Final, TypeVar

from ._pool import mark_thread
from .exceptions import CommunicatorDestroyedException

if TYPE_CHECKING:  # loaded where it is needed: it takes long, and most programs have no coroutines
    import asyncio

__all__ = ["Coroutines"]

V = TypeVar("V")

_logger = logging.getLogger(__name__)


class Coroutines:
    """Run coroutines on one thread, which starts with the first of them."""

    def __init__(self, name: str) -> None:
        self._name: Final = name
        self._lock: Final = threading.Lock()
        self._loop: asyncio.AbstractEventLoop | None = None
        self._thread: threading.Thread | None = None
        self._closed = False

    def run(self, coroutine: Coroutine[Any, Any, V]) -> Future[V]:
        """Begin a coroutine and return the future of its outcome.

        Raises CommunicatorDestroyedException after `close`.
        """
        with self._lock:
            if self._closed:
                coroutine.close()  # or Python warns that nobody waited for it
                raise CommunicatorDestroyedException("the communicator was destroyed")
            import asyncio

            return asyncio.run_coroutine_threadsafe(coroutine, self._loop or self._start())

    def close(self, timeout: float) -> bool:
        """Cancel the coroutines that run and end the thread; return whether that took at most `timeout` s."""
        with self._lock:
            self._closed = True
            loop, thread = self._loop, self._thread
        if loop is None or thread is None:
            return True
        loop.call_soon_threadsafe(self._cancel_all)
        if thread is threading.current_thread():  # a coroutine ends its own communicator
            return False
        thread.join(timeout)
        if thread.is_alive():
            _logger.error("%s still busy after %g s", thread.name, timeout)
        return not thread.is_alive()

    def _start(self) -> asyncio.AbstractEventLoop:
        import asyncio

        loop = asyncio.new_event_loop()
        thread = threading.Thread(target=self._work, args=(loop,), name=self._name, daemon=True)
        thread.start()
        self._loop, self._thread = loop, thread
        return loop

    def _work(self, loop: asyncio.AbstractEventLoop) -> None:
        import asyncio

        mark_thread()
        asyncio.set_event_loop(loop)
        try:
            while not self._run(loop):
                pass
        finally:
            loop.close()

    def _run(self, loop: asyncio.AbstractEventLoop) -> bool:
        """Run the loop; return whether it was stopped: one that exits must not end all the others."""
        try:
            loop.run_forever()
        except BaseException:
            _logger.exception("a coroutine tried to end %s", threading.current_thread().name)
            return False
        return True

    def _cancel_all(self) -> None:
        import asyncio

        loop = asyncio.get_running_loop()
        tasks = asyncio.all_tasks(loop)
        for task in tasks:
            task.cancel()
        # The loop ends once they did, with what they do to clean up.
        ended = asyncio.gather(*tasks, return_exceptions=True)
        ended.add_done_callback(lambda _: loop.stop())
