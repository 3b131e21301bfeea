"""Threads of user code that run one at a time, when whoever drives the replay says so, as far as it says."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any, Final

from .errors import ReplayEndedError, ReplayError

__all__ = ["Strand", "Strands"]

_PATIENCE: Final = 30.0
"""Wall seconds that a piece of user code may take until it asks for something recorded, or ends."""
_CLOSE: Final = 2.0
_MOST: Final = 10_000
"""Strands at a time."""


class Strand:
    """The code of one context. It runs only during `run` and `resume`, which return when it waits or ends."""

    def __init__(self, context: str, here: threading.local) -> None:
        self.context: Final = context
        self.want: Any = None
        """What the code waits for; None while it runs, and when it has ended."""
        self.failure: BaseException | None = None
        """What ended the code, if anything did."""
        self._here = here
        self._answer: Any = None
        self._function: Callable[[], object] | None = None
        self._go = threading.Semaphore(0)
        self._back = threading.Semaphore(0)
        self._closing = False
        self._thread = threading.Thread(target=self._run, name=f"replay of {context}", daemon=True)

    @property
    def idle(self) -> bool:
        """Whether no code waits here."""
        return self.want is None

    def run(self, function: Callable[[], object]) -> None:
        """Run a piece of code until it waits or ends."""
        assert self.idle, f"{self.context} still waits"
        self._function, self.failure = function, None
        if self._thread.ident is None:
            self._thread.start()
        self._switch()

    def resume(self, answer: object) -> None:
        """Give the code what it waits for, and let it run until it waits again or ends."""
        self.want, self._answer = None, answer
        self._switch()

    def wait(self, want: object) -> object:
        """Wait, on this strand's own thread, for what `resume` brings."""
        self.want = want
        self._back.release()
        self._go.acquire()
        self._check_open()
        answer, self._answer = self._answer, None
        return answer

    def close(self) -> None:
        """End the thread."""
        self._closing = True
        self.want = None
        if self._thread.ident is not None:
            self._go.release()
            self._thread.join(_CLOSE)

    def _check_open(self) -> None:
        if self._closing:
            raise ReplayEndedError

    def _switch(self) -> None:
        self._go.release()
        if not self._back.acquire(timeout=_PATIENCE):
            raise ReplayError(
                f"the code of {self.context} neither ends nor reads anything recorded within {_PATIENCE:g} s"
            )

    def _run(self) -> None:
        self._here.strand = self
        while True:
            self._go.acquire()
            if self._closing:
                return
            try:
                assert self._function is not None
                self._function()
            except ReplayEndedError:
                pass  # either the replay is over, or the driver knows why
            except BaseException as error:  # noqa: BLE001 - the driver tells it
                self.failure = error
            self._back.release()


class Strands:
    """The strands of a replay, by context, made as they are needed."""

    def __init__(self) -> None:
        self._here = threading.local()
        self._all: dict[str, Strand] = {}

    @property
    def current(self) -> Strand | None:
        """The strand of this thread; None on any other thread."""
        found: Strand | None = getattr(self._here, "strand", None)
        return found

    @property
    def context(self) -> str | None:
        """The context of the code that this thread runs."""
        strand = self.current
        return strand.context if strand else None

    def __getitem__(self, context: str) -> Strand:
        if context not in self._all:
            if len(self._all) >= _MOST:
                raise ReplayError(f"the recording has the code of more than {_MOST} contexts at a time")
            self._all[context] = Strand(context, self._here)
        return self._all[context]

    def drop(self, context: str) -> None:
        """End the thread of a context that runs no more code."""
        strand = self._all.pop(context, None)
        if strand is not None:
            strand.close()

    def close(self) -> None:
        """End all threads."""
        for strand in self._all.values():
            strand.close()
