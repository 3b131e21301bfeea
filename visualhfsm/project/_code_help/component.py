"""Generate the component around a piece of code that is being typed, for tools that read Python.

The generator gets placeholders for all code, which may be unfinished; the texts are then put in their places.
Of an automaton, only the piece is generated, after its variables and other code that may assign variables.
"""

from __future__ import annotations

import keyword
import re
import textwrap
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import parso

from codegen.hfsm.analysis import analyze
from codegen.hfsm.code.text import parse_piece
from codegen.hfsm.document import (
    NO_CHILD,
    Automaton,
    Document,
    Parameter,
    State,
    Text,
    Transition,
)
from codegen.hfsm.generator import generate
from codegen.hfsm.known_interfaces import KnownInterfaces
from codegen.logic import START
from codegen.python_layout import INDENT
from visualhfsm._document.places import Place, texts_in

_TYPED, _SHARED, _FUNCTIONS = "_hfsm_typed", "_hfsm_shared", "_hfsm_functions"
_SHARING: Final = frozenset({"entry", "code", "exit", "fired"})
_DEFAULTS: Final = {"int": "0", "float": "0.0", "bool": "False", "str": '""', "object": "None"}
_READ_EASILY: Final = (
    (re.compile(r'^(\w+) = load_extension\(.*"(\w+)", "\w+"\)$', re.MULTILINE), r"from \2 import \1"),
    (re.compile(r"^(    \w+) = Proxy\(.*, (\w+)\)$", re.MULTILINE), r"\1: \2"),
)
"""Generated code, and an equivalent that jedi understands, or reads in half the time."""
_WRITTEN: Final = re.compile(
    r"^ *(?:(?:def|class) (\w+)|(\w+) = (?:State|Transition)\(|from [\w.]+ import (\([^)]+|.+))", re.MULTILINE
)
"""Bindings of names in a line of the generator."""
_LAST_WORD: Final = re.compile(r"\w+(?= *(?:,|$))")
_DEFINED: Final = re.compile(r"^\s*def\s+(\w+)", re.MULTILINE)


@dataclass(frozen=True, slots=True)
class TypedComponent:
    """A component with a piece of code, between `before` and `after`, which moves right by `indent`.

    `own_names` are those that the document itself gives: proxies, parameters, functions, variables;
    `internal_names` those that only the generator uses. `directories` have packages that it imports.
    """

    before: str
    indent: str
    after: str
    own_names: frozenset[str] = frozenset()
    internal_names: frozenset[str] = frozenset()
    directories: tuple[Path, ...] = ()
    code: str = ""

    def with_code(self, code: str) -> TypedComponent:
        """Return the component with another text as the piece."""
        return replace(self, code=_lines(code), own_names=self.own_names | _assigned(code))

    @property
    def source(self) -> str:
        """The text of the component."""
        margin = self._margin()
        lines = (self.indent + line[margin:] for line in self.code.split("\n"))
        return self.before + "\n".join(lines) + self.after

    def position(self, line: int, column: int) -> tuple[int, int]:
        """Convert a line (from 1) and a column (from 0) of the piece to those of the source."""
        lines = self.source.split("\n")
        number = min(max(1, self.before.count("\n") + line), len(lines))
        return number, min(max(0, column + len(self.indent) - self._margin()), len(lines[number - 1]))

    def _margin(self) -> int:
        """Return the width of the indentation that all lines of the piece share."""
        lines = self.code.split("\n")
        return min((len(line) - len(line.lstrip()) for line in lines if line.strip()), default=0)


