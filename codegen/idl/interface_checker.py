"""The rules for interfaces and their operations."""

from __future__ import annotations

from codegen.diagnostics import Note

from . import ast
from .codes import Code
from .lexer import Token
from .name_rules import NameRules
from .resolver import Resolver


class InterfaceChecker:
    """Resolves the names in interfaces and reports operations that break a rule."""

    def __init__(self, resolver: Resolver, names: NameRules) -> None:
        self._resolver = resolver
        self._names = names

    def check(self, interface: ast.Interface, scope: str) -> None:
        """Check an interface that stands in `scope`."""
        direct: dict[str, ast.NamedType] = {}
        for named in interface.bases:
            base = self._resolver.base(named, interface, scope)
            if base is not None:
                direct.setdefault(base.scoped, named)
        interface.bases = list(direct.values())
        inherited = self._inherited_operations(interface)
        self._names.unique(interface.operations, interface.scoped, inherited)
        used: dict[str, Token] = {}
        for operation in interface.operations:
            self._operation_name(operation, interface)
            self._types(operation, interface.scoped)
            self._unchanged_meaning(operation, interface, used)
            self._parameters(operation)
            self._throws(operation, interface.scoped)
        self._generated_names(interface, inherited)

    def _inherited_operations(self, interface: ast.Interface) -> dict[str, ast.Operation]:
        inherited: dict[str, ast.Operation] = {}
        for base in interface.ancestors():
            for operation in base.operations:
                other = inherited.setdefault(operation.name.lower(), operation)
                if other.scoped != operation.scoped:
                    notes = [Note("one is here", other.token.location)]
                    notes.append(Note("the other is here", operation.token.location))
                    message = f"`{interface.name}` inherits `{operation.name}` from two unrelated interfaces"
                    self._resolver.error(Code.AMBIGUOUS_OPERATION, message, interface.token, *notes)
        return inherited

    def _operation_name(self, operation: ast.Operation, interface: ast.Interface) -> None:
        if operation.name.startswith("ice_"):
            message = f"operation `{operation.name}`: names with `ice_` belong to what every object offers"
            self._resolver.error(Code.RESERVED_NAME, message, operation.token)
        if operation.name.lower() == interface.name.lower():
            message = f"operation `{operation.name}` has the name of its interface"
            self._resolver.error(Code.REDEFINITION, message, operation.token)

    def _types(self, operation: ast.Operation, scope: str) -> None:
        if operation.returns is not None:
            self._resolver.data_type(operation.returns, scope)
        for parameter in operation.parameters:
            self._resolver.data_type(parameter.type, scope)
        if operation.streamed and operation.returns is None and not operation.outputs:
            message = f"operation `{operation.name}` is streamed but returns nothing"
            self._resolver.error(Code.BAD_STREAM, message, operation.token)

    def _unchanged_meaning(
        self, operation: ast.Operation, interface: ast.Interface, used: dict[str, Token]
    ) -> None:
        """Report an operation with the name of a type; `used` are those that the interface used so far."""
        for kind in (operation.returns, *(parameter.type for parameter in operation.parameters)):
            if kind is not None:
                used.setdefault(_first_name(kind).lower(), kind.token)
        meaning = used.get(operation.name.lower())
        if meaning is not None:
            note = Note(f"`{meaning.text}` is used here with its former meaning", meaning.location)
            message = f"`{operation.name}` changes its meaning in `{interface.name}`"
            self._resolver.error(Code.CHANGED_MEANING, message, operation.token, note)

    def _parameters(self, operation: ast.Operation) -> None:
        self._names.unique(operation.parameters, operation.scoped)
        out: ast.Parameter | None = None
        for parameter in operation.parameters:
            if parameter.out:
                out = out or parameter
            elif out is not None:
                note = Note("the out parameter is here", out.token.location)
                message = f"in parameter `{parameter.name}` stands behind an out parameter"
                self._resolver.error(Code.OUT_BEFORE_IN, message, parameter.token, note)
            if parameter.out and parameter.name == "returnValue" and operation.returns is not None:
                message = "`returnValue` is how the wire calls what an operation returns"
                self._resolver.error(Code.RESERVED_NAME, message, parameter.token)

    def _throws(self, operation: ast.Operation, scope: str) -> None:
        thrown: set[str] = set()
        for named in operation.throws:
            exception = self._resolver.definition_of(ast.ExceptionType, named, scope, Code.BAD_THROWS)
            if exception is None:
                continue
            if exception.scoped in thrown:
                self._resolver.error(Code.BAD_THROWS, f"`{named.name}` stands in `throws` twice", named.token)
            thrown.add(exception.scoped)

    def _generated_names(self, interface: ast.Interface, inherited: dict[str, ast.Operation]) -> None:
        """Report an operation with the name of a method that another operation brings with it."""
        operations = {operation.name: operation for operation in (*inherited.values(), *interface.operations)}
        for operation in operations.values():
            for suffix in ("Async", "Publisher") if operation.streamed else ("Async",):
                other = operations.get(operation.name + suffix)
                if other is None or not {operation, other} & set(interface.operations):
                    continue
                note = Note(f"`{operation.name}` brings `{other.name}` with it", operation.token.location)
                message = f"operation `{other.name}` has the name of a generated method"
                self._resolver.error(Code.NAME_CLASH_IN_OUTPUT, message, other.token, note)


def _first_name(kind: ast.Type) -> str:
    """Return the name by which a type is looked up, nothing for a builtin."""
    if isinstance(kind, ast.ProxyType):
        return _first_name(kind.target)
    return kind.name.partition("::")[0] if isinstance(kind, ast.NamedType) else ""
