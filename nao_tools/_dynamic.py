"""Talk to any servant without generated code: its types are made at run time from the schema that it sends.

They equal the types that codegen would have written, so zenoh_ice checks and transports the same things as
for generated proxies: types, declared exceptions, streams.
"""

from __future__ import annotations

import keyword
from collections.abc import Iterable, Mapping
from enum import IntEnum
from typing import Any, Final, cast

import msgspec

from zenoh_ice import MarshalException, ObjectPrx, UserException
from zenoh_ice.data.interface import OBJECT_INTERFACE, RETURN_VALUE, Interface, Operation
from zenoh_ice.data.keys import Target
from zenoh_ice.data.reflection import Definition, Member, OperationDescription, Schema, unscoped
from zenoh_ice.data.text import printable
from zenoh_ice.data.values import Struct, StructType, Value
from zenoh_ice.generated import Byte, Int, Long, Short
from zenoh_ice.objects.proxy import StreamedCall

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


def _returning(kind: str, name: str, *parameters: Member) -> OperationDescription:
    results = (Member(RETURN_VALUE, kind),)
    return OperationDescription(name, parameters=parameters, results=results, idempotent=True)


# The operations that every servant has besides those of its interface.
_OF_EVERY_SERVANT: Final = (
    OperationDescription("ice_ping", idempotent=True),
    _returning("bool", "ice_isA", Member("id", "string")),
    _returning("string", "ice_id"),
    _returning("sequence<string>", "ice_ids"),
    _returning("string", "ice_describe"),
)


class _DeclaredException(UserException):
    """An exception that an interface declares, with its members as attributes."""

    def __str__(self) -> str:
        text = super().__str__()
        name = self.ice_type_id.removeprefix("::")
        return f"{name}: {text}" if text else name


class Types:
    """The Python types of a schema that was checked, each made when it is first needed."""

    def __init__(self, schema: Schema) -> None:
        self._schema: Final = schema
        self._made: dict[str, Any] = {}

    def of(self, name: str, *, optional: bool = False) -> Any:  # noqa: ANN401 - a type in annotations
        """Return the Python type of a name in the schema."""
        if name in _BUILTIN_TYPES:
            kind = _BUILTIN_TYPES[name]
        elif name.endswith("*"):
            kind = ObjectPrx | None
        else:
            kind = self._defined(name, self._schema.definitions[name])
        return kind | None if optional else kind

    def operation(self, description: OperationDescription) -> Operation[..., Any]:
        """Return a function that calls an operation; raises MarshalException for unusable types."""
        name = description.name
        try:
            return Operation(
                name,
                arguments=self._struct(f"{name}_Arguments", description.parameters),
                result=self._struct(f"{name}_Result", description.results),
                throws=tuple(self._exception(type_id) for type_id in description.exceptions),
                streamed=description.streamed,
                idempotent=description.idempotent,
            )
        except (TypeError, ValueError, RuntimeError) as error:
            raise MarshalException(f"the types of {name} cannot be made: {printable(str(error))}") from error

    def class_of(self, type_id: str) -> type[Value]:
        """Return a class by its type id; raises KeyError when the schema has none of this id."""
        if self._schema.kind(type_id) != "class":
            raise KeyError(type_id)
        known: type[Value] | None = self._made.get(type_id)
        if known is not None:
            return known
        definition = self._schema.definitions[type_id]
        base = self.class_of(definition.bases[0]) if definition.bases else Value
        names = {_python(member.name): member.name for member in definition.members}
        # Classes refer to each other: members get their types when the class exists.
        made: Any = StructType(
            _python(type_id),
            (base,),
            {"__annotations__": dict.fromkeys(names, object), "__module__": __name__},
            tag=type_id,
            rename=names,
        )
        self._made[type_id] = made
        for member in definition.members:
            made.__annotations__[_python(member.name)] = self.of(member.type, optional=member.optional)
        return made  # type: ignore[no-any-return]

    def _defined(self, type_id: str, definition: Definition) -> Any:  # noqa: ANN401 - as above
        match definition.kind:
            case "interface":  # by value: any class
                return Value | None
            case "class":
                return self.class_of(type_id) | None
            case "sequence" if definition.element == "byte":
                return bytes
            case "sequence":
                return list[self.of(definition.element)]  # type: ignore[misc]
            case "dictionary":
                return dict[self.of(definition.key), self.of(definition.value)]  # type: ignore[misc]
        if type_id not in self._made:
            # Through a list: names such as `mro` are refused with a ValueError.
            self._made[type_id] = (
                IntEnum(_python(type_id), [(each.name, each.value) for each in definition.enumerators])
                if definition.kind == "enumeration"
                else self._struct(_python(type_id), definition.members)
            )
        return self._made[type_id]

    def _struct(
        self, name: str, members: Iterable[Member], base: type[msgspec.Struct] = Struct
    ) -> type[msgspec.Struct]:
        named = {_python(member.name): member for member in members}
        types = {known: self.of(member.type, optional=member.optional) for known, member in named.items()}
        namespace: dict[str, Any] = {"__annotations__": types, "__module__": __name__}
        namespace |= {known: None for known, member in named.items() if member.optional}
        rename = {known: member.name for known, member in named.items()}
        return cast("type[msgspec.Struct]", StructType(name, (base,), namespace, rename=rename, kw_only=True))

    def _exception(self, type_id: str) -> type[UserException]:
        if type_id not in self._made:
            definition = self._schema.definitions[type_id]
            base = self._exception(definition.bases[0]) if definition.bases else _DeclaredException
            members = self._struct("Members", definition.members, base.Members)
            self._made[type_id] = type(
                _python(type_id), (base,), {"ice_type_id": type_id, "Members": members}
            )
        made: type[UserException] = self._made[type_id]
        return made


