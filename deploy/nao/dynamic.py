"""Talk to any servant without generated code: an interface made at run time from what the servant tells.

What is made is what codegen would have written, so that everything that zenoh_ice checks and carries for
generated proxies holds here, too: types, declared exceptions, streams.
"""

from __future__ import annotations

import keyword
from collections.abc import Iterable, Mapping
from enum import IntEnum
from typing import Any, Final

import msgspec

from deploy.nao.definition_parser import parse_definition
from deploy.nao.definitions import (
    Builtin,
    Definitions,
    Dictionary,
    Member,
    Named,
    OperationSignature,
    Optional,
    Proxy,
    Record,
    Sequence,
    Type,
)
from zenoh_ice import MarshalException, ObjectPrx, UserException
from zenoh_ice.generated import Byte, Int, Interface, Long, Operation, Short, Struct
from zenoh_ice.identity import Target
from zenoh_ice.operation import OBJECT_TYPE_ID
from zenoh_ice.streams.stream import StreamedCall
from zenoh_ice.wire.text import printable
from zenoh_ice.wire.values import Value

__all__ = ["DynamicProxy", "Types"]

_OBJECT_DEFINITION: Final = """\
::Ice::InterfaceDescription::definition: string
::Ice::InterfaceDescription::fingerprint: string
::Ice::InterfaceDescription::typeId: string
::Ice::Object::ice_describe(): sequence<::Ice::InterfaceDescription> idempotent
::Ice::Object::ice_id(): string idempotent
::Ice::Object::ice_ids(): sequence<string> idempotent
::Ice::Object::ice_isA(string id): bool idempotent
::Ice::Object::ice_ping(): void idempotent
interface ::Ice::Object
struct ::Ice::InterfaceDescription
"""
"""What every servant has."""

_BUILTIN_TYPES: Final[Mapping[str, Any]] = {
    "bool": bool,
    "byte": Byte,
    "short": Short,
    "int": Int,
    "long": Long,
    "float": float,
    "double": float,
    "string": str,
    "Object": Value | None,
    "Value": Value | None,
}


class _DeclaredException(UserException):
    """An exception that an interface declares, with its members as attributes."""

    def __init__(self, /, **members: object) -> None:  # of any name, `self` and `args` included
        super().__init__(*members.values())
        self.__dict__.update(members)

    def __str__(self) -> str:
        text = super().__str__()
        name = self.ice_type_id.removeprefix("::")
        return f"{name}: {text}" if text else name


class Types:
    """The Python types of one definition, each made when it is first needed."""

    def __init__(self, definitions: Definitions) -> None:
        self._definitions: Final = definitions
        self._made: dict[str, Any] = {}
        self._being_made: set[str] = set()
        self._exceptions: dict[str, type[UserException]] = {}

    def of(self, kind: Type) -> Any:  # noqa: ANN401 - what stands for a type in annotations
        """Return the Python type; raises MarshalException for one that the definition does not tell."""
        match kind:
            case Builtin(name):
                return _BUILTIN_TYPES[name]
            case Proxy():
                return ObjectPrx | None
            case Optional(inner):
                return self.of(inner) | None
            case Sequence(Builtin("byte")):
                return bytes
            case Sequence(element):
                return list[self.of(element)]  # type: ignore[misc]
            case Dictionary(key, value):
                return dict[self.of(key), self.of(value)]  # type: ignore[misc]
            case Named(type_id):
                return self._named(type_id)

    def operation(self, signature: OperationSignature) -> Operation[..., Any]:
        """Return what calls an operation; raises MarshalException when no types can be made of its own."""
        try:
            return Operation(
                signature.name,
                arguments=self._struct(f"{signature.name}_Arguments", signature.parameters),
                result=self._struct(f"{signature.name}_Result", signature.results),
                exceptions=tuple(self._exception(type_id) for type_id in signature.throws),
                idempotent=signature.idempotent,
                streamed=signature.streamed,
            )
        except (TypeError, ValueError, RuntimeError) as error:
            raise MarshalException(
                f"the types of {signature.name} cannot be made: {printable(str(error))}"
            ) from error

    def class_of(self, type_id: str) -> type[Value]:
        """Return a class by its type id; raises KeyError when the definition has none of this id."""
        if self._definitions.records[type_id].kind != "class":
            raise KeyError(type_id)
        self._named(type_id)
        made: type[Value] = self._made[type_id]
        return made

    def _named(self, type_id: str) -> Any:  # noqa: ANN401 - as above
        if type_id in self._definitions.interfaces:  # an interface by value: any class
            return Value | None
        if (known := self._made.get(type_id)) is not None:
            return known | None if issubclass(known, Value) else known
        if (enumeration := self._definitions.enumerations.get(type_id)) is not None:
            # By way of a list: names such as `mro` are refused with a ValueError.
            self._made[type_id] = made = IntEnum(_python(type_id), list(enumeration.values.items()))
            return made
        record = self._definitions.records.get(type_id)
        if record is None or record.kind == "exception" or type_id in self._being_made:
            raise MarshalException(f"the definition of the interface does not tell what {type_id} is")
        if record.kind == "class":
            return self._class(record) | None
        self._being_made.add(type_id)
        struct = self._made[type_id] = self._struct(_python(type_id), record.members)
        return struct

    def _class(self, record: Record) -> Any:  # noqa: ANN401 - as above
        # Asked for first: it refuses a class that extends itself.
        ids = [each.type_id for each in self._definitions.lineage(record.type_id)]
        base = Value
        if record.base is not None:
            self._named(record.base)
            base = self._made[record.base]
        # Classes refer to each other: the types of the members come when the class is there.
        names = [(_python(member.name), object) for member in record.members]
        rename = {_python(member.name): member.name for member in record.members}
        made = msgspec.defstruct(
            _python(record.type_id), names, bases=(base,), tag=" ".join(ids), rename=rename, module=__name__
        )
        self._made[record.type_id] = made
        for member in record.members:
            made.__annotations__[_python(member.name)] = self.of(member.type)
        return made

    def _struct(
        self,
        name: str,
        members: Iterable[Member],
        base: type[msgspec.Struct] = Struct,
    ) -> type[msgspec.Struct]:
        fields: list[tuple[str, Any] | tuple[str, Any, Any]] = []
        for member in members:
            entry = (_python(member.name), self.of(member.type))
            fields.append((*entry, None) if isinstance(member.type, Optional) else entry)
        rename = {_python(member.name): member.name for member in members}
        return msgspec.defstruct(name, fields, bases=(base,), rename=rename, kw_only=True, module=__name__)

    def _exception(self, type_id: str) -> type[UserException]:
        made = self._exceptions.get(type_id)
        if made is None:
            record, *bases = self._definitions.lineage(type_id)
            base = self._exception(bases[0].type_id) if bases else _DeclaredException
            members = self._struct("Members", record.members, base.Members)
            made = type(_python(type_id), (base,), {"ice_type_id": type_id, "Members": members})
            self._exceptions[type_id] = made
        return made


