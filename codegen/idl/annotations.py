"""Write types, and the values of constants and defaults, as they stand in a generated module."""

from __future__ import annotations

from . import ast
from .layout import string
from .names import ModuleNames, python_name
from .places import GeneratedModule, Places

_BUILTINS = {"bool": "bool", "string": "str", "float": "float", "double": "float"}
_RUNTIME_TYPES = {"byte": "Byte", "short": "Short", "int": "Int", "long": "Long"}


class Annotations:
    """Knows how types and values are written in one module, and imports what they need."""

    def __init__(self, names: ModuleNames, places: Places, module: GeneratedModule) -> None:
        self._names = names
        self._places = places
        self._module = module

    def type(self, kind: ast.Type, *, optional: bool = False, at_import: bool = False) -> str:
        """Return a type as it is written in an annotation, or where it is needed when the module is imported.

        What can be null in Slice, and what is `optional`, can be None.
        """
        nullable = True
        match kind:
            case ast.BuiltinType(name="Object" | "Value"):
                text = self._names.runtime("Value")
            case ast.BuiltinType(name=name):
                text = self._builtin(name)
                nullable = False
            case ast.ProxyType(target=ast.NamedType(definition=ast.Interface() as interface)):
                text = self.reference(interface, f"{python_name(interface)}Prx", at_import=at_import)
            case ast.ProxyType():
                text = self._names.runtime("ObjectPrx")
            case ast.NamedType(definition=ast.Class() as definition):
                text = self.reference(definition, at_import=at_import)
            case ast.NamedType(definition=ast.Interface() | ast.ForwardDeclaration()):
                text = self._names.runtime("Value")
            case ast.NamedType(definition=ast.Definition() as definition):
                text = self._alias_or_name(definition, at_import=at_import)
                nullable = False
            case _:
                raise AssertionError(f"the checker let pass {kind}")
        return f"{text} | None" if nullable or optional else text

    def alias(self, definition: ast.Sequence | ast.Dictionary) -> str:
        """Return the statement that names a list or a dictionary."""
        name = python_name(definition)
        if self._places.is_late(definition):  # a text, as the class that it is of comes later
            alias = self._names.imported("typing", "TypeAlias")
            return f"{name}: {alias} = {string(self._container(definition, at_import=False))}"
        return f"{name} = {self._container(definition, at_import=True)}"

    def reference(self, definition: ast.Definition, name: str | None = None, *, at_import: bool) -> str:
        """Return how a definition, or another name that goes with it, is written here."""
        name = name or python_name(definition)
        place = self._places.of(definition)
        if place is self._module:
            return self._names.defined(name)
        module = self._names.relative(place.package, place.name)
        if not at_import and self._places.need_each_other(place, self._module):
            return f"{self._names.imported_at_the_end(module)}.{name}"
        return self._names.imported(module, name)

    def value(self, literal: ast.Literal, kind: ast.Type) -> str:
        """Return the value of a constant or a default as an expression."""
        target, value = literal.target, literal.value
        if isinstance(target, ast.Constant):
            return self.reference(target, at_import=True)
        if isinstance(target, ast.Enumerator) and target.enumeration is not None:
            enumeration = self.reference(target.enumeration, at_import=True)
            return f"{enumeration}.{python_name(target)}"
        if isinstance(value, str):
            return string(value)
        if isinstance(kind, ast.BuiltinType) and _BUILTINS.get(kind.name) == "float":
            return repr(float(value or 0)).replace("e+", "e")
        return repr(value)

    def _builtin(self, name: str) -> str:
        if name in _BUILTINS:
            return self._names.builtin(_BUILTINS[name])
        return self._names.runtime(_RUNTIME_TYPES[name])

    def _alias_or_name(self, definition: ast.Definition, *, at_import: bool) -> str:
        if isinstance(definition, ast.Sequence | ast.Dictionary) and self._places.is_late(definition):
            return self._container(definition, at_import=at_import)
        return self.reference(definition, at_import=at_import)

    def _container(self, definition: ast.Sequence | ast.Dictionary, *, at_import: bool) -> str:
        match definition:
            case ast.Sequence(element=ast.BuiltinType(name="byte")):
                return self._names.builtin("bytes")
            case ast.Sequence():
                element = self.type(definition.element, at_import=at_import)
                return f"{self._names.builtin('list')}[{element}]"
            case ast.Dictionary():
                key = self.type(definition.key, at_import=at_import)
                value = self.type(definition.value, at_import=at_import)
                return f"{self._names.builtin('dict')}[{key}, {value}]"
