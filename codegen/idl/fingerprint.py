"""Write interfaces and types in canonical form and take their fingerprints.

Two have the same form exactly when they are the same on the wire: comments, files, the order of definitions
and of members, the names of sequences and dictionaries, default values, the numbers of optional members and
those of classes do not count.
"""

from __future__ import annotations

import hashlib

from . import ast

FINGERPRINT_DIGITS = 16


def fingerprint(definition: str) -> str:
    """Return the first hexadecimal digits of the SHA-256 of a canonical definition."""
    return hashlib.sha256(definition.encode()).hexdigest()[:FINGERPRINT_DIGITS]


def canonical_definition(definition: ast.Definition) -> str:
    """Return an interface or a type, what it extends and every type that they use, one member a line, sorted.

    Each line stands for itself, so that two definitions can be compared line by line.
    """
    form = _CanonicalForm()
    form.add(definition)
    form.describe_all()
    return "\n".join(sorted(form.lines)) + "\n"


def canonical_type(kind: ast.Type) -> str:
    """Return a type as it stands in canonical forms: sequences and dictionaries by what they are made of."""
    return _CanonicalForm().type(kind)


class _CanonicalForm:
    def __init__(self) -> None:
        self.lines: list[str] = []
        self._seen: set[str] = set()
        self._waiting: list[ast.Definition] = []

    def add(self, definition: ast.Definition | None) -> None:
        """Remember a definition that is used, once."""
        if definition is not None and definition.scoped not in self._seen:
            self._seen.add(definition.scoped)
            self._waiting.append(definition)

    def describe_all(self) -> None:
        """Write the lines of every definition remembered and of those that turn up meanwhile."""
        while self._waiting:
            self._describe(self._waiting.pop())

    def _describe(self, definition: ast.Definition) -> None:
        name = definition.scoped
        match definition:
            case ast.Interface():
                bases = sorted(base.scoped for base in definition.base_definitions)
                self.lines.append(f"interface {name}{_extends(bases)}")
                self.lines += [self._operation(operation) for operation in definition.operations]
                for base in definition.base_definitions:
                    self.add(base)
            case ast.Struct():
                self.lines.append(f"struct {name}")
                self.lines += [self._member(member) for member in definition.members]
            case ast.Class() | ast.ExceptionType():
                parent = definition.base_definition
                self.lines.append(f"{definition.kind} {name}{_extends([parent.scoped] if parent else [])}")
                self.lines += [self._member(member) for member in definition.members]
                self.add(parent)
            case ast.Enumeration():
                self.lines.append(f"enum {name}")
                self.lines += [f"{each.scoped} = {each.value}" for each in definition.enumerators]
            case ast.Sequence():
                self.lines.append(f"sequence<{self.type(definition.element)}>")
            case ast.Dictionary():
                self.lines.append(f"dictionary<{self.type(definition.key)}, {self.type(definition.value)}>")
            case ast.Constant():
                self.lines.append(
                    f"const {name}: {self.type(definition.type)} = {definition.literal.value!r}"
                )

    def _member(self, member: ast.Member) -> str:
        return f"{member.scoped}: {self.type(member.type, member.tag)}"

    def _operation(self, operation: ast.Operation) -> str:
        inputs = ", ".join(f"{self.type(each.type, each.tag)} {each.name}" for each in operation.inputs)
        results = [f"{self.type(each.type, each.tag)} {each.name}" for each in operation.outputs]
        if operation.returns is not None:
            results.insert(0, self.type(operation.returns, operation.return_tag))
        line = f"{operation.scoped}({inputs}): {', '.join(results) or 'void'}"
        thrown = [named.definition for named in operation.throws if named.definition]
        if thrown:
            line += " throws " + ", ".join(sorted(exception.scoped for exception in thrown))
        for exception in thrown:
            self.add(exception)
        if operation.idempotent:
            line += " idempotent"
        if operation.streamed:
            line += " stream"
        return line

    def type(self, kind: ast.Type, tag: ast.Literal | None = None) -> str:
        if tag is not None:
            return f"optional {self.type(kind)}"
        match kind:
            case ast.BuiltinType(name=name):
                return name
            case ast.ProxyType(target=target):
                known = target.definition if isinstance(target, ast.NamedType) else None
                return f"{known.scoped if known else target.name}*"
            case ast.NamedType(definition=ast.Sequence(element=element)):
                return f"sequence<{self.type(element)}>"
            case ast.NamedType(definition=ast.Dictionary(key=key, value=value)):
                return f"dictionary<{self.type(key)}, {self.type(value)}>"
            case ast.NamedType(definition=definition):
                self.add(definition)
                return definition.scoped if definition else kind.name
        raise AssertionError(f"no canonical form for {kind}")


def _extends(bases: list[str]) -> str:
    return f" extends {', '.join(bases)}" if bases else ""