def generate_around(
    document: Document, place: Place, path: Path, interfaces: KnownInterfaces
) -> TypedComponent:
    """Return the component around the piece of code at a place of a document at `path`.

    Imports of the document have been resolved.
    """
    automaton = document.automaton(place.automaton) or Automaton(id=place.automaton)
    functions = [each.text.text for each in document.functions]
    shared = [automaton.variables.text]
    for each, text, _, _ in texts_in(document):
        if text and each.part == "functions" and each != place:
            functions.append(text)
        elif (
            text
            and each.part in _SHARING
            and each.automaton == place.automaton
            and each != place
            and parse_piece(text)
        ):
            shared.append(text)
    if place.kind == "automaton":  # that code runs before all other code, or belongs to no automaton
        shared = []
    reduced = replace(
        document,
        language=Text(),
        automata=(_with_placeholders(automaton, place),),
        functions=(),
        interfaces=tuple(
            each for each in document.interfaces if _is_name(each.name) and interfaces.find(each.type)
        ),
        parameters=tuple(_usable(document.parameters)),
        ros=tuple(
            replace(each, qos=Text())
            for each in document.ros
            if _is_name(each.name) and interfaces.kind.can_generate(each)
        ),
    )
    analysis = analyze(reduced, path)
    text, _, _ = generate(analysis, interfaces).text.rpartition(START)
    for written, read in _READ_EASILY:
        text = written.sub(read, text)
    text = interfaces.kind.readable(text, reduced.ros)
    internal = {name for names in _WRITTEN.findall(text) for name in _LAST_WORD.findall(",".join(names))}
    own = {each.name for each in reduced.all_interfaces} | ({"ros"} if reduced.ros else set())
    own.update(each.name for each in reduced.parameters)
    own.update(reduced.automata[0].declared)
    own.update(*map(_assigned, shared), *map(_DEFINED.findall, functions))
    for placeholder, texts in ((_FUNCTIONS, functions), (_SHARED, shared)):
        code = "\n".join(textwrap.dedent(_lines(each)) for each in texts)
        text = replace(_around(text, placeholder), code=code).source
    hidden = internal - own - analysis.libraries.keys()
    return replace(
        _around(text, _TYPED),
        own_names=frozenset(own),
        internal_names=frozenset(hidden),
        directories=interfaces.directories,
    )


def _with_placeholders(automaton: Automaton, place: Place) -> Automaton:
    """Return the automaton of a piece with placeholders for the piece, its functions and other code.

    Other code stands before the piece, in the same function if that assigns something: jedi does not know
    `nonlocal`.
    """
    function = "def {}(self): pass"
    functions, variables, code, guard = function.format(_FUNCTIONS), _SHARED, "", ""
    if place.part == "functions":
        functions = f"{functions}\n{function.format(_TYPED)}"
    elif place.part == "variables":
        variables = f"{_SHARED}\n{_TYPED}"
    elif place.part in ("trigger", "guard", "argument"):
        guard = _TYPED
    else:
        variables, code = "", f"{_SHARED}\n{_TYPED}"
    has_event = place.kind == "transition" and any(
        each.id == place.id and each.type == "event" for each in automaton.transitions
    )
    kind = "event" if has_event else "finished"
    transition = Transition(
        id=1, origin=1, destination=1, type=kind, trigger=Text(kind), guard=Text(guard), code=Text(code)
    )
    return replace(
        automaton,
        father=NO_CHILD,
        states=(State(id=1, name=""),),
        transitions=(transition,),
        inputs=tuple(_usable(automaton.inputs)),
        outputs=tuple(_usable(automaton.outputs)),
        variables=Text(variables),
        functions=Text(functions),
    )


def _usable(parameters: Iterable[Parameter]) -> Iterator[Parameter]:
    """Yield parameters, inputs or outputs with a type and a default that can be generated."""
    for each in parameters:
        if _is_name(each.name):
            kind = each.type.text.strip()
            kind = kind if kind in _DEFAULTS else "object"
            yield replace(each, type=Text(kind), default=Text(_DEFAULTS[kind]))


def _around(source: str, placeholder: str) -> TypedComponent:
    """Split a source at the line with a placeholder; an expression gets separate lines."""
    at = source.index(placeholder)
    start, end = source.rfind("\n", 0, at) + 1, source.find("\n", at)
    line = source[start:end]
    indent = line[: len(line) - len(line.lstrip())]
    if line.lstrip().startswith("return "):
        before, after = f"{source[:start]}{indent}return (\n", f"\n{indent}){source[end:]}"
        return TypedComponent(before, indent + INDENT, after)
    after = f"\n{indent}pass{source[end:]}"  # or a blank last line would belong to the code below
    return TypedComponent(source[:start], indent, after)


def _lines(text: str) -> str:
    return text.replace("\r\n", "\n").replace("\r", "\n")


def _assigned(code: str) -> set[str]:
    """Return the names that a piece of code assigns or defines; it may be unfinished."""
    try:
        used = parso.parse(textwrap.dedent(code)).get_used_names()
    except RecursionError:  # nested too deeply
        return set()
    return {
        name
        for name, places in used.items()
        if any(place.is_definition() and place.parent.type != "trailer" for place in places)
    }


def _is_name(text: str) -> bool:
    return text.isidentifier() and not keyword.iskeyword(text)
