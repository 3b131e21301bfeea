"""Interfaces and their operations; their structs are derived from annotations when first needed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import KW_ONLY, dataclass
from functools import cached_property
from typing import (
    Any,
    Concatenate,
    Final,
    Generic,
    ParamSpec,
    TypedDict,
    TypeVar,
    Unpack,
    get_args,
    get_type_hints,
)

import msgspec

from zenoh_ice.data.codec import Codec
from zenoh_ice.data.exceptions import UserException
from zenoh_ice.data.values import slice_name

OBJECT_TYPE_ID: Final = "::Ice::Object"
"""The type id that every servant answers to."""

RETURN_VALUE: Final = "returnValue"
"""The name of the return value, among the results of an operation."""

P = ParamSpec("P")
V = TypeVar("V")


class OperationOptions(TypedDict, total=False):
    """Properties of an operation besides its signature."""

    throws: tuple[type[UserException], ...]
    results: tuple[str, ...]
    """Names of its results, out-parameters included; by default its return value alone."""
    optional: tuple[str, ...]
    """Names of parameters and results that may be absent."""
    idempotent: bool
    stop: bool
    """Whether it stops what the interface commands."""


class Operation(Generic[P, V]):
    """An operation of an interface: `P` are its in-parameters in Python, `V` is what its proxy returns."""

    def __init__(
        self,
        declared: str | Callable[Concatenate[Any, P], V],
        *,
        arguments: type[msgspec.Struct] | None = None,
        result: type[msgspec.Struct] | None = None,
        streamed: bool = False,
        **options: Unpack[OperationOptions],
    ) -> None:
        """Make an operation from an annotated method, or a name and the structs of arguments and result."""
        self.method: Final = declared if isinstance(declared, str) else declared.__name__
        """Its name in Python: `_from` for `from`."""
        self.name: Final = slice_name(self.method)
        self.exceptions: Final = options.get("throws", ())
        self.idempotent: Final = options.get("idempotent", False)
        self.stop: Final = options.get("stop", False)
        self.streamed: Final = streamed
        """Whether its results are also published as a stream."""
        self.interface: Interface | None = None
        """The interface that declares it, once there is one."""
        self.__doc__, self.__name__ = declared.__doc__, self.method
        self._declared: Final = declared
        self._results: Final = options.get("results", (RETURN_VALUE,))
        self._optional: Final = options.get("optional", ())
        if arguments is not None and result is not None:
            self.arguments, self.result = Codec(arguments), Codec(result)

    @cached_property
    def arguments(self) -> Codec[Any]:
        """The codec of its arguments."""
        return self._codec(
            "Arguments", {name: each for name, each in self._types.items() if name != "return"}
        )

    @cached_property
    def result(self) -> Codec[Any]:
        """The codec of its results."""
        returned = self._types["return"]
        kinds: tuple[Any, ...] = (returned,)
        if len(self._results) > 1:
            kinds = get_args(returned)
        elif returned is type(None):
            kinds = ()
        return self._codec("Result", dict(zip(self._results, kinds, strict=False)))

    @cached_property
    def _types(self) -> dict[str, Any]:
        return get_type_hints(self._declared, include_extras=True)

    def _codec(self, role: str, members: dict[str, Any]) -> Codec[Any]:
        optional = [name in self._optional for name in members]
        struct = msgspec.defstruct(
            f"{self.name}_{role}",
            [
                (name, kind, None) if name in self._optional else (name, kind)
                for name, kind in members.items()
            ],
            rename=slice_name,
            module=self._declared.__module__,
            kw_only=optional != sorted(optional),  # a required one follows an optional one
        )
        return Codec(struct)


@dataclass(eq=False, repr=False)
class Interface:
    """An interface: its type id, its own operations, and the interfaces that it extends.

    `fingerprint` is the beginning of the digest of the canonical form in which codegen writes the interface
    and every type that it uses. `module` is the generated module; the schema is the file next to it.
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
        """The stop operations, its own and those of every base: call all to stop what it commands."""
        return tuple(operation for operation in self.all_operations.values() if operation.stop)


def _of_every_servant(name: str, arguments: dict[str, type], result: Any) -> Operation[..., Any]:  # noqa: ANN401
    """Return an operation that every servant answers."""
    returned = [] if result is None else [("returnValue", result)]
    return Operation(
        name,
        arguments=msgspec.defstruct("Arguments", list(arguments.items())),
        result=msgspec.defstruct("Result", returned),
        idempotent=True,
    )


ICE_PING: Final[Operation[[], None]] = _of_every_servant("ice_ping", {}, None)
ICE_IS_A: Final[Operation[[str], bool]] = _of_every_servant("ice_isA", {"id": str}, bool)
ICE_ID: Final[Operation[[], str]] = _of_every_servant("ice_id", {}, str)
ICE_IDS: Final[Operation[[], list[str]]] = _of_every_servant("ice_ids", {}, list[str])
ICE_DESCRIBE: Final[Operation[[], str]] = _of_every_servant("ice_describe", {}, str)

OBJECT_INTERFACE: Final = Interface(
    OBJECT_TYPE_ID, operations=(ICE_PING, ICE_IS_A, ICE_ID, ICE_IDS, ICE_DESCRIBE)
)
