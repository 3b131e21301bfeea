"""Put a piece of code into a module around it, in which a tool for Python finds all that it may use.

The module has the imports of the component, a class with its proxies, parameters and functions, and in a
method the variables of the automaton before the piece. It is read by tools and never run.
"""

from __future__ import annotations

import ast
import keyword
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from codegen.diagnostics import Diagnostics
from codegen.hfsm import component_path
from codegen.hfsm.code.text import CodeError, parse_import, without_warnings
from codegen.hfsm.document import Automaton, Document
from codegen.hfsm.extension import find_extension
from codegen.hfsm.known_interfaces import KnownInterfaces
from visualhfsm.editing.places import Place

from .proxies import typed_proxy

__all__ = ["Synthetic", "synthesize"]

_INDENT: Final = " " * 4
_HEADER: Final = (
    "from __future__ import annotations",
    "from collections.abc import Iterator",
    "from hfsm_runtime import Component, Event",
    "from zenoh_ice.proxy import StreamedCall",
)
_TYPES: Final = frozenset({"int", "float", "bool", "str", "object"})


@dataclass(frozen=True, slots=True)
class Synthetic:
    """A module, and where the piece stands in it.

    Its first line is line `before` + 1 of the module, and each line has moved right by `shift` columns, which
    may be negative.
    """

    source: str
    before: int
    shift: int
    own_names: frozenset[str]
    """The names that the document itself gives: proxies, parameters, functions, variables."""

    def position(self, line: int, column: int) -> tuple[int, int]:
        """Return the line and column in the module of those in the piece (line from 1, column from 0)."""
        lines = self.source.split("\n")
        number = min(max(1, self.before + line), len(lines))
        return number, min(max(0, column + self.shift), len(lines[number - 1]))


def synthesize(
    document: Document, place: Place, code: str, path: Path, interfaces: KnownInterfaces
) -> Synthetic:
    """Return the module around a piece of code; `path` is where the document lies or would lie."""
    automaton = document.automaton(place.automaton) or Automaton(id=0)
    lines = [*_HEADER]
    lines += _imports(document)
    attributes: list[str] = []
    for number, interface in enumerate(document.interfaces):
        known = interfaces.find(interface.type)
        if known and _is_name(interface.name):
            lines += typed_proxy(known[0], f"_Proxy{number}").split("\n")
            attributes.append(f"{interface.name}: _Proxy{number}")
    parameters = [
        f"{each.name}: {each.type.text.strip() if each.type.text.strip() in _TYPES else 'object'} = ..."
        for each in document.parameters
        if _is_name(each.name)
    ]
    lines += _class_header(path)
    lines += [f"{_INDENT}{line}" for line in (*attributes, *parameters)]
    for other in document.automata:
        if not (place.part == "functions" and other.id == place.automaton):
            lines += _moved(other.functions.text, _INDENT)
    for functions in document.functions:
        lines += _moved(functions.text.text, _INDENT)
    functions_code = code if place.part == "functions" else automaton.functions.text
    own = {interface.name for interface in document.interfaces}
    own |= {parameter.name for parameter in document.parameters}
    texts = (automaton.functions.text for automaton in document.automata)
    own |= {name for text in (functions_code, *texts) for name in _defined(text)} | _assigned(code)
    if place.part == "functions":
        return _with_piece(lines, code, _INDENT, own)
    lines.append(f"{_INDENT}def _automaton(self{', event: Event' if _has_event(automaton, place) else ''}):")
    inner = _INDENT * 2
    for item in automaton.inputs:
        if _is_name(item.name):
            type_name = item.type.text.strip()
            lines.append(f"{inner}{item.name}: {type_name if type_name in _TYPES else 'object'} = ...")
            own.add(item.name)
    if place.part != "variables":
        lines += _moved(automaton.variables.text, inner)
        own |= _assigned(automaton.variables.text)
        lines += [f"{inner}{line}" for line in _assignments_elsewhere(automaton, place, own)]
    if _is_expression(place):
        lines.append(f"{inner}return (")
        return _with_piece(lines, code, inner, own, end=(f"{inner})",))
    return _with_piece(lines, code, inner, own)


