"""Pieces of code that take turns on one thread: each runs until it waits, and goes on when it is let."""

from __future__ import annotations

from collections.abc import Callable
from contextvars import Context
from typing import Any, Final
from weakref import ref

from greenlet import getcurrent, greenlet

_END_ATTEMPTS: Final = 3
"""Requests to end; code that refuses them all is left where it waits."""


class Coroutine:
    """A piece of code: it runs while `go` does, until it waits for something, or ends.

    All of it runs on the thread that lets it go for the first time. `context` says whose code it is;
    `variables` are its context variables, by default none.
    """

    def __init__(
        self, context: str, function: Callable[[], object], variables: Context | None = None
    ) -> None:
        self.context: Final = context
        self.actor: Any = None
        """The automaton whose cycle it is, if it is one."""
        self.want: Any = None
        """The thing that the code waits for; None while it runs, and after its end."""
        self._greenlet: Final[Any] = greenlet(lambda _none: function())
        self._greenlet.code = ref(self)  # the garbage collector does not look into what waits
        self._greenlet.gr_context = variables

    @property
    def ended(self) -> bool:
        """Whether the code has returned, or raised an exception."""
        return bool(self._greenlet.dead)

    def go(self, answer: Any = None) -> None:  # noqa: ANN401 - whatever it waits for
        """Let the code run, with the answer that it waits for; raises what the code raises."""
        self.want = None
        code = self._greenlet
        code.parent = getcurrent()
        code.switch(answer)

    def wait(self, want: Any = None) -> Any:  # noqa: ANN401 - whatever it waits for
        """Wait for the answer from `go`; called by the code."""
        self.want = want
        return self._greenlet.parent.switch()

    def close(self, error: type[BaseException]) -> None:
        """End code that waits, by an exception where it waits."""
        for _ in range(_END_ATTEMPTS):
            if self._greenlet:
                self._greenlet.parent = getcurrent()
                try:
                    self._greenlet.throw(error)
                except KeyboardInterrupt:  # of who ends it
                    raise
                except BaseException:  # noqa: BLE001, S110 - a cycle has reported it
                    pass


def current_coroutine() -> Coroutine | None:
    """Return the code that runs here; None outside of any."""
    reference: Callable[[], Coroutine | None] | None = getattr(getcurrent(), "code", None)
    return None if reference is None else reference()


def rest() -> None:
    """Wait, called by code that holds nothing meanwhile, so that it may be collected as garbage."""
    getcurrent().parent.switch()
