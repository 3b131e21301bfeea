"""Proxies: what clients call servants through."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from functools import partial
from typing import TYPE_CHECKING, Any, ClassVar, Final, Literal, ParamSpec, Self, TypeVar, cast

from .calls.invocation import InvocationFuture, fail
from .calls.manner import Manner, Mode, Replicas
from .calls.mismatch import describe_difference
from .calls.oneway import BatchedCall, OnewayBatch, OnewayCall
from .calls.outgoing_calls import AnyCall
from .exceptions import (
    CommunicatorDestroyedException,
    ConfigurationException,
    InterfaceMismatchException,
    ZenohIceError,
)
from .identity import Identity, Target, check_facet, stringToIdentity
from .object import ICE_DESCRIBE, ICE_ID, ICE_IDS, ICE_IS_A, ICE_PING, OBJECT_INTERFACE, InterfaceDescription
from .operation import OBJECT_TYPE_ID, Interface, Operation
from .streams.sample import Sample
from .streams.stream_reader import StreamReader
from .streams.subscription import Delivery, Subscription
from .wire.attachment import check_context
from .wire.values import Reference

if TYPE_CHECKING:
    from .communicator import Communicator

__all__ = ["ObjectPrx"]

P = ParamSpec("P")
V = TypeVar("V")

# What a copy of a proxy, or one of another type, takes over.
_STATE: Final = ("_communicator", "_target", "_manner", "_context", "_batch")

_WITHOUT_A_WAIT: Final = 0.95  # of a call's limit is left where its servant was known


class ObjectPrx(Reference):
    """A proxy: it stands for a servant, wherever that is, and survives the restart of its server.

    Make one by `Communicator.stringToProxy` and give it a type by `checkedCast` of a generated class. A proxy
    does not change: what would change it returns a copy.
    """

    ice_interface: ClassVar[Interface] = OBJECT_INTERFACE

    def __init__(self, communicator: Communicator, target: Target, timeout: float) -> None:
        self._communicator = communicator
        self._target = target
        self._manner = Manner(timeout)
        self._context: Mapping[str, str] | None = None
        self._batch: OnewayBatch | None = None
        self._calls: dict[Operation[..., Any], AnyCall | BatchedCall] = {}

    @classmethod
    def checkedCast(
        cls, proxy: ObjectPrx, facet: str | None = None, context: Mapping[str, str] | None = None
    ) -> Self:
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

    def ice_getIdentity(self) -> str:
        """Return the identity of the servant as text, `name` or `category/name`."""
        return self._target.identity

    def ice_identity(self, identity: str | Identity) -> ObjectPrx:
        """Return a proxy of another servant in the same realm; cast it, as its type is not known."""
        target = Target(self._target.realm, str(stringToIdentity(str(identity))))
        return ObjectPrx.uncheckedCast(self._copy(_target=target))

    def ice_getFacet(self) -> str:
        """Return the facet; it is empty for the servant itself."""
        return self._target.facet

    def ice_facet(self, facet: str) -> ObjectPrx:
        """Return a proxy of another facet; cast it, as its type is not known."""
        return ObjectPrx.uncheckedCast(self, facet)

    def ice_getRealm(self) -> str:
        """Return the realm of the servant."""
        return self._target.realm

    def ice_getCommunicator(self) -> Communicator:
        """Return the communicator of the proxy."""
        return self._communicator

    def ice_toString(self) -> str:
        """Return the proxy as text that `stringToProxy` takes."""
        realm = self._target.realm
        return self._text(self._target.object, "" if realm == self._communicator.realm else f"@{realm}")

    def ice_toWire(self) -> str:
        """Return the proxy as text that means the same in every realm."""
        return self._text(self._target.object, f"@{self._target.realm}")

    @classmethod
    def ice_fromWire(cls, text: str, communicator: Communicator) -> Self:
        """Return the proxy that arrived as text."""
        return cls.uncheckedCast(communicator.stringToProxy(text))

    # How it calls.

    def ice_invocationTimeout(self, milliseconds: float) -> Self:
        """Return a copy whose calls end within another limit, in ms as in Ice."""
        timeout = self._communicator.check_timeout(milliseconds / 1000)
        return self._copy(_manner=self._manner._replace(timeout=timeout))

    def ice_getInvocationTimeout(self) -> float:
        """Return the limit of calls in ms."""
        return self._manner.timeout * 1000

    def ice_context(self, context: Mapping[str, str]) -> Self:
        """Return a copy whose calls tell the servant a context: texts by name, in `Current.ctx`.

        Raises MarshalException when it is none, or larger than 4096 bytes.
        """
        return self._copy(_context=check_context(context), _calls=self._calls)

    def ice_getContext(self) -> dict[str, str]:
        """Return the context of calls."""
        return dict(self._context or {})

    def ice_twoway(self) -> Self:
        """Return a copy whose calls wait for their answers."""
        return self.ice_mode(Mode.TWOWAY)

    def ice_isTwoway(self) -> bool:
        """Return whether calls wait for their answers."""
        return self._manner.mode is Mode.TWOWAY

    def ice_oneway(self) -> Self:
        """Return a copy whose calls are sent and not answered.

        Only what returns nothing and declares no exceptions can be called so; anything else raises
        TwowayOnlyException. What was sent may be lost with its link, or be more than the servant takes.
        """
        return self.ice_mode(Mode.ONEWAY)

    def ice_isOneway(self) -> bool:
        """Return whether calls are sent and not answered."""
        return self._manner.mode is Mode.ONEWAY

    def ice_batchOneway(self) -> Self:
        """Return a copy whose calls are as oneway, and are sent by `ice_flushBatchRequests`, in their order.

        Copies of the copy share its batch. One of 1024 calls or 1 MiB is sent by itself.
        """
        return self.ice_mode(Mode.BATCH_ONEWAY)

    def ice_isBatchOneway(self) -> bool:
        """Return whether calls wait for `ice_flushBatchRequests`."""
        return self._manner.mode is Mode.BATCH_ONEWAY

    def ice_mode(self, mode: Mode) -> Self:
        """Return a copy that calls in another mode, or the proxy itself if that is its own."""
        if mode is self._manner.mode:
            return self
        batch = self._communicator.new_batch() if mode is Mode.BATCH_ONEWAY else None
        return self._copy(_manner=self._manner._replace(mode=mode), _batch=batch)

    def ice_flushBatchRequests(self) -> None:
        """Send the calls that were made since the last time.

        Raises what says that a call cannot arrive, after the others were sent.
        """
        if self._batch is not None:
            self._batch.flush()

    def ice_replicas(self, choice: Literal["nearest", "first", "spread"]) -> Self:
        """Return a copy that calls otherwise where several servers serve the identity as replicas.

        `nearest`, the default, leaves the choice to Zenoh; `first` asks all and takes the first good answer,
        of idempotent operations only; `spread` asks one after the other.
        """
        try:
            replicas = Replicas(choice)
        except ValueError:
            choices = ", ".join(known.value for known in Replicas)
            raise ConfigurationException(f"replicas are called {choices}, not {choice!r}") from None
        return self._copy(_manner=self._manner._replace(replicas=replicas))

    def ice_getReplicas(self) -> str:
        """Return which of several replicas is called."""
        return self._manner.replicas.value

    # What every servant answers.

    def ice_ping(self) -> None:
        """Return once the servant has answered."""
        self.ice_invoke(ICE_PING)

    def ice_isA(self, id: str) -> bool:
        """Return whether the servant has the interface of a type id."""
        return self.ice_invoke(ICE_IS_A, id)

    def ice_id(self) -> str:
        """Return the type id of the servant's own interface."""
        return self.ice_invoke(ICE_ID)

    def ice_ids(self) -> list[str]:
        """Return the type ids of all interfaces of the servant."""
        return self.ice_invoke(ICE_IDS)

    def ice_describe(self) -> list[InterfaceDescription]:
        """Return fingerprint and definition of all interfaces of the servant."""
        return self.ice_invoke(ICE_DESCRIBE)

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
                return self.ice_invokeAsync(operation, *args, **kwargs).result()  # not before those that wait
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

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, ObjectPrx):
            return NotImplemented
        return all(getattr(self, name) == getattr(other, name) for name in _STATE)

    def __hash__(self) -> int:
        return hash(self._target)

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.ice_toWire()}>"

    def _copy(self, **changes: object) -> Self:
        """Return a proxy that differs in some attributes; calls are got ready anew unless they are given."""
        own = self.__dict__
        copied = object.__new__(type(self))
        # What hangs on the one, such as its streams, is not for the other.
        copied.__dict__.update({name: own[name] for name in _STATE} | {"_calls": {}} | changes)
        return copied

    def _text(self, target: str, realm: str) -> str:
        mode = self._manner.mode
        return target + ("" if mode is Mode.TWOWAY else f" -{mode.value}") + realm

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

    def _check_interface(self, context: Mapping[str, str] | None) -> None:
        wanted, timeout = self.ice_interface, self._manner.timeout
        if wanted is OBJECT_INTERFACE:
            self._communicator.find(self._target, None, timeout)
            return
        found = self._communicator.find(self._target, wanted.type_id, timeout)
        if OBJECT_TYPE_ID in found:  # a servant locator, which has to be asked for the servant
            asking = ObjectPrx.uncheckedCast(self.ice_twoway())
            descriptions = (asking if context is None else asking.ice_context(context)).ice_describe()
            found = {known.typeId: known.fingerprint for known in descriptions}
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
