"""Tell which definitions a definition needs: when its module is imported, or only in annotations."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from . import ast


def needed_at_import(definition: ast.Definition) -> Iterator[ast.Definition]:
    """Yield what must be defined before a definition, apart from what `named_elements` gives."""
    match definition:
        case ast.Sequence() | ast.Dictionary():
            yield from (each for each in _elements(definition) if not _may_follow(each))
        case ast.Constant():
            yield from _targets([definition.literal])
            yield from _defined([definition.type])
        case ast.Struct():
            yield from _defaults(definition.members)
        case ast.Class() | ast.ExceptionType():
            if definition.base_definition is not None:
                yield definition.base_definition
            yield from _defaults([*definition.members, *_inherited(definition)])
        case ast.Interface():
            yield from definition.base_definitions
            for operation in definition.operations:
                yield from _defined(operation.throws)


def named_elements(definition: ast.Definition) -> Iterator[ast.Definition]:
    """Yield the classes and interfaces that a sequence or dictionary is of: they may be defined after it."""
    yield from (each for each in _elements(definition) if _may_follow(each))


def needed_in_annotations(definition: ast.Definition) -> Iterator[ast.Definition]:
    """Yield what the annotations in a definition name."""
    types: list[ast.Type | None] = []
    match definition:
        case ast.Struct() | ast.Class():
            types = [member.type for member in definition.members]
        case ast.ExceptionType():
            types = [member.type for member in definition.all_members]
        case ast.Interface():
            for operation in definition.operations:
                types += [operation.returns, *(parameter.type for parameter in operation.parameters)]
    for each in _defined(types):
        yield each
        yield from _all_elements(each)


def _elements(definition: ast.Definition) -> Iterator[ast.Definition]:
    match definition:
        case ast.Sequence():
            yield from _defined([definition.element])
        case ast.Dictionary():
            yield from _defined([definition.key, definition.value])


def _all_elements(definition: ast.Definition) -> Iterator[ast.Definition]:
    for element in _elements(definition):
        yield element
        yield from _all_elements(element)


def _may_follow(definition: ast.Definition) -> bool:
    return isinstance(definition, ast.Class | ast.Interface)


def _defined(types: Iterable[ast.Type | None]) -> Iterator[ast.Definition]:
    """Yield the definitions that stand in the output for types."""
    for kind in types:
        named = kind.target if isinstance(kind, ast.ProxyType) else kind
        if not isinstance(named, ast.NamedType) or named.definition is None:
            continue
        by_value = named is kind
        shown = not isinstance(named.definition, ast.Interface if by_value else ast.Class)
        if shown and not isinstance(named.definition, ast.ForwardDeclaration):
            yield named.definition


def _defaults(members: Iterable[ast.Member]) -> Iterator[ast.Definition]:
    yield from _targets(member.default for member in members)


def _targets(literals: Iterable[ast.Literal | None]) -> Iterator[ast.Definition]:
    for literal in literals:
        target = literal.target if literal is not None else None
        if isinstance(target, ast.Constant):
            yield target
        elif target is not None and target.enumeration is not None:
            yield target.enumeration


def _inherited(definition: ast.Derivable) -> list[ast.Member]:
    """Return the members whose default values a constructor repeats: those of exceptions."""
    return definition.all_members if isinstance(definition, ast.ExceptionType) else []
