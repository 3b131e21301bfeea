"""Proxies: what clients call servants through."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any, ClassVar, Final, ParamSpec, Self, TypeVar, cast

from .calls.invocation import InvocationFuture, fail
from .calls.mismatch import describe_difference
from .calls.oneway import BatchedCall, OnewayCall
from .calls.outgoing_calls import AnyCall
from .exceptions import (
    CommunicatorDestroyedException,
    InterfaceMismatchException,
    ZenohIceError,
)
from .identity import Identity, Target, check_facet, stringToIdentity
from .object import ICE_DESCRIBE, ICE_ID, ICE_IDS, ICE_IS_A, ICE_PING, OBJECT_INTERFACE
from .operation import OBJECT_TYPE_ID, Interface, Operation
from .proxy_options import Context, ProxyOptions
from .reflection import Schema, parse_schema
from .streams.sample import Sample
from .streams.stream_reader import StreamReader
from .streams.subscription import Delivery, Subscription

if TYPE_CHECKING:
    from .communicator import Communicator

__all__ = ["ObjectPrx"]

P = ParamSpec("P")
V = TypeVar("V")

_WITHOUT_A_WAIT: Final = 0.95  # of a call's limit is left where its servant was known


class ObjectPrx(ProxyOptions):
    """A proxy: it stands for a servant, wherever that is, and survives the restart of its server.

    Make one by `Communicator.stringToProxy` and give it a type by `checkedCast` of a generated class. A proxy
    does not change: what would change it returns a copy.
    """

    ice_interface: ClassVar[Interface] = OBJECT_INTERFACE

    @classmethod
    def checkedCast(cls, proxy: ObjectPrx, facet: str | None = None, context: Context = None) -> Self:
        """Return a proxy of this type after making sure that its servant is there and has the interface.

        `facet` is that of the result; `context` is for the servant locator that may have to be asked.

        Raises ObjectNotExistException when the realm has no such servant, FacetNotExistException when it has
        no such facet, ConnectFailedException when nothing answers at the endpoints, ConnectionLostException
        when the server went away, and InterfaceMismatchException when the servant has another interface or
        another version of it.
        """
        cast = cls.uncheckedCast(proxy, facet)
        cast._check_interface(context)
        return cast

    @classmethod
    def uncheckedCast(cls, proxy: ObjectPrx, facet: str | None = None) -> Self:
        """Return a proxy of this type, of another facet if one is given, without asking anybody."""
        target = proxy._target if facet is None else proxy._target._replace(facet=check_facet(facet))
        cast = cls(proxy._communicator, target, proxy._manner.timeout)
        cast._manner, cast._context, cast._batch = proxy._manner, proxy._context, proxy._batch
        return cast

    # What it stands for.

    def ice_identity(self, identity: str | Identity) -> ObjectPrx:
        """Return a proxy of another servant in the same realm; cast it, as its type is not known."""
        target = Target(self._target.realm, str(stringToIdentity(str(identity))))
        return ObjectPrx.uncheckedCast(self._copy(_target=target))

    def ice_facet(self, facet: str) -> ObjectPrx:
        """Return a proxy of another facet; cast it, as its type is not known."""
        return ObjectPrx.uncheckedCast(self, facet)

    @classmethod
    def ice_fromWire(cls, text: str, communicator: Communicator) -> Self:
        """Return the proxy that arrived as text."""
        return cls.uncheckedCast(communicator.stringToProxy(text))

    # What every servant answers.

    def ice_ping(self, context: Context = None) -> None:
        """Return once the servant has answered."""
        self._telling(context).ice_invoke(ICE_PING)

    def ice_pingAsync(self, context: Context = None) -> InvocationFuture[None]:
        """Do as `ice_ping` does, without waiting."""
        return self._telling(context).ice_invokeAsync(ICE_PING)

    def ice_isA(self, id: str, context: Context = None) -> bool:
        """Return whether the servant has the interface of a type id."""
        return self._telling(context).ice_invoke(ICE_IS_A, id)

    def ice_isAAsync(self, id: str, context: Context = None) -> InvocationFuture[bool]:
        """Do as `ice_isA` does, without waiting."""
        return self._telling(context).ice_invokeAsync(ICE_IS_A, id)

    def ice_id(self, context: Context = None) -> str:
        """Return the type id of the servant's own interface."""
        return self._telling(context).ice_invoke(ICE_ID)

    def ice_idAsync(self, context: Context = None) -> InvocationFuture[str]:
        """Do as `ice_id` does, without waiting."""
        return self._telling(context).ice_invokeAsync(ICE_ID)

    def ice_ids(self, context: Context = None) -> list[str]:
        """Return the type ids of all interfaces of the servant."""
        return self._telling(context).ice_invoke(ICE_IDS)

    def ice_idsAsync(self, context: Context = None) -> InvocationFuture[list[str]]:
        """Do as `ice_ids` does, without waiting."""
        return self._telling(context).ice_invokeAsync(ICE_IDS)

    def ice_describe(self, context: Context = None) -> Schema:
        """Return the servant's own interface, those that it extends, and every type that they use.

        Raises MarshalException when what the servant says is no such description.
        """
        return parse_schema(self._telling(context).ice_invoke(ICE_DESCRIBE))

    # How generated code calls.

    def ice_invoke(
        self,
        operation: Operation[P, V],
        *args: P.args,
        **kwargs: P.kwargs,
    ) -> V:
        """Call an operation and wait for its outcome.

        Raises the exceptions that the operation declares, or a SystemException; always within the limit.
        """
        try:
            call = self._calls[operation]
        except KeyError:
            if self._communicator.searches(self._target, self._manner.timeout):
                # Not before those that wait; and not by what a subclass does with asynchronous calls.
                return ObjectPrx.ice_invokeAsync(self, operation, *args, **kwargs).result()
            call = self._prepare(operation, time.monotonic())
        return cast("V", call.invoke(args, self._context))

    def ice_invokeAsync(
        self,
        operation: Operation[P, V],
        *args: P.args,
        **kwargs: P.kwargs,  # noqa: ARG002 - the type system wants both; generated code gives positions
    ) -> InvocationFuture[V]:
        """Call an operation without waiting; the future has what `ice_invoke` would return or raise."""
        communicator, target, limit = self._communicator, self._target, self._manner.timeout
        call = self._calls.get(operation)
        waiting = communicator.searches(target, limit)
        at_once = not waiting and (call is not None or communicator.knows(target))
        future: InvocationFuture[V] = communicator.new_future(at_once=at_once)
        if at_once and call is not None:
            call.begin(args, future, self._context)
            return future
        begin = partial(self._prepare_and_begin, operation, args, future, time.monotonic())
        if at_once:
            begin()
            return future
        try:
            communicator.search(target, limit, begin)  # it may take a while
        except ZenohIceError as error:
            fail(future, error)
        if communicator.destroyed:  # meanwhile, and the search may have come too late
            fail(future, CommunicatorDestroyedException("the communicator was destroyed"))
        return future

    def ice_stream(self, operation: Operation[..., V]) -> StreamReader[V]:
        """Return the reader of a streamed operation, subscribing on first use."""
        return self._communicator.stream_reader(self._target, operation)

    def ice_subscribe(
        self, reader: StreamReader[V], callback: Callable[[Sample[V]], Any], delivery: Delivery
    ) -> Subscription[V]:
        """Call a function with the samples of a stream."""
        return self._communicator.new_subscription(reader, callback, delivery)

    def _prepare_and_begin(
        self,
        operation: Operation[..., Any],
        args: tuple[Any, ...],
        future: InvocationFuture[Any],
        began: float,
    ) -> None:
        try:
            call = self._prepare(operation, began)
        except ZenohIceError as error:
            fail(future, error)
        else:
            call.begin(args, future, self._context)

    def _prepare(self, operation: Operation[..., Any], began: float) -> AnyCall | BatchedCall:
        """Wait until the servant is there, and get ready to call it; return what does so now.

        Both together take as long as a call may, from a moment of the monotonic clock on.
        """
        communicator, target, interface = self._communicator, self._target, self.ice_interface
        limit, batch = self._manner.timeout, self._batch
        # As every later call: one of a servant that is lost fails at once. A batch is sent later.
        if batch is None and not communicator.presence.is_lost(target):
            communicator.find(target, None, began + limit - time.monotonic(), since=began)
        made = communicator.outgoing_call(target, operation, interface, self._manner)
        if batch is not None and isinstance(made, OnewayCall):
            self._calls[operation] = batched = BatchedCall(made, batch)
            return batched
        self._calls[operation] = made
        left = (began + limit - time.monotonic()) / limit
        if left > _WITHOUT_A_WAIT:
            return made
        # In tenths: for each other limit there is another querier.
        hurried = self._manner._replace(timeout=limit * max(1, int(10 * left)) / 10)
        return communicator.outgoing_call(target, operation, interface, hurried)

    def _check_interface(self, context: Context) -> None:
        wanted, timeout = self.ice_interface, self._manner.timeout
        if wanted is OBJECT_INTERFACE:
            self._communicator.find(self._target, None, timeout)
            return
        found = self._communicator.find(self._target, wanted.type_id, timeout)
        if OBJECT_TYPE_ID in found:  # a servant locator, which has to be asked for the servant
            schema = ObjectPrx.uncheckedCast(self.ice_twoway()).ice_describe(context)
            found = {each: schema.definitions[each].fingerprint for each in schema.lineage(schema.interface)}
        fingerprint = found.get(wanted.type_id)
        if fingerprint is None:
            raise InterfaceMismatchException(
                f"{self._target} is a {', '.join(sorted(found))}, not a {wanted.type_id}",
                expected=wanted.fingerprint,
            )
        if wanted.fingerprint and fingerprint != wanted.fingerprint:
            difference = describe_difference(ObjectPrx.uncheckedCast(self.ice_twoway()), wanted)
            raise InterfaceMismatchException(
                f"{self._target} has another version of {wanted.type_id}: the proxy was generated from "
                f"{wanted.fingerprint}, the servant from {fingerprint}; {difference}; generate both from "
                "the same IDL",
                expected=wanted.fingerprint,
                found=fingerprint,
                member=difference,
            )