class DynamicProxy:
    """A proxy of any servant, of the interface that the servant describes."""

    def __init__(self, proxy: ObjectPrx) -> None:
        """Ask the servant for its interface.

        Raises the exceptions of a call, and MarshalException when the answer does not describe an interface,
        as that of a server of another version may not.
        """
        self.identity: Final = proxy.ice_getIdentity()
        self.schema: Final = _description_of(proxy)
        self.type_id: Final = self.schema.interface
        self.fingerprint: Final = printable(self.schema.definitions[self.type_id].fingerprint)
        self.types: Final = Types(self.schema)
        self.interface_operations: Final = {each.name: each for _, each in self.schema.operations()}
        """The operations of its interface and of the bases of that, by name."""
        self.operations: Final = {each.name: each for each in _OF_EVERY_SERVANT}
        self.operations.update(self.interface_operations)
        self._made = {
            name: made
            for name, made in OBJECT_INTERFACE.all_operations.items()
            if name not in self.interface_operations
        }
        interface = Interface(self.type_id, fingerprint=self.fingerprint)
        typed: type[ObjectPrx] = type("DynamicPrx", (ObjectPrx,), {"ice_interface": interface})
        self.proxy: Final[ObjectPrx] = typed.uncheckedCast(proxy)

    def operation(self, name: str) -> Operation[..., Any]:
        """Return an operation; raises KeyError when the servant has none of this name."""
        made = self._made.get(name)
        if made is None:
            made = self._made[name] = self.types.operation(self.operations[name])
        return made

    def signature(self, name: str) -> str:
        """Return the signature of an operation in Slice: `HeadPose setPose(double pan, double tilt)`."""
        operation = self.operations[name]
        results = {each.name: self.type_text(each) for each in operation.results}
        returned = results.pop(RETURN_VALUE, "void")
        parameters = [f"{self.type_text(each)} {each.name}" for each in operation.parameters]
        outs = [f"out {kind} {each}" for each, kind in results.items()]
        return f"{returned} {name}({', '.join([*parameters, *outs])})"

    def type_text(self, member: Member) -> str:
        """Return the type of a member, a parameter or a result as it is shown."""
        return self.schema.type_text(member.type, optional=member.optional, scoped=False)

    def invoke(self, name: str, arguments: Iterable[object]) -> Any:  # noqa: ANN401 - of the interface's types
        """Call an operation and return all its results, by name."""
        return self.results(name, self.proxy.ice_invoke(self.operation(name), *arguments))

    def stream(self, name: str) -> StreamedCall[..., Any]:
        """Return the stream of an operation."""
        return StreamedCall(self.proxy, self.operation(name))

    def is_there(self) -> bool:
        """Return whether the servant is online, as far as known."""
        return self.proxy.ice_getCommunicator().knows(target_of(self.proxy))

    def results(self, name: str, returned: object) -> dict[str, object]:
        """Return the results of a call by name."""
        names = [result.name for result in self.operations[name].results]
        if len(names) == 1:
            return {names[0]: returned}
        values = returned if isinstance(returned, tuple) else ()
        return dict(zip(names, values, strict=True))


def _description_of(proxy: ObjectPrx) -> Schema:
    try:
        return proxy.ice_describe()
    except MarshalException as error:
        communicator, target = proxy.ice_getCommunicator(), target_of(proxy)
        other = communicator.presence.other_version(target, communicator.settings.timeout)
        if not other:
            raise
        raise MarshalException(f"{target.identity} describes itself otherwise: {other}") from error


def target_of(proxy: ObjectPrx) -> Target:
    """Return the target of a proxy."""
    return Target(proxy.ice_getRealm(), proxy.ice_getIdentity())


def _python(name: str) -> str:
    """Return a name that Python accepts for a type or a member."""
    name = unscoped(name)
    return f"{name}_" if keyword.iskeyword(name) else name
