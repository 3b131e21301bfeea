"""What the canonical definition of an interface tells: its operations, and every type that they use."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final, TypeAlias

from zenoh_ice import MarshalException

__all__ = [
    "RETURN_VALUE",
    "Builtin",
    "Definitions",
    "Dictionary",
    "Enumeration",
    "Member",
    "Named",
    "OperationSignature",
    "Optional",
    "Proxy",
    "Record",
    "Sequence",
    "Type",
    "unscoped",
]

RETURN_VALUE: Final = "returnValue"

_LONGEST_LINEAGE: Final = 64


@dataclass(frozen=True, slots=True)
class Builtin:
    """A type of Slice itself; `Object` and `Value` are any class."""

    name: str

    def __str__(self) -> str:
        return self.name


@dataclass(frozen=True, slots=True)
class Named:
    """A struct, a class or an enumeration."""

    type_id: str

    def __str__(self) -> str:
        return unscoped(self.type_id)


@dataclass(frozen=True, slots=True)
class Proxy:
    """A proxy of a servant of an interface."""

    type_id: str

    def __str__(self) -> str:
        return f"{unscoped(self.type_id)}*"


@dataclass(frozen=True, slots=True)
class Sequence:
    """A sequence."""

    element: Type

    def __str__(self) -> str:
        return f"sequence<{self.element}>"


@dataclass(frozen=True, slots=True)
class Dictionary:
    """A dictionary."""

    key: Type
    value: Type

    def __str__(self) -> str:
        return f"dictionary<{self.key}, {self.value}>"


@dataclass(frozen=True, slots=True)
class Optional:
    """A member or parameter that may be missing."""

    type: Type

    def __str__(self) -> str:
        return f"optional {self.type}"


Type: TypeAlias = Builtin | Named | Proxy | Sequence | Dictionary | Optional


@dataclass(frozen=True, slots=True)
class Member:
    """A member, a parameter or a result."""

    name: str
    type: Type

    def __str__(self) -> str:
        return f"{self.type} {self.name}"


@dataclass(slots=True)
class Record:
    """A struct, a class or an exception with its own members."""

    kind: str
    type_id: str
    base: str | None = None
    members: list[Member] = field(default_factory=list)


@dataclass(slots=True)
class Enumeration:
    """An enumeration: its values by name."""

    type_id: str
    values: dict[str, int] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class OperationSignature:
    """An operation; what it returns is the first result, by the name `returnValue`."""

    interface: str
    name: str
    parameters: tuple[Member, ...]
    results: tuple[Member, ...]
    throws: tuple[str, ...] = ()
    idempotent: bool = False
    streamed: bool = False

    def __str__(self) -> str:
        returned = next((str(each.type) for each in self.results if each.name == RETURN_VALUE), "void")
        outs = [f"out {each}" for each in self.results if each.name != RETURN_VALUE]
        return f"{returned} {self.name}({', '.join([*map(str, self.parameters), *outs])})"


@dataclass(slots=True)
class Definitions:
    """What one definition tells: types by type id, operations by name."""

    interfaces: dict[str, tuple[str, ...]] = field(default_factory=dict)
    """The interfaces that each one extends."""
    records: dict[str, Record] = field(default_factory=dict)
    enumerations: dict[str, Enumeration] = field(default_factory=dict)
    operations: dict[str, OperationSignature] = field(default_factory=dict)

    def lineage(self, type_id: str) -> list[Record]:
        """Return a record and those that it extends, the nearest first."""
        found: list[Record] = []
        next_id: str | None = type_id
        while next_id is not None:
            record = self.records.get(next_id)
            if record is None or record in found or len(found) >= _LONGEST_LINEAGE:
                raise MarshalException(f"the definition of {type_id} is malformed: it extends {next_id}")
            found.append(record)
            next_id = record.base
        return found

    def all_members(self, type_id: str) -> list[Member]:
        """Return the members of a record, those of its bases first."""
        return [member for record in reversed(self.lineage(type_id)) for member in record.members]


def unscoped(type_id: str) -> str:
    """Return the last part of a scoped name: `HeadPose` of `::nao::HeadPose`."""
    return type_id.rpartition("::")[2]
