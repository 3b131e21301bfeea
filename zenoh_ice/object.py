"""The root of servants, and what a servant is told about the call that it serves."""

from __future__ import annotations

from abc import ABC
from typing import TYPE_CHECKING, Any, ClassVar, Final, TypeVar

import msgspec

from .operation import OBJECT_TYPE_ID, Interface, Operation
from .reflection import schema_of
from .streams import Publisher

if TYPE_CHECKING:
    from .communicator import Communicator
    from .servant import ObjectAdapter

__all__ = ["OBJECT_INTERFACE", "Current", "Object"]

V = TypeVar("V")


class Current(msgspec.Struct):  # which is made in a third of the time that a dataclass takes
    """The call that a servant serves."""

    identity: str
    """Identity under which the servant was called."""
    operation: str
    """Name of the operation."""
    call_id: str
    """Id of the call, for logs."""
    timeout: float
    """Seconds after which the caller gives up; 0 when it did not say."""
    communicator: Communicator
    """Communicator of the servant."""
    adapter: ObjectAdapter | None
    """Adapter of the servant; None in a test without Zenoh."""

    @property
    def client(self) -> str:
        """Id of the calling session, as `onClientLost` reports it; empty when the caller gave none.

        The caller writes it: it serves honest programs, and proves nothing.
        """
        return self.call_id.partition("/")[0]


class _NoArguments(msgspec.Struct):
    pass


class _TypeIdArgument(msgspec.Struct):
    id: str


class _NoResult(msgspec.Struct):
    pass


class _BoolResult(msgspec.Struct):
    returnValue: bool


class _TextResult(msgspec.Struct):
    returnValue: str


class _TextsResult(msgspec.Struct):
    returnValue: list[str]


ICE_PING: Final[Operation[[], None]] = Operation(
    "ice_ping", arguments=_NoArguments, result=_NoResult, idempotent=True
)
ICE_IS_A: Final[Operation[[str], bool]] = Operation(
    "ice_isA", arguments=_TypeIdArgument, result=_BoolResult, idempotent=True
)
ICE_ID: Final[Operation[[], str]] = Operation(
    "ice_id", arguments=_NoArguments, result=_TextResult, idempotent=True
)
ICE_IDS: Final[Operation[[], list[str]]] = Operation(
    "ice_ids", arguments=_NoArguments, result=_TextsResult, idempotent=True
)
ICE_DESCRIBE: Final[Operation[[], str]] = Operation(
    "ice_describe", arguments=_NoArguments, result=_TextResult, idempotent=True
)

OBJECT_INTERFACE: Final = Interface(
    OBJECT_TYPE_ID, operations=(ICE_PING, ICE_IS_A, ICE_ID, ICE_IDS, ICE_DESCRIBE)
)


class Object(ABC):  # noqa: B024 - the abstract methods are those of the generated subclasses
    """The root of servants: what each answers besides the operations of its interface.

    Subclass the generated servant of an interface and implement its operations. Calls of one servant run one
    at a time, on threads of the communicator, unless `ice_concurrent` is set on the class or the servant.
    """

    ice_interface: ClassVar[Interface] = OBJECT_INTERFACE
    ice_concurrent: bool = False
    """Whether calls of this servant may overlap."""

    def ice_ping(self, current: Current) -> None:  # noqa: B027 - it answers, and that is all
        """Do nothing: the answer shows that the servant is there."""

    def ice_isA(self, id: str, current: Current) -> bool:  # noqa: ARG002
        """Return whether the servant has the interface of a type id."""
        return id in self.ice_interface.type_ids

    def ice_id(self, current: Current) -> str:  # noqa: ARG002
        """Return the type id of the servant's own interface."""
        return self.ice_interface.type_id

    def ice_ids(self, current: Current) -> list[str]:  # noqa: ARG002
        """Return the type ids of all interfaces of the servant, sorted."""
        return list(self.ice_interface.type_ids)

    def ice_describe(self, current: Current) -> str:  # noqa: ARG002
        """Return the schema of the servant's interface as JSON, which `ObjectPrx.ice_describe` reads.

        Raises ConfigurationException when codegen did not write one.
        """
        return schema_of(self.ice_interface).as_json()

    def ice_publisher(self, operation: Operation[..., V]) -> Publisher[V]:
        """Return the publisher of a streamed operation.

        It may be had before an adapter serves the servant: until then nobody listens.
        """
        # Servants need not call our constructor, as in Ice, so there is none.
        publishers = self.ice_publishers()
        return publishers.setdefault(operation.name, Publisher(operation))

    def ice_publishers(self) -> dict[str, Publisher[Any]]:
        """Return the publishers by name of operation."""
        publishers: dict[str, Publisher[Any]] = self.__dict__.setdefault("_ice_publishers", {})
        return publishers
