"""Write data types: structs, classes, enumerations, sequences, dictionaries and constants."""

from __future__ import annotations

from collections.abc import Iterator

from . import ast
from .annotations import Annotations
from .dependencies import named_elements, needed_at_import
from .doc_comments import parse_doc_comment
from .exception_writer import write_exception
from .layout import INDENT, docstring, string
from .names import EMPTY_STRUCT, ModuleNames, python_name
from .places import GeneratedModule
from .record_writer import fields_of, write_record


class TypeWriter:
    """Writes the types of one module."""

    def __init__(self, names: ModuleNames, annotations: Annotations, module: GeneratedModule) -> None:
        self._names = names
        self._annotations = annotations
        self._module = module
        self._uses_empty_struct = False

    def in_order_of_use(self) -> Iterator[ast.Definition]:
        """Yield the definitions of the module in an order in which what runs at import finds what it needs.

        That is the order of the source, but for sequences and dictionaries of what is declared beforehand.
        """
        here = {definition.scoped for definition in self._module.definitions}
        done: set[str] = set()
        waiting = list(self._module.definitions)
        while waiting:
            ready = next(each for each in waiting if _needs(each) & here <= done)
            waiting.remove(ready)
            done.add(ready.scoped)
            yield ready

    def write(self, definition: ast.Definition) -> list[list[str]]:
        """Return the statements of a data type or a constant."""
        match definition:
            case ast.Struct():
                lines = self._struct(definition)
            case ast.Class():
                lines = self._class(definition)
            case ast.ExceptionType():
                lines = write_exception(definition, self._annotations, self._names)
            case ast.Enumeration():
                lines = self._enumeration(definition)
            case ast.Sequence() | ast.Dictionary():
                lines = self._alias(definition)
            case ast.Constant():
                lines = self._constant(definition)
            case _:
                raise AssertionError(f"no Python for {definition}")
        name = python_name(definition)
        if self._names.is_shadowed(name):
            return [lines, [f"{self._names.defined(name)} = {name}"]]
        return [lines]

    def empty_struct(self) -> str:
        """Return the name of the module's struct without members."""
        self._uses_empty_struct = True
        return EMPTY_STRUCT

    def write_empty_struct(self) -> list[list[str]]:
        """Return the struct that stands for no arguments and no results, if it was asked for."""
        if not self._uses_empty_struct:
            return []
        doc = "The arguments or results of operations without any."
        return [write_record(EMPTY_STRUCT, doc, [self._names.runtime("Struct")], ())]

    def _struct(self, definition: ast.Struct) -> list[str]:
        doc = parse_doc_comment(definition.doc).text
        fields = fields_of(definition.members, self._annotations)
        return write_record(python_name(definition), doc, [self._names.runtime("Struct")], fields)

    def _class(self, definition: ast.Class) -> list[str]:
        base = definition.base_definition
        parent = self._annotations.reference(base, at_import=True) if base else self._names.runtime("Value")
        type_ids = " ".join([definition.scoped, *(ancestor.scoped for ancestor in definition.ancestors())])
        fields = fields_of(definition.members, self._annotations)
        inherited = [member for ancestor in definition.ancestors() for member in ancestor.members]
        follows_default = any(member.default or member.tag for member in inherited)
        doc = parse_doc_comment(definition.doc).text
        bases = [parent, f"tag={string(type_ids)}"]
        name = python_name(definition)
        return write_record(name, doc, bases, fields, follows_default=follows_default)

    def _enumeration(self, definition: ast.Enumeration) -> list[str]:
        lines = [f"class {python_name(definition)}({self._names.imported('enum', 'IntEnum')}):"]
        doc = parse_doc_comment(definition.doc).text
        if doc:
            lines += [*docstring(doc, INDENT), ""]
        for enumerator in definition.enumerators:
            lines.append(f"{INDENT}{python_name(enumerator)} = {enumerator.value}")
            text = parse_doc_comment(enumerator.doc).text
            if text:
                lines += docstring(text, INDENT)
        return lines

    def _alias(self, definition: ast.Sequence | ast.Dictionary) -> list[str]:
        doc = parse_doc_comment(definition.doc).text
        return [self._annotations.alias(definition), *(docstring(doc) if doc else [])]

    def _constant(self, definition: ast.Constant) -> list[str]:
        final = self._names.imported("typing", "Final")
        annotation = self._annotations.type(definition.type)
        value = self._annotations.value(definition.literal, definition.type)
        doc = parse_doc_comment(definition.doc).text
        line = f"{python_name(definition)}: {final}[{annotation}] = {value}"
        return [line, *(docstring(doc) if doc else [])]


def _needs(definition: ast.Definition) -> set[str]:
    """Return the scoped names of what must be defined before a definition when the module is imported."""
    return {each.scoped for need in (needed_at_import, named_elements) for each in need(definition)}
