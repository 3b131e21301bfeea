"""Interfaces and their operations, as generated code describes them, and the roots of what they carry."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass
from functools import cached_property
from typing import Any, Final, Generic, ParamSpec, TypeVar

import msgspec

from ._codec import Codec
from ._values import TYPE_FIELD, Struct, Value, type_ids_of
from .exceptions import UserException

__all__ = ["OBJECT_TYPE_ID", "TYPE_FIELD", "Interface", "Operation", "Struct", "Value", "type_ids_of"]

OBJECT_TYPE_ID: Final = "::Ice::Object"
"""The type id that every servant answers to."""

P = ParamSpec("P")
V = TypeVar("V")


class Operation(Generic[P, V]):
    """An operation of an interface: `P` are its in-parameters in Python, `V` is what its proxy returns.

    `method` is its name in Python where that is another one: `_from` for `from`. `amd` lets the
    servant's method return a future, or be a coroutine. With `stop` it stops what the interface commands.
    """

    def __init__(
        self,
        name: str,
        *,
        arguments: type[msgspec.Struct],
        result: type[msgspec.Struct],
        exceptions: tuple[type[UserException], ...] = (),
        method: str | None = None,
        idempotent: bool = False,
        streamed: bool = False,
        stop: bool = False,
        amd: bool = False,
    ) -> None:
        self.name: Final = name
        self.method: Final = method or name
        self.arguments: Final = Codec(arguments)
        self.result: Final = Codec(result)
        self.exceptions: Final = exceptions
        self.idempotent: Final = idempotent
        self.streamed: Final = streamed
        self.stop: Final = stop
        self.amd: Final = amd
        self.interface: Interface | None = None
        """The interface that declares it, once there is one."""

    @property
    def oneway(self) -> bool:
        """Whether it may be called one way: it returns nothing and declares no exceptions."""
        return not self.result.fields and not self.exceptions


@dataclass(eq=False, repr=False)
class Interface:
    """An interface: its type id, its own operations, and the interfaces that it extends.

    `fingerprint` is the beginning of the digest of its canonical form, in which codegen writes it and every
    type that it uses. `module` is the generated module; beside it lies the schema that describes them.
    """

    type_id: str
    _: KW_ONLY
    bases: tuple[Interface, ...] = ()
    operations: tuple[Operation[..., Any], ...] = ()
    fingerprint: str = ""
    module: str = ""

    def __post_init__(self) -> None:
        for operation in self.operations:
            operation.interface = self

    @cached_property
    def lineage(self) -> tuple[Interface, ...]:
        """The interface and every one that it extends, itself first, each once."""
        return tuple(dict.fromkeys((self, *(each for base in self.bases for each in base.lineage))))

    @cached_property
    def type_ids(self) -> tuple[str, ...]:
        """The type ids that a servant of the interface answers to, sorted as Ice does."""
        return tuple(sorted({OBJECT_TYPE_ID, *(interface.type_id for interface in self.lineage)}))

    @cached_property
    def all_operations(self) -> dict[str, Operation[..., Any]]:
        """The operations by name, inherited ones included."""
        return {each.name: each for known in reversed(self.lineage) for each in known.operations}

    @cached_property
    def stop_operations(self) -> tuple[Operation[..., Any], ...]:
        """The operations that stop what the interface commands, its own and that of every base: call all."""
        return tuple(operation for operation in self.all_operations.values() if operation.stop)