def _with_piece(
    lines: list[str], code: str, indent: str, own: set[str], end: tuple[str, ...] = ()
) -> Synthetic:
    removed = _shared_indentation(code)
    shift = len(indent) - removed
    before = len(lines)
    body = [indent + line[removed:] for line in _lines(code)]
    return Synthetic("\n".join([*lines, *body, *end, ""]), before, shift, frozenset(own))


def _imports(document: Document) -> Iterator[str]:
    for library in document.libraries:
        if library.is_module and not library.name.is_blank:
            try:
                yield parse_import(library.name)[0]
            except CodeError:  # the checks tell of it
                continue


def _class_header(path: Path) -> Iterator[str]:
    extension = find_extension(path, component_path(path, None), Diagnostics())
    if extension is None:
        yield "class _Self(Component):"
    else:
        yield f"from {extension.module} import {extension.class_name}"
        yield f"class _Self({extension.class_name}, Component):"


def _has_event(automaton: Automaton, place: Place) -> bool:
    return place.kind == "transition" and any(
        each.id == place.id and each.type == "event" for each in automaton.transitions
    )


def _is_expression(place: Place) -> bool:
    return place.part in ("trigger", "guard", "argument")


def _assignments_elsewhere(automaton: Automaton, place: Place, known: set[str]) -> Iterator[str]:
    """Yield the assignments by which other pieces give a value to what the variables do not."""
    found: dict[str, str] = {}
    for text in _other_texts(automaton, place):
        for node in _parsed(text):
            if isinstance(node, ast.Assign) and len(node.targets) == 1:
                target = node.targets[0]
                if isinstance(target, ast.Name) and target.id not in known:
                    found.setdefault(target.id, " ".join(ast.unparse(node).split("\n")))
    yield from found.values()


def _other_texts(automaton: Automaton, place: Place) -> Iterator[str]:
    def is_meant(kind: str, id: int, part: str) -> bool:
        return (place.kind, place.id, place.part) == (kind, id, part)

    for state in automaton.states:
        parts = (
            ("entry", state.entry),
            ("code", state.code),
            ("exit", state.exit),
        )
        for part, text in parts:
            if not text.is_blank and not is_meant("state", state.id, part):
                yield text.text
    for transition in automaton.transitions:
        if not transition.code.is_blank and not is_meant("transition", transition.id, "fired"):
            yield transition.code.text


def _assigned(text: str) -> set[str]:
    """Return the names that a piece of code assigns, also one that is being typed."""
    return {
        node.id
        for statement in _parsed(text)
        for node in ast.walk(statement)
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)
    }


def _defined(text: str) -> list[str]:
    return re.findall(r"^\s*def\s+(\w+)", text, re.MULTILINE)


def _parsed(text: str) -> list[ast.stmt]:
    removed = _shared_indentation(text)
    try:
        with without_warnings():
            return ast.parse("\n".join(line[removed:] for line in _lines(text))).body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return []


def _moved(text: str, indent: str) -> Iterator[str]:
    """Yield the lines of a piece as they stand in a block."""
    removed = _shared_indentation(text)
    for line in _lines(text):
        yield indent + line[removed:] if line.strip() else ""


def _shared_indentation(text: str) -> int:
    """Return how many characters of white space all lines that are not blank share on their left."""
    return min((len(line) - len(line.lstrip()) for line in _lines(text) if line.strip()), default=0)


def _lines(text: str) -> list[str]:
    return text.replace("\r\n", "\n").replace("\r", "\n").split("\n")


def _is_name(text: str) -> bool:
    return text.isidentifier() and not keyword.iskeyword(text)
