"""What a proxy knows beside its type: for whom it stands, and how it calls."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final, Literal, Self

from .calls.manner import Manner, Mode, Replicas
from .calls.oneway import BatchedCall, OnewayBatch
from .calls.outgoing_calls import AnyCall
from .exceptions import ConfigurationException
from .identity import Target
from .operation import Operation
from .wire.attachment import check_context
from .wire.values import Reference

if TYPE_CHECKING:
    from .communicator import Communicator

__all__ = ["Context", "ProxyOptions"]

Context = Mapping[str, str] | None
"""What a call tells its servant beside the parameters, if that is not what its proxy does."""

# What a copy of a proxy, or one of another type, takes over.
_STATE: Final = ("_communicator", "_target", "_manner", "_context", "_batch")


class ProxyOptions(Reference):
    """The part of a proxy that says whom it calls and how; every change returns a copy."""

    def __init__(self, communicator: Communicator, target: Target, timeout: float) -> None:
        self._communicator = communicator
        self._target = target
        self._manner = Manner(timeout)
        self._context: Mapping[str, str] | None = None
        self._batch: OnewayBatch | None = None
        self._calls: dict[Operation[..., Any], AnyCall | BatchedCall] = {}

    # For whom it stands.

    def ice_getIdentity(self) -> str:
        """Return the identity of the servant as text, `name` or `category/name`."""
        return self._target.identity

    def ice_getFacet(self) -> str:
        """Return the facet; it is empty for the servant itself."""
        return self._target.facet

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

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, ProxyOptions):
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

    def _telling(self, context: Context) -> Self:
        return self if context is None else self.ice_context(context)

    def _text(self, target: str, realm: str) -> str:
        mode = self._manner.mode
        return target + ("" if mode is Mode.TWOWAY else f" -{mode.value}") + realm