class DynamicProxy:
    """A proxy of any servant, of the interface that the servant tells of itself."""

    def __init__(self, proxy: ObjectPrx, facet: str = "") -> None:
        """Ask the servant, of which the proxy means this facet, what it is.

        Raises what a call raises, and MarshalException when what it tells is no interface.
        """
        descriptions = proxy.ice_describe()
        own = descriptions[0] if descriptions else None
        self.type_id: Final = printable(own.typeId) if own else OBJECT_TYPE_ID
        self.fingerprint: Final = printable(own.fingerprint) if own else ""
        self.definitions: Final = parse_definition(own.definition if own else "")
        self.interface_operations: Final = dict(self.definitions.operations)
        of_every_servant = parse_definition(_OBJECT_DEFINITION)
        for name, signature in of_every_servant.operations.items():
            self.definitions.operations.setdefault(name, signature)
        self.definitions.records.update(of_every_servant.records)
        self.types: Final = Types(self.definitions)
        self._operations: dict[str, Operation[..., Any]] = {}
        interface = Interface(self.type_id, fingerprint=self.fingerprint)
        typed: type[ObjectPrx] = type("DynamicPrx", (ObjectPrx,), {"ice_interface": interface})
        self._facet: Final = facet
        self.proxy: Final[ObjectPrx] = typed.uncheckedCast(proxy)

    def operation(self, name: str) -> Operation[..., Any]:
        """Return an operation; raises KeyError when the servant has none of this name."""
        made = self._operations.get(name)
        if made is None:
            made = self._operations[name] = self.types.operation(self.definitions.operations[name])
        return made

    def invoke(self, name: str, arguments: Iterable[object]) -> Any:  # noqa: ANN401 - of the interface's types
        """Call an operation and return all its results, by name."""
        operation = self.operation(name)
        return self.results(name, self.proxy.ice_invoke(operation, *arguments))

    def stream(self, name: str) -> StreamedCall[..., Any]:
        """Return the stream of an operation."""
        operation = self.operation(name)
        return StreamedCall(
            self.proxy, lambda proxy, *arguments: proxy.ice_invoke(operation, *arguments), operation
        )

    def is_there(self) -> bool:
        """Return whether the servant is there, as far as known."""
        target = Target(self.proxy.ice_getRealm(), self.proxy.ice_getIdentity(), self._facet)
        return self.proxy.ice_getCommunicator().knows(target)

    def results(self, name: str, returned: object) -> dict[str, object]:
        """Return what a call returned by the names of the results."""
        names = [result.name for result in self.definitions.operations[name].results]
        if len(names) == 1:
            return {names[0]: returned}
        values = returned if isinstance(returned, tuple) else ()
        return dict(zip(names, values, strict=True))


def _python(name: str) -> str:
    """Return a name that Python takes for a type or a member."""
    name = name.rpartition("::")[2]
    return f"{name}_" if keyword.iskeyword(name) else name
