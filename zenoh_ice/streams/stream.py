"""The client's side of streams: what a proxy offers beside the call of a streamed operation."""

from __future__ import annotations

import threading
from collections.abc import AsyncIterator, Callable
from typing import TYPE_CHECKING, Any, Concatenate, Final, Generic, ParamSpec, TypeVar, overload

from ..exceptions import ConfigurationException
from ..operation import Operation
from .sample import Sample
from .samples import Samples
from .stream_reader import StreamReader
from .subscription import Delivery, Subscription

if TYPE_CHECKING:
    from ..proxy import ObjectPrx

__all__ = ["Sample", "Samples", "StreamedCall", "StreamedOperation", "Subscription", "streamed"]

P = ParamSpec("P")
V = TypeVar("V")


class StreamedCall(Generic[P, V]):
    """A streamed operation of a proxy: call it for the value now, or follow its stream.

    The first use of the stream subscribes; the servant publishes from then on, until the last subscription is
    closed and nobody has asked for a sample for 10 s. Who asks then subscribes again.
    """

    def __init__(
        self, proxy: ObjectPrx, call: Callable[Concatenate[Any, P], V], operation: Operation[..., V]
    ) -> None:
        self._proxy: Final = proxy
        self._call: Final = call
        self._operation: Final = operation
        self._reader: StreamReader[V] | None = None
        self.__doc__ = call.__doc__

    def __call__(self, *args: P.args, **kwargs: P.kwargs) -> V:
        """Call the operation."""
        return self._call(self._proxy, *args, **kwargs)

    def latest(self) -> Sample[V] | None:
        """Return the newest sample without a round trip, or None before the first has come.

        `value` of the sample is what the call returns, `age` its age in wall seconds. Raises MarshalException
        for a sample that does not fit the operation, InterfaceMismatchException for one of a servant with
        another version of the interface.
        """
        reader = self._reader
        if reader is None:
            reader = self._open()
        return reader.latest()

    def wait(self, after: Sample[V] | None = None, timeout: float | None = None) -> Sample[V]:
        """Return the next sample newer than `after`, or the newest at once without `after`.

        It waits for at most `timeout` s, by default the proxy's limit for calls. Raises TimeoutException;
        ConnectionLostException or ObjectNotExistException when the servant is gone; otherwise as `latest`.
        """
        reader = self._reader or self._open()
        return reader.wait(after, self._limit(timeout))

    def samples(self, timeout: float | None = None, *, rate: float | None = None) -> Samples[V]:
        """Return what yields sample after sample, always the newest, in `for` and in `async for`.

        With a rate, at most so many a second. Each is waited for for at most `timeout` s, by default the
        proxy's limit for calls; raises as `wait` does.
        """
        return Samples(self._reader or self._open(), self._limit(timeout), rate, self.subscribe)

    def __aiter__(self) -> AsyncIterator[Sample[V]]:
        """Yield sample after sample, as `samples` does."""
        return aiter(self.samples())

    def subscribe(
        self,
        callback: Callable[[Sample[V]], Any],
        *,
        rate: float | None = None,
        history: int = 0,
        queue: int = 1,
    ) -> Subscription[V]:
        """Call a function with sample after sample, on a thread of its own.

        While it runs, `queue` samples wait for it, and those that come beyond push the oldest out: with 1 it
        always gets the newest, and one that must miss none needs as many as come while it may be busy. `rate`
        is how many it gets a second at most. `history` is how many from before it gets first, if the
        servant's publisher keeps them.

        It goes on by itself after a restart of the server. An exception of the function is logged.
        """
        delivery = Delivery(rate, history, queue, self._limit(None))
        return self._proxy.ice_subscribe(self._reader or self._open(), callback, delivery)

    def _limit(self, timeout: float | None) -> float:
        if timeout is None:
            return self._proxy.ice_getInvocationTimeout() / 1000
        if not timeout >= 0.0:
            raise ConfigurationException(f"a wait lasts 0 s or more, not {timeout!r}")
        return min(timeout, threading.TIMEOUT_MAX)

    def _open(self) -> StreamReader[V]:
        self._reader = self._proxy.ice_stream(self._operation)
        return self._reader


class StreamedOperation(Generic[P, V]):
    """The descriptor of a streamed operation in a proxy class."""

    def __init__(self, call: Callable[Concatenate[Any, P], V], operation: Operation[..., V]) -> None:
        self._call: Final = call
        self._operation: Final = operation
        self.__doc__ = call.__doc__

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    @overload
    def __get__(self, instance: None, owner: type) -> StreamedOperation[P, V]: ...

    @overload
    def __get__(self, instance: ObjectPrx, owner: type) -> StreamedCall[P, V]: ...

    def __get__(
        self, instance: ObjectPrx | None, owner: type
    ) -> StreamedOperation[P, V] | StreamedCall[P, V]:
        if instance is None:
            return self
        # Kept in the instance, where the next look finds it before it comes here.
        bound: StreamedCall[P, V] = instance.__dict__.setdefault(
            self._name, StreamedCall(instance, self._call, self._operation)
        )
        return bound


def streamed(
    operation: Operation[..., V],
) -> Callable[[Callable[Concatenate[Any, P], V]], StreamedOperation[P, V]]:
    """Give a proxy's method the stream of its operation."""

    def decorate(call: Callable[Concatenate[Any, P], V]) -> StreamedOperation[P, V]:
        return StreamedOperation(call, operation)

    return decorate
