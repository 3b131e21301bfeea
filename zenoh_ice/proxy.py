"""Proxies: what clients call servants through."""

from __future__ import annotations

import copy
from collections.abc import Callable, Mapping
from concurrent.futures import Future
from functools import partial
from typing import TYPE_CHECKING, Any, ClassVar, Final, ParamSpec, Self, TypeVar, cast

from .attachment import check_context
from .exceptions import CommunicatorDestroyedException, InterfaceMismatchException, ZenohIceError
from .identity import Target
from .mismatch import describe_difference
from .object import ICE_DESCRIBE, ICE_ID, ICE_IDS, ICE_IS_A, ICE_PING, OBJECT_INTERFACE, InterfaceDescription
from .operation import Interface, Operation
from .outgoing import OutgoingCall, fail
from .stream_reader import Sample, StreamReader
from .subscription import Subscription
from .values import Reference

if TYPE_CHECKING:
    from .communicator import Communicator

__all__ = ["ObjectPrx"]

P = ParamSpec("P")
V = TypeVar("V")

# What a copy of a proxy takes over.
_STATE: Final = ("_communicator", "_target", "_timeout", "_context")


class ObjectPrx(Reference):
    """A proxy: it stands for a servant, wherever that is, and survives the restart of its server.

    Make one by `Communicator.stringToProxy` and give it a type by `checkedCast` of a generated class.
    """

    ice_interface: ClassVar[Interface] = OBJECT_INTERFACE

    def __init__(self, communicator: Communicator, target: Target, timeout: float) -> None:
        self._communicator = communicator
        self._target = target
        self._timeout = timeout
        self._context: Mapping[str, str] | None = None
        self._calls: dict[Operation[..., Any], OutgoingCall] = {}

    @classmethod
    def checkedCast(cls, proxy: ObjectPrx) -> Self:
        """Return a proxy of this type after making sure that its servant is there and has the interface.

        Raises ObjectNotExistException when the realm has no such servant, ConnectFailedException when
        nothing answers at the endpoints, ConnectionLostException when the server went away, and
        InterfaceMismatchException when the servant has another interface or another version of it.
        """
        cast = cls.uncheckedCast(proxy)
        cast._check_interface()
        return cast

    @classmethod
    def uncheckedCast(cls, proxy: ObjectPrx) -> Self:
        """Return a proxy of this type without asking anybody."""
        cast = cls(proxy._communicator, proxy._target, proxy._timeout)
        cast._context = proxy._context
        return cast

    def ice_getIdentity(self) -> str:
        """Return the identity of the servant."""
        return self._target.identity

    def ice_getRealm(self) -> str:
        """Return the realm of the servant."""
        return self._target.realm

    def ice_getCommunicator(self) -> Communicator:
        """Return the communicator of the proxy."""
        return self._communicator

    def ice_toString(self) -> str:
        """Return the proxy as text that `stringToProxy` takes."""
        realm = self._target.realm
        return self._target.object if realm == self._communicator.realm else str(self._target)

    def ice_toWire(self) -> str:
        """Return the proxy as text that means the same in every realm."""
        return str(self._target)

    @classmethod
    def ice_fromWire(cls, text: str, communicator: Communicator) -> Self:
        """Return the proxy that arrived as text."""
        return cls.uncheckedCast(communicator.stringToProxy(text))

    def ice_invocationTimeout(self, milliseconds: float) -> Self:
        """Return a copy whose calls end within another limit, in ms as in Ice."""
        return self._copy(_timeout=self._communicator.check_timeout(milliseconds / 1000))

    def ice_getInvocationTimeout(self) -> float:
        """Return the limit of calls in ms."""
        return self._timeout * 1000

    def ice_context(self, context: Mapping[str, str]) -> Self:
        """Return a copy whose calls tell the servant a context: texts by name, in `Current.ctx`.

        Raises MarshalException when it is none, or larger than 4096 bytes.
        """
        return self._copy(_context=check_context(context), _calls=self._calls)

    def ice_getContext(self) -> dict[str, str]:
        """Return the context of calls."""
        return dict(self._context or {})

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
        **kwargs: P.kwargs,  # noqa: ARG002 - the type system wants both; generated code gives positions
    ) -> V:
        """Call an operation and wait for its outcome.

        Raises the exceptions that the operation declares, or a SystemException; always within the limit.
        """
        try:
            call = self._calls[operation]
        except KeyError:
            call = self._prepare(operation)
        return cast("V", call.invoke(args, self._context))

    def ice_invokeAsync(
        self,
        operation: Operation[P, V],
        *args: P.args,
        **kwargs: P.kwargs,  # noqa: ARG002 - as above
    ) -> Future[V]:
        """Call an operation without waiting; the future has what `ice_invoke` would return or raise.

        Callbacks of the future run on threads of the communicator.
        """
        future: Future[V] = self._communicator.new_future()
        if operation in self._calls or self._communicator.knows(self._target):
            self._prepare_and_begin(operation, args, future)
        else:  # finding the servant may take a while
            self._communicator.dispatcher.submit(partial(self._prepare_and_begin, operation, args, future))
            if self._communicator.destroyed:  # meanwhile, and the job may have come too late
                fail(future, CommunicatorDestroyedException("the communicator was destroyed"))
        return future

    def ice_stream(self, operation: Operation[..., V]) -> StreamReader[V]:
        """Return the reader of a streamed operation, subscribing on first use."""
        return self._communicator.stream_reader(self._target, operation)

    def ice_subscribe(self, reader: StreamReader[V], callback: Callable[[Sample[V]], Any]) -> Subscription:
        """Call a function with the newest samples of a stream."""
        return self._communicator.new_subscription(reader, callback)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, ObjectPrx):
            return NotImplemented
        return self._target == other._target and self._communicator is other._communicator

    def __hash__(self) -> int:
        return hash(self._target)

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self._target}>"

    def _copy(self, **changes: object) -> Self:
        """Return a proxy that differs in some attributes; calls are got ready anew unless they are given."""
        copied = copy.copy(self)
        # What hangs on the one, such as its streams, is not for the other.
        copied.__dict__ = {name: self.__dict__[name] for name in _STATE} | {"_calls": {}} | changes
        return copied

    def _prepare_and_begin(
        self, operation: Operation[..., Any], args: tuple[Any, ...], future: Future[Any]
    ) -> None:
        try:
            call = self._calls.get(operation) or self._prepare(operation)
        except ZenohIceError as error:
            fail(future, error)
        else:
            call.begin(args, future, self._context)

    def _prepare(self, operation: Operation[..., Any]) -> OutgoingCall:
        """Wait until the servant is there, for not longer than a call, and get ready to call it."""
        communicator = self._communicator
        if not communicator.presence.is_lost(
            self._target
        ):  # as every later call: one that is lost fails at once
            communicator.find(self._target, None, self._timeout)
        call = communicator.outgoing_call(self._target, operation, self.ice_interface, self._timeout)
        self._calls[operation] = call
        return call

    def _check_interface(self) -> None:
        wanted = self.ice_interface
        if wanted is OBJECT_INTERFACE:
            self._communicator.find(self._target, None, self._timeout)
            return
        found = self._communicator.find(self._target, wanted.type_id, self._timeout)
        fingerprint = found.get(wanted.type_id)
        if fingerprint is None:
            raise InterfaceMismatchException(
                f"{self._target} is a {', '.join(sorted(found))}, not a {wanted.type_id}",
                expected=wanted.fingerprint,
            )
        if wanted.fingerprint and fingerprint != wanted.fingerprint:
            difference = describe_difference(ObjectPrx.uncheckedCast(self), wanted)
            raise InterfaceMismatchException(
                f"{self._target} has another version of {wanted.type_id}: the proxy was generated from "
                f"{wanted.fingerprint}, the servant from {fingerprint}; {difference}; generate both from "
                "the same IDL",
                expected=wanted.fingerprint,
                found=fingerprint,
                member=difference,
            )
