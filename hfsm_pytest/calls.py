"""The calls of a behavior on its proxies: made within the process, and remembered."""

from __future__ import annotations

import asyncio
import itertools
from collections.abc import Callable, Coroutine, Iterator, Mapping
from concurrent.futures import Future
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, TypeVar

from zenoh_ice.calls.invocation import InvocationFuture, settle
from zenoh_ice.operation import Interface, Operation
from zenoh_ice.serving.incoming import Incoming
from zenoh_ice.wire.attachment import encode_call_attachment
from zenoh_ice.wire.errors import decode_error

if TYPE_CHECKING:
    from hfsm_runtime.tree import Run

    from .communicator import InProcessCommunicator

__all__ = ["Call", "CallLog", "InProcessCall", "InlineCoroutines", "InlineDispatcher"]

V = TypeVar("V")

CLIENT: Final = "behavior"
"""The id of the component as a client."""


@dataclass(frozen=True, slots=True)
class Call:
    """A call that the behavior made, at a time in s, and what came of it.

    `automaton` and `state` are the names of those whose code made it, empty for calls outside of any cycle.
    """

    time: float
    target: str
    """Servant and operation, as in `Head.setPose`."""
    arguments: dict[str, Any]
    """What was handed over, by the names of the parameters."""
    result: Any
    error: Exception | None
    automaton: str
    state: str

    def __getattr__(self, name: str) -> Any:  # noqa: ANN401
        """Return an argument: `call.pan` is `call.arguments["pan"]`."""
        if name.startswith("__"):  # asked for by copy and pickle, also while there are no arguments yet
            raise AttributeError(name)
        try:
            return self.arguments[name]
        except KeyError:
            known = ", ".join(self.arguments) or "none"
            raise AttributeError(f"{self.target} has no argument {name!r}; it has {known}") from None

    def __str__(self) -> str:
        arguments = ", ".join(f"{name}={_short(value)}" for name, value in self.arguments.items())
        outcome = f"raised {self.error!r}" if self.error else f"-> {_short(self.result)}"
        place = f"  [{self.automaton}/{self.state}]" if self.automaton else ""
        return f"{self.time:9.3f} s  {self.target}({arguments}) {outcome}{place}"


class CallLog:
    """The calls that were made, in their order."""

    def __init__(self, now: Callable[[], float]) -> None:
        self._now = now
        self._calls: list[Call] = []
        self.run: Run | None = None
        """The automaton whose code runs now."""

    def add(self, target: str, arguments: dict[str, Any], result: object, error: Exception | None) -> None:
        """Remember a call."""
        place = (self.run.automaton.name, self.run.current.name) if self.run else ("", "")
        self._calls.append(Call(self._now(), target, arguments, result, error, *place))

    def find(self, target: str = "") -> list[Call]:
        """Return the calls of an operation (`Head.setPose`) or of a servant (`Head`), or all."""
        return [call for call in self._calls if target in ("", call.target, call.target.partition(".")[0])]

    def __iter__(self) -> Iterator[Call]:
        return iter(self._calls)


class InlineDispatcher:
    """What runs jobs for a communicator: here at once, in the thread that gives them."""

    def submit(self, job: Callable[[], object]) -> None:
        """Run a job."""
        job()

    def blocked(self) -> AbstractContextManager[None]:
        """Do nothing: there is no pool that could run out of threads."""
        return nullcontext()


class InlineCoroutines:
    """What runs servants that are coroutines: here at once, each to its end."""

    def run(self, coroutine: Coroutine[Any, Any, V]) -> Future[V]:
        """Run a coroutine and return the future of its outcome, which it has."""
        future: Future[V] = Future()
        settle(future, lambda: asyncio.run(coroutine))
        return future


class InProcessCall:
    """Call one operation of one servant, with arguments and results encoded as they would travel."""

    _numbers: Final = itertools.count(1)

    def __init__(
        self,
        communicator: InProcessCommunicator,
        find: Callable[[], Incoming],
        operation: Operation[..., Any],
        interface: Interface,
        timeout: float,
    ) -> None:
        self._communicator: Final = communicator
        self._find: Final = find
        self._operation: Final = operation
        self._interface: Final = interface
        self._timeout: Final = timeout

    def invoke(self, arguments: tuple[Any, ...], context: Mapping[str, str] | None = None) -> object:
        """Call, and return what the operation returns or raise what it raises."""
        servant = self._find()
        what = f"{servant.target.identity}.{self._operation.name}"
        payload = self._operation.arguments.pack(arguments, what)
        try:
            result = self._exchange(servant, what, payload, context)
        except Exception as error:
            self._log(what, arguments, None, error)
            raise
        self._log(what, arguments, result, None)
        return result

    def begin(
        self,
        arguments: tuple[Any, ...],
        future: InvocationFuture[Any],
        context: Mapping[str, str] | None = None,
    ) -> None:
        """Call, and let the future tell the outcome, which it has when this returns."""
        settle(future, lambda: self.invoke(arguments, context))

    def _exchange(
        self, servant: Incoming, what: str, payload: bytes, context: Mapping[str, str] | None
    ) -> object:
        number = next(self._numbers)
        fingerprint = self._interface.fingerprint
        attachment = encode_call_attachment(fingerprint, number, CLIENT, self._timeout, context)
        succeeded, answer = servant.call_here(self._operation.name, payload, attachment, self._timeout)
        communicator = self._communicator.as_communicator
        if succeeded:
            return self._operation.result.unpack_result(bytes(answer), what, communicator)
        raise decode_error(bytes(answer), self._operation.exceptions, what, communicator)

    def _log(self, what: str, arguments: tuple[Any, ...], result: object, error: Exception | None) -> None:
        if not self._operation.name.startswith("ice_"):
            named = dict(zip(self._operation.arguments.fields, arguments, strict=False))
            self._communicator.calls.add(what, named, result, error)


def _short(value: object) -> str:
    text = repr(value) if not isinstance(value, float) else f"{value:.4g}"
    return text if len(text) <= 60 else text[:57] + "..."
