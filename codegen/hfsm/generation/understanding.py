"""Understand a document as a program: check its structure, analyze its code, join what belongs together."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from ...diagnostics import Diagnostics, Location
from ..analysis import Analysis
from ..checks import ON_ERROR, ON_REFUSED, check
from ..code.literals import literal, printable
from ..code.names import OLD_MODULES, camel_case, component_name, reserved_names
from ..code.python import analyze_library, analyze_methods
from ..code.reader import CodeReader, first_foreign, report_foreign
from ..code.text import Code as PythonCode
from ..code.values import PARAMETER_TYPES, ValueTextError, parse_value
from ..codes import Code
from ..document import Automaton, Document, Parameter, State, Text
from ..known_interfaces import KnownInterfaces
from ..program import (
    AutomatonProgram,
    ExtensionProgram,
    FunctionsProgram,
    LibraryProgram,
    ParameterProgram,
    Program,
    ProxyProgram,
)
from .attributes import Attributes
from .automaton_analysis import AutomatonAnalysis

__all__ = ["understand"]


def understand(
    document: Document,
    path: Path,
    interfaces: KnownInterfaces,
    diagnostics: Diagnostics,
    extension: ExtensionProgram | None = None,
    *,
    analysis: Analysis | None = None,
) -> Program | None:
    """Return the program of a document, or None when something in it was reported as an error.

    What the document imports has been resolved. `extension` is the hand-written base of the
    component, `analysis` that of the document, where it has been made.
    """
    errors = len(diagnostics.errors)
    check(document, path, interfaces, diagnostics, analysis)
    piece = first_foreign(document, path)
    if piece is not None:
        report_foreign(piece, document.language.text.strip()[:20], diagnostics)
        return None
    understanding = _Understanding(document, path, diagnostics, extension)
    libraries = understanding.libraries()
    functions = tuple(understanding.functions())
    programs = understanding.automata()
    parameters = tuple(understanding.parameters())
    understanding.report()
    if len(diagnostics.errors) > errors:
        return None
    automata = tuple(_root_first(document, programs))
    name = component_name(path.stem)
    description = " ".join(document.description.text.split())
    return Program(
        document_name=printable(path.name),
        sources=tuple(dict.fromkeys(automaton.source for automaton in automata if automaton.source)),
        name=name,
        class_name=camel_case(name),
        description=description or f"The component {name}.",
        on_error=document.on_error.text.strip() or ON_ERROR[0],
        on_refused=document.on_refused.text.strip() or ON_REFUSED[0],
        extension=extension,
        libraries=libraries,
        parameters=parameters,
        proxies=tuple(
            ProxyProgram(interface.name, interface.identity.strip(), interfaces.find(interface.type)[0])
            for interface in document.interfaces
        ),
        functions=functions,
        automata=automata,
        is_old=document.is_old,
    )


class _Understanding:
    def __init__(
        self, document: Document, path: Path, diagnostics: Diagnostics, extension: ExtensionProgram | None
    ) -> None:
        self._document = document
        self._path = path
        self._diagnostics = diagnostics
        self._reader = CodeReader(path, diagnostics)
        self._attributes = Attributes(diagnostics)
        self._reserved = reserved_names(document)
        if extension is not None:
            self._reserved |= {"load_extension", extension.class_name}

    def libraries(self) -> tuple[LibraryProgram, ...]:
        """Return the imports of the libraries, each statement once."""
        modules = OLD_MODULES if self._document.is_old else ()
        found = {f"import {module}": LibraryProgram(f"import {module}") for module in modules}
        for library in self._document.libraries:
            if library.name.is_blank or not library.is_module:
                continue
            read = self._reader.read(analyze_library, "a library", library.name, library.path)
            if read is None:
                continue
            statement, names = read
            for name in sorted(self._reserved & names):
                message = f"`{name}` is a name that the component needs: choose another"
                place = Location(library.path or self._path, library.name.line)
                self._diagnostics.error(Code.RESERVED_NAME, message, place)
            code = PythonCode((statement,), library.name.line)
            program = LibraryProgram(statement, code, self._file(library.path), library.path)
            found.setdefault(statement, program)
        return tuple(found.values())

    def functions(self) -> Iterator[FunctionsProgram]:
        """Yield the functions in the order of the document."""
        for what, text, source, automaton in self._function_texts():
            found = self._reader.read(analyze_methods, what, text, source)
            if found is None:
                continue
            code, lines = found
            path = source or self._path
            self._attributes.add_functions({name: Location(path, line) for name, line in lines.items()})
            yield FunctionsProgram(self._file(source), code, source, automaton)

    def automata(self) -> dict[int, AutomatonProgram]:
        """Return all automata by id."""
        automata: dict[int, Automaton] = {}
        owners: dict[int, State] = {}
        for automaton in self._document.automata:
            automata.setdefault(automaton.id, automaton)
        for _, state in self._document.states():
            for child in state.children:
                owners.setdefault(child, state)
        return {
            automaton.id: AutomatonAnalysis(
                automaton,
                automata,
                path=self._path,
                reserved=self._reserved,
                reader=self._reader,
                diagnostics=self._diagnostics,
            ).program(owners.get(automaton.id), self._file(automaton.path))
            for automaton in automata.values()
        }

    def parameters(self) -> Iterator[ParameterProgram]:
        """Yield the parameters."""
        place = Location(self._path)
        self._attributes.check_interfaces(self._document, place)
        self._attributes.check_parameters(self._document, place)
        for parameter in self._document.parameters:
            try:
                default = _parameter_default(parameter)
            except ValueTextError as error:
                message = f"the parameter `{parameter.name}`: {error}"
                line, column = _wrong_part(parameter)
                where = Location(parameter.path or self._path, line, max(1, column))
                self._diagnostics.error(Code.BAD_PARAMETER, message, where)
            else:
                yield ParameterProgram(parameter.name, default, " ".join(parameter.description.text.split()))

    def report(self) -> None:
        """Report what is wrong with the code."""
        self._reader.report()

    def _function_texts(self) -> Iterator[tuple[str, Text, Path | None, int]]:
        for automaton in self._document.automata:
            what = f"a function of automaton {automaton.id}"
            yield what, automaton.functions, automaton.path, automaton.id
        for functions in self._document.functions:
            yield "a function", functions.text, functions.path, 0

    def _file(self, source: Path | None) -> str:
        """Return the name of a file: relative to the document where it lies below it."""
        path = source or self._path
        below = path.is_relative_to(self._path.parent)
        return printable(path.relative_to(self._path.parent).as_posix() if below else path.name)


def _root_first(document: Document, programs: dict[int, AutomatonProgram]) -> Iterator[AutomatonProgram]:
    """Yield the automata as the monitor shows them: the root, then each state's own in order."""
    pending = [] if document.root is None else [document.root.id]
    while pending:
        program = programs[pending.pop()]
        yield program
        pending += [child for state in reversed(program.states) for child in reversed(state.children)]


def _parameter_default(parameter: Parameter) -> str:
    type_name = parameter.type.text.strip()
    if type_name not in PARAMETER_TYPES:
        found = f", not `{type_name[:40]}`" if type_name else ""
        raise ValueTextError(f"its type is one of {', '.join(PARAMETER_TYPES)}{found}")
    if parameter.default.is_blank:
        raise ValueTextError("it needs a default")
    return literal(parse_value(type_name, parameter.default))


def _wrong_part(parameter: Parameter) -> tuple[int, int]:
    """Return line and column of what is wrong with a parameter: its type, its default, or what is missing."""
    wrong = parameter.default if parameter.type.text.strip() in PARAMETER_TYPES else parameter.type
    return (parameter.line, parameter.column) if wrong.is_blank else (wrong.line, wrong.column)
