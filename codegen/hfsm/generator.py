"""Generate a component as Python that people can read, debug and compare.

People's code stands between marks, which lead from its lines to their places in the document.
"""

from __future__ import annotations

import ast
import os
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final, NamedTuple

from ..code_marks import LIBRARIES, read_marks
from ..diagnostics import Diagnostics, Location
from ..logic import PROOFS, START
from ..messages import Message
from ..parsing import parse_python
from ..python_layout import GENERATED_BY, INDENT
from ._automaton_writer import AutomatonWriter, CodeLines, Line, Method
from ._checks.component import ON_ERROR, ON_REFUSED
from .analysis import Analysis, AutomatonCode
from .code._values import parse_value
from .code.names import (
    camel_case,
    component_name,
    docstring,
    identifier,
    literal,
    printable,
    quoted,
    reserved_names,
    unique,
)
from .code.text import FUTURE, CodeError, CodeText, bound_names, compile_source, definitions, own_nodes
from .codes import Code
from .document import TF
from .known_interfaces import KnownInterface, KnownInterfaces

_METHOD: Final = "automaton"

_CLIENTS: Final = "hfsm_runtime._jderobot"
_MOST_NAMES: Final = 5
"""The most states that the description of a method names."""
_Place = tuple[Path, int, int]
"""A file, and a line and a column in it."""


class GeneratedPiece(NamedTuple):
    """A piece of code in lines `first` to `last` of the component."""

    first: int
    last: int
    code: CodeLines


@dataclass(frozen=True, slots=True)
class GeneratedComponent:
    """The text of a component, and the pieces of code in it, in the order of its lines."""

    text: str
    pieces: tuple[GeneratedPiece, ...]


def generate(
    analysis: Analysis, interfaces: KnownInterfaces, proofs: Iterable[Sequence[object]] = ()
) -> GeneratedComponent:
    """Return the component of a document in which `check` has found no error.

    It keeps what `proofs` rely on, as rows of literals.
    """
    return _Generator(analysis, interfaces).component(proofs)


def check_generated(component: GeneratedComponent, analysis: Analysis, diagnostics: Diagnostics) -> None:
    """Report errors that Python finds in the text of a component, and names with two meanings.

    Each piece of code compiles by itself, but may conflict with the code around it.
    """
    path = analysis.path
    try:
        compile_source(component.text, CodeText(tuple(component.text.split("\n")), line=1))
    except CodeError as error:
        diagnostics.error(Code.BAD_CODE, error.message, _place(component, error, path))
        return
    if [each[:2] for each in read_marks(component.text)] != [each[:2] for each in component.pieces]:
        _report_marks(component, diagnostics)
    declared = (*analysis.document.all_interfaces, *analysis.document.parameters)
    for name in _ambiguous_names(component):
        node = next((each for each in declared if each.name == name), analysis.document)
        place = Location(node.path or path, node.line, max(1, node.column))
        message = Message("`{name}` would have two meanings in the component: choose another name", name=name)
        diagnostics.error(Code.RESERVED_NAME, message, place)


def _ambiguous_names(component: GeneratedComponent) -> Iterator[str]:
    """Yield the names in a component that a generated line binds and another line binds, too.

    In its class, they are also those that a generated line reads after a line of the class has bound them:
    it means what the file has imported. Names that only people's code binds twice may be so on purpose.
    """
    tree = parse_python(component.text)
    theirs = {line for piece in component.pieces for line in range(piece.first, piece.last + 1)}
    scopes: list[ast.Module | ast.ClassDef] = [tree]
    scopes += (node for node in tree.body if isinstance(node, ast.ClassDef))
    for scope in scopes:
        generated: set[str] = set()
        written: set[str] = set()
        for statement in scope.body:
            bound = bound_names(ast.Module([statement], []))
            if statement.lineno in theirs:
                yield from sorted(bound & generated)
                written |= bound
            else:
                used = bound if scope is tree else bound | _read_at_once(statement)
                yield from sorted(used & (generated | written))
                generated |= bound


def _read_at_once(statement: ast.stmt) -> set[str]:
    """Return the names that a statement reads at once."""
    nodes = own_nodes(ast.Module([statement], []))
    return {node.id for node in nodes if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load)}


def _rows(rows: Iterable[Sequence[object]]) -> Iterator[str]:
    """Yield the lines of rows of literals: three for a row, so that changes of neighbors merge."""
    for name, *items in rows:
        yield f"{INDENT * 2}({literal(name)},"
        if items:
            yield f"{INDENT * 3}{', '.join(map(literal, items))},"
        yield f"{INDENT * 2}),"


