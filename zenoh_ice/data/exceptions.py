"""Exceptions of the object model: those of the runtime, and the root of those that interfaces declare."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, ClassVar, Self, cast, dataclass_transform

import msgspec

from zenoh_ice.data.text import cut, printable
from zenoh_ice.data.values import Struct, StructType


class ZenohIceError(Exception):
    """The root of every exception of the object model."""


class SystemException(ZenohIceError):
    """The root of the exceptions that the runtime itself raises."""


class ObjectNotExistException(SystemException):
    """No servant with this identity is present in the realm."""


class OperationNotExistException(SystemException):
    """The servant has no operation of this name."""


class UnknownException(SystemException):
    """The servant failed with an exception that the operation does not declare; the text is the servant's."""


class MarshalException(SystemException):
    """A payload is too large, malformed, or does not fit the types of the interface.

    `path` leads to the offending field from the root of the payload, such as `$.targets.HeadYaw`; it is empty
    where the payload as a whole is at fault.
    """

    def __init__(self, message: str, path: str = "") -> None:
        super().__init__(message)
        self.path = path


class TimeoutException(SystemException):
    """A call or a wait did not end within its limit."""


class ConnectionLostException(SystemException):
    """The server of a servant is offline or unreachable."""


class ConnectFailedException(ConnectionLostException):
    """Nothing answers at the endpoints that the component connects to, which the text names."""


class EndpointInUseException(SystemException):
    """Another process already listens on the endpoint."""


class InterfaceMismatchException(SystemException):
    """Proxy and servant were generated from different versions of an interface, or different interfaces.

    `expected` and `found` are the fingerprints of proxy and servant; `member` is the first member that
    differs.
    """

    def __init__(self, message: str, expected: str = "", found: str = "", member: str = "") -> None:
        super().__init__(message)
        self.expected = expected
        self.found = found
        self.member = member

    @classmethod
    def between(
        cls, what: str, type_id: str, expected: str, found: str, member: str = "", *, remedy: str = ""
    ) -> Self:
        """Return the exception for a proxy and a servant that have different versions of an interface."""
        return cls(
            f"{what}: the caller was generated from {expected}, the servant's {type_id} from {found}; "
            f"{f'{member}; ' if member else ''}{remedy or 'generate both from the same IDL'}",
            expected,
            found,
            member,
        )


class CommunicatorDestroyedException(SystemException):
    """The communicator was destroyed before or during the operation."""


class BusyException(SystemException):
    """Too many calls wait for the servant, or its process can start no thread; this one was not executed.

    Where a process can start no thread, it also gets this for its own subscriptions and streams.
    """


class AccessDeniedException(SystemException):
    """Access control denies this to the caller's certificate or user; the call was not executed."""


class AlreadyRegisteredException(SystemException):
    """The identity is already taken, in this communicator or by another process of the realm."""


class ConfigurationException(SystemException):
    """A setting, an identity or a proxy string is not valid."""


@dataclass_transform()
class UserException(ZenohIceError):
    """The root of the exceptions that interfaces declare.

    A subclass with an `id`, its Slice type id, declares its members as a dataclass does: its constructor
    takes those of its bases first. They are attributes, and `args` has their values.
    """

    ice_type_id: ClassVar[str] = "::Ice::UserException"
    Members: ClassVar[type[Struct]] = Struct
    """The members that are sent, those of the bases included."""

    def __init_subclass__(cls, *, id: str = "", **options: Any) -> None:  # noqa: ANN401
        super().__init_subclass__(**options)
        if id:
            cls.ice_type_id = id
            annotations = vars(cls).get("__annotations__", {})
            members = {"__annotations__": annotations, "__module__": cls.__module__}
            members |= {name: vars(cls)[name] for name in annotations if name in vars(cls)}
            cls.Members = cast("type[Struct]", StructType(f"{cls.__name__}Members", (cls.Members,), members))

    def __init__(self, /, *values: object, **named: object) -> None:  # of any name, `self` included
        members = msgspec.structs.asdict(self.Members(*values, **named))
        super().__init__(*members.values())
        self.__dict__.update(members)

    def ice_members(self) -> msgspec.Struct:
        """Return the members as the struct that is sent."""
        return self.Members(**{name: getattr(self, name) for name in self.Members.__struct_fields__})

    @classmethod
    def ice_type_ids(cls) -> list[str]:
        """Return the type ids from the exception's own to that of its outermost declared base."""
        declared = [vars(base)["ice_type_id"] for base in cls.__mro__ if "ice_type_id" in vars(base)]
        return declared[:-1]  # without the root's

    @classmethod
    def ice_subclasses(cls) -> Iterator[type[UserException]]:
        """Yield this exception and every known one derived from it."""
        yield cls
        for subclass in cls.__subclasses__():
            yield from subclass.ice_subclasses()

    def __str__(self) -> str:
        values = {name: getattr(self, name, None) for name in self.Members.__struct_fields__}
        what = values.pop("what", None)
        listed = ", ".join(f"{name}={value!r}" for name, value in values.items() if value != "")
        # It may come from another process; the member keeps the original.
        shown = "" if what is None else printable(str(what))
        return cut(f"{shown} ({listed})" if shown and listed else shown or listed)
