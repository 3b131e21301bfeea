"""Make an example of a value of any type, as it is before it is encoded."""

from __future__ import annotations

from . import ast
from .wire_shape import TYPE_FIELD, Part, fields_of, is_bytes, type_ids

__all__ = ["ExampleTooLargeError", "Wire", "example_of"]

Wire = bool | int | float | str | bytes | None | list["Wire"] | dict["Wire", "Wire"]

_MOST_VALUES = 2000
_BUILTINS: dict[str, Wire] = {
    "bool": True,
    "byte": 1,
    "short": 2,
    "int": 3,
    "long": 4,
    "float": 0.5,
    "double": 0.25,
    "string": "text",
    "Object": None,
    "Value": None,
    "LocalObject": None,
}


class ExampleTooLargeError(Exception):
    """The type is made of more values than anyone wants to read."""


def example_of(definition: ast.Definition, part: Part = Part.RESULT) -> Wire:
    """Return a value of a type, or the arguments or results of an operation.

    Sequences and dictionaries have one element, classes in themselves are null. Raises ExampleTooLargeError.
    """
    return _Example().of(definition, part)


class _Example:
    def __init__(self) -> None:
        self._open: set[str] = set()
        self._values = 0

    def of(self, definition: ast.Definition, part: Part = Part.RESULT) -> Wire:
        self._values += 1
        if self._values > _MOST_VALUES:
            raise ExampleTooLargeError
        match definition:
            case ast.Enumeration():
                return definition.enumerators[0].value if definition.enumerators else 0
            case ast.Sequence() if is_bytes(definition):
                return b"\x01\x02\x03"
            case ast.Sequence():
                return [self._type(definition.element)]
            case ast.Dictionary():
                key = self._type(definition.key)
                return {str(key) if isinstance(key, dict | list) else key: self._type(definition.value)}
            case ast.Class() if definition.scoped in self._open:
                return None
        fields = fields_of(definition, part)
        if fields is None:
            return None
        self._open.add(definition.scoped)
        value: dict[Wire, Wire] = {}
        if isinstance(definition, ast.Class):
            value[TYPE_FIELD] = type_ids(definition)
        value.update((field.name, self._type(field.type)) for field in fields)
        self._open.discard(definition.scoped)
        if isinstance(definition, ast.ExceptionType):
            bases: list[Wire] = [base.scoped for base in definition.ancestors()]
            return {"exception": definition.scoped, **({"bases": bases} if bases else {}), "members": value}
        return value

    def _type(self, kind: ast.Type) -> Wire:
        self._values += 1
        match kind:
            case ast.BuiltinType(name=name):
                return _BUILTINS[name]
            case ast.ProxyType():
                return "Identity"
            case ast.NamedType(definition=ast.Definition() as definition):
                return self.of(definition)
        return None