def _report_marks(component: GeneratedComponent, diagnostics: Diagnostics) -> None:
    """Report the lines of code that would end it in the component."""
    lines = component.text.split("\n")
    for _, last, piece in component.pieces:
        end = lines[last]
        for index, line in enumerate(piece.lines):
            if line == end:
                message = Message(
                    "`{line}` is what ends code in a component: change this comment", line=line.strip()
                )
                place = Location(piece.path, *piece.code.place(index + 1, 1))
                diagnostics.error(Code.BAD_CODE, message, place)


def _place(component: GeneratedComponent, wrong: CodeError, path: Path) -> Location:
    """Return the place of an error in the document; a generated line belongs to the code below it."""
    found = component.pieces
    if not found:
        return Location(path)
    first, _, piece = next((each for each in found if wrong.line <= each.last), found[-1])
    code = piece.code
    index = min(max(0, wrong.line - first), len(code.lines) - 1)
    line = component.text.split("\n")[wrong.line - 1]
    error = code.error(wrong.message, index + 1, wrong.column - max(0, line.find(code.lines[index])))
    return Location(piece.path, error.line, error.column)


class _Generator:
    def __init__(self, analysis: Analysis, interfaces: KnownInterfaces) -> None:
        self._analysis = analysis
        self._document = analysis.document
        self._path = analysis.path
        extension = analysis.extension
        self._extension = None if extension is None or extension.problem else extension
        self._name = component_name(self._path.stem)
        self._description = (
            " ".join(self._document.description.text.split()) or f"The component {self._name}."
        )
        self._interfaces = {each.name: interfaces.find(each.type)[0] for each in self._document.interfaces}
        self._old = analysis.old_names
        self._kind = interfaces.kind
        self._types = self._kind.type_texts([each.type.strip() for each in self._document.ros])
        self._owners = {child: state for _, state in self._document.states() for child in state.children}
        self._automata = list(self._root_first())
        self._methods = self._make_methods()
        self._proxy_classes = self._name_proxy_classes()
        self._class_name = unique(camel_case(self._name), "Component", self._module_names())

    def component(self, proofs: Iterable[Sequence[object]]) -> GeneratedComponent:
        by_id = {code.automaton.id: code.automaton for code in self._automata}
        by_method = {self._methods[code.automaton.id].name: code for code in reversed(self._automata)}
        writers = [
            AutomatonWriter(
                code,
                by_id,
                self._methods,
                name=owner.name if (owner := self._owners.get(code.automaton.id)) else self._name,
                path=code.automaton.path or self._path,
                source=self._file(code.automaton.path) if code.automaton.path else "",
            )
            for code in self._automata
            if by_method[self._methods[code.automaton.id].name] is code  # the first, if they share it
        ]
        automata = [line for writer in writers for line in ("", *writer.lines())]
        if relied := [*_rows(proofs)]:
            automata += [
                "",
                f"    {PROOFS} = (  # what the checks take for sure; the runtime looks",
                *relied,
                "    )",
            ]
        lines: list[str] = []
        pieces: list[GeneratedPiece] = []
        for item in (*self._docstring(), *self._imports(writers), "", "", *self._class(), *automata):
            marked, before = ([item], 0) if isinstance(item, str) else item.marked()
            if not isinstance(item, str):
                first = len(lines) + before + 1
                pieces.append(GeneratedPiece(first, first + len(item.lines) - 1, item))
            lines += marked
        text = "\n".join([*lines, "", START, f"    main({self._class_name})", ""])
        return GeneratedComponent(text, tuple(pieces))

    def _root_first(self) -> Iterator[AutomatonCode]:
        """Yield the automata in the order of the monitor: the root, then those of each state in order."""
        codes = {code.automaton.id: code for code in self._analysis.automata}
        assert self._document.root is not None, "a document without a root has an error"
        pending = [self._document.root.id]
        while pending:
            code = codes[pending.pop()]
            yield code
            children = (child for state in code.automaton.states for child in state.children)
            pending += reversed([child for child in children if child in codes])

    def _file(self, path: Path | None) -> str:
        """Return the name of a file, relative to the document's directory if it is inside."""
        path = path or self._path
        below = path.is_relative_to(self._path.parent)
        return printable(path.relative_to(self._path.parent).as_posix() if below else path.name)

    def _docstring(self) -> Iterator[str]:
        yield f'"""{docstring(self._description)}'
        yield ""
        document = docstring(printable(self._path.name))
        yield f"{GENERATED_BY}{document}. Do not edit: change the document and run codegen."
        paths = (code.automaton.path for code in self._automata)
        sources = dict.fromkeys(self._file(path) for path in paths if path is not None)
        if sources:
            yield f"Parts of it come from {docstring(', '.join(sources))}."
        yield '"""'
        yield ""
        yield "# ruff: noqa"
        yield "# fmt: off"
        yield "# mypy: ignore-errors"
        yield ""

    def _imports(self, writers: Iterable[AutomatonWriter]) -> Iterator[Line]:
        document, extension = self._document, self._extension
        yield FUTURE
        yield ""
        used = {"Component", "main"}.union(*(writer.needs for writer in writers))
        used |= {"Parameter"} if document.parameters else set()
        used |= {"Proxy"} if document.interfaces else set()
        used |= {"Ros"} if document.ros else set()
        used |= {"ros_message"} if self._old.messages else set()
        used |= {"ros_tf"} if self._uses_tf else set()
        used |= {"load_extension"} if extension else set()
        directories = self._package_directories()
        used |= {"add_to_path"} if directories else set()
        names = sorted(used, key=lambda name: (name[0].islower(), name))
        yield "from hfsm_runtime import ("
        yield from (f"    {name}," for name in names)  # what two branches of a document add merges
        yield ")"
        if directories:
            yield ""
            yield f"add_to_path(__file__, {', '.join(map(quoted, directories))})"
        packages: dict[str, set[str]] = {}
        for interface, local_name in self._proxy_classes.items():
            alias = "" if local_name == interface.proxy else f" as {local_name}"
            is_client = interface.scoped_name in self._old.clients
            found = packages.setdefault(_CLIENTS if is_client else interface.package, set())
            found.add(f"{interface.proxy}{alias}")
            if interface.proxy in self._named_proxy_classes:
                found.add(interface.proxy)
        for package, classes in sorted(packages.items()):
            yield from (f"from {package} import {name}" for name in sorted(classes))
        ours = [_import(module) for module in self._old.modules.values()]
        theirs = {each.statement: each.library for each in reversed(self._analysis.imports)}
        if ours or theirs:
            yield ""
        yield from ours
        if self._uses_tf:
            theirs.pop(f"import {TF}", None)
        yield from [f"# <{LIBRARIES}>"] if theirs else []
        for statement, library in reversed(theirs.items()):
            code = CodeText((statement,), library.name.line)
            yield CodeLines([statement], code, library.path or self._path, "library", is_block=False)
        yield from [f"# </{LIBRARIES}>"] if theirs else []
        if extension:
            where = f"__file__, __package__, {quoted(extension.path.stem)}, {quoted(extension.class_name)}"
            yield ""
            yield f"{extension.class_name} = load_extension({where})"
        yield from self._type_texts()

    def _type_texts(self) -> Iterator[str]:
        """Yield the project's own types of endpoints, and the messages that VisualStates imported."""
        if self._types:
            yield ""
            yield "ROS_TYPES = {"
            for name, text in self._types.items():
                yield f"    {quoted(name)}: {quoted(text)},"
            yield "}"
        messages = self._old.messages
        if messages or self._uses_tf:
            yield ""
        if self._uses_tf:
            yield f"{TF} = ros_tf()"
        for local_name, type_name in messages.items():
            types = ", ROS_TYPES" if self._types else ""
            yield f"{local_name} = ros_message({quoted(type_name)}{types})"

    @property
    def _uses_tf(self) -> bool:
        """Whether an old document uses the module `tf` of ROS 1."""
        is_used = any(TF in piece.used for piece in self._analysis.pieces)
        return is_used and bool(self._document.ros_messages)

    def _package_directories(self) -> list[str]:
        """Return the directories of packages of proxies that are not installed, relative to the component."""
        beside = (self._analysis.output or self._path.parent).resolve()
        found = {interface.directory for interface in self._interfaces.values() if interface.directory}
        return sorted(Path(os.path.relpath(each, beside)).as_posix() for each in found)

    def _class(self) -> Iterator[Line]:
        document = self._document
        policies = f"on_error={quoted(document.on_error.text.strip() or ON_ERROR[0])}"
        if document.on_refused.text.strip() not in ("", ON_REFUSED[0]):
            policies += f", on_refused={quoted(document.on_refused.text.strip())}"
        if self._types:
            policies += ", ros_types=ROS_TYPES"
        events = dict.fromkeys(event.name.strip() for event in document.events)
        if events:
            policies += f", events=[{', '.join(map(quoted, events))}]"
        bases = f"{self._extension.class_name}, Component" if self._extension else "Component"
        name = quoted(printable(self._path.name))
        yield f"class {self._class_name}({bases}, document={name}, {policies}):"
        yield f'    """{docstring(self._description)}"""'
        if document.parameters:
            yield ""
        for parameter in document.parameters:
            words = " ".join(parameter.description.text.split())
            description = f", {quoted(words)}" if words else ""
            default = literal(parse_value(parameter.type.text.strip(), parameter.default))
            yield f"    {parameter.name} = Parameter({default}{description})"
        if document.interfaces:
            yield ""
        for interface in document.interfaces:
            proxy = self._proxy_classes[self._interfaces[interface.name]]
            yield f"    {interface.name} = Proxy({quoted(interface.identity.strip())}, {proxy})"
        if document.ros:
            yield ""
        for each in document.ros:
            options = self._kind.options(each).items()
            written = "".join(f", {name}={literal(value)}" for name, value in options)
            where = f"{quoted(each.kind)}, {quoted(each.identity)}, {quoted(each.type.strip())}"
            yield f"    {each.name} = Ros({where}{written})"
        if self._old.attributes or self._old.aliases:
            yield ""
        for name, given in self._old.attributes.items():
            yield f"    {name} = {given.expression}"
        for alias, attribute in self._old.aliases.items():
            yield f"    {alias} = property(lambda self: self.{attribute})"
        for piece in self._analysis.all_functions:
            yield ""
            yield CodeLines(piece.code.indented(1), piece.code, piece.path, "functions", piece.automaton)

    def _attributes(self) -> set[str]:
        """Return the names of everything in the class, except the methods of its automata."""
        found = {node.name for piece in self._analysis.all_functions for node in definitions(piece.tree)}
        found |= {each.name for each in self._document.all_interfaces}
        found |= {each.name for each in self._document.parameters}
        return found.union(self._old.aliases)

    def _name_proxy_classes(self) -> dict[KnownInterface, str]:
        """Return the name of each proxy class in the component.

        It has its scope if two are equal, or if something else in the class or the file is called so.
        """
        interfaces = dict.fromkeys(self._interfaces.values())
        names = Counter(interface.proxy for interface in interfaces)
        taken = self._attributes() | self._analysis.imported.keys() | self._old.messages.keys()
        found: dict[KnownInterface, str] = {}
        for interface in interfaces:
            is_free = names[interface.proxy] == 1 and interface.proxy not in taken
            scoped = camel_case(interface.scoped_name.replace("::", "_")) + "Prx"
            found[interface] = interface.proxy if is_free else unique(scoped, "proxy", taken)
        return found

    @property
    def _named_proxy_classes(self) -> set[str]:
        """The names of proxy classes that code uses, also where the component calls the class otherwise."""
        names = Counter(interface.proxy for interface in self._proxy_classes)
        used = self._analysis.free - self._analysis.imported.keys() - self._old.messages.keys()
        return {name for name, count in names.items() if count == 1 and name in used}

    def _module_names(self) -> set[str]:
        """Return the names of everything in the component's file, except its class."""
        found = {*reserved_names(self._document), *self._analysis.imported, *self._old.messages}
        found |= {*self._proxy_classes.values(), *self._named_proxy_classes}
        return found | ({self._extension.class_name} if self._extension else set())

    def _make_methods(self) -> dict[int, Method]:
        """Return the method of each automaton by id, named after the state that owns it.

        An automaton that is imported several times and owns no other has one method, named after its file.
        """
        taken = self._attributes()
        names: dict[_Place | None, list[str]] = {}
        for code in self._automata:
            if owner := self._owners.get(code.automaton.id):
                names.setdefault(self._imported_place(code), []).append(repr(owner.name))
        shared: dict[_Place, str] = {}
        methods: dict[int, Method] = {}
        for code in self._automata:
            number, place = code.automaton.id, self._imported_place(code)
            owner = self._owners.get(number)
            if place is None or owner is None or len(names[place]) == 1:
                wanted = _METHOD if owner is None else f"{_METHOD}_{identifier(owner.name, str(number))}"
                name = unique(wanted, number, taken)
                role = f"the state {owner.name!r}" if owner else "the component"
                methods[number] = Method(name, f"{name}()", role)
            else:
                wanted = f"{_METHOD}_{identifier(place[0].stem, str(number))}"
                name = shared.setdefault(place, unique(wanted, number, taken))
                call = f"{name}({quoted(owner.name)}, {number})"
                methods[number] = Method(name, call, _in_words(names[place]), is_shared=True)
            taken.add(name)
        return methods

    def _imported_place(self, code: AutomatonCode) -> _Place | None:
        """Return the place of an automaton in another file, or None if it owns other automata."""
        automaton = code.automaton
        if automaton.path is None or any(state.children for state in automaton.states):
            return None
        return automaton.path, automaton.line, automaton.column


def _import(module: str) -> str:
    """Return the statement that binds the last part of a module's full name."""
    package, _, name = module.rpartition(".")
    return f"from {package} import {name}" if package else f"import {name}"


def _in_words(states: Iterable[str]) -> str:
    """Return the names of several states as text."""
    *others, last = dict.fromkeys(states)
    if len(others) >= _MOST_NAMES:
        return "several states"
    return f"the states {', '.join(others)} and {last}" if others else f"each state {last}"
