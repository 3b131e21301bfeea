"""Understand a document as a program: the code of every piece, analyzed, with the names it will have."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from ..diagnostics import Diagnostics, Location, Note
from .checks import COMPONENT_ATTRIBUTES, ON_ERROR, check_structure, milliseconds
from .document import Automaton, Document, State, Text, Transition
from .known_interfaces import KnownInterface, KnownInterfaces
from .names import RESERVED, camel_case, component_name
from .python_code import Code, CodeError, analyze_block, analyze_condition, analyze_library, analyze_methods

__all__ = ["AutomatonProgram", "Program", "ProxyProgram", "TransitionProgram", "understand"]

_T = TypeVar("_T")


@dataclass(frozen=True, slots=True)
class TransitionProgram:
    """A transition: `seconds` or `condition`, and what runs when it fires."""

    transition: Transition
    seconds: float | None
    condition: Code | None
    code: Code | None


@dataclass(frozen=True, slots=True)
class AutomatonProgram:
    """An automaton: its period in s, and the code of its parts; states by their place in the document."""

    automaton: Automaton
    period: float
    variables: Code | None
    methods: Code | None
    states: tuple[tuple[State, Code | None], ...]
    transitions: tuple[TransitionProgram, ...]

    def pieces(self) -> Iterable[Code]:
        """Return the pieces of code that run in cycles."""
        for _, code in self.states:
            if code is not None:
                yield code
        for transition in self.transitions:
            for piece in (transition.condition, transition.code):
                if piece is not None:
                    yield piece


@dataclass(frozen=True, slots=True)
class ProxyProgram:
    """A proxy of the component: its attribute, the identity of its servant, and its interface."""

    attribute: str
    identity: str
    interface: KnownInterface


@dataclass(frozen=True, slots=True)
class Program:
    """A component, ready to be written down."""

    document: Document
    document_name: str
    name: str
    class_name: str
    description: str
    on_error: str
    imports: tuple[str, ...]
    proxies: tuple[ProxyProgram, ...]
    automata: tuple[AutomatonProgram, ...]

    def automaton(self, id: int) -> AutomatonProgram:
        """Return an automaton by its id, which exists."""
        return next(program for program in self.automata if program.automaton.id == id)


def understand(
    document: Document, path: Path, interfaces: KnownInterfaces, diagnostics: Diagnostics
) -> Program | None:
    """Return the program of a document, or None when something in it was reported as an error."""
    errors = len(diagnostics.errors)
    check_structure(document, path, interfaces, diagnostics)
    reader = _Understanding(path, diagnostics)
    imports = reader.imports(document)
    automata = tuple(reader.automaton(automaton) for automaton in document.automata)
    reader.check_methods(document)
    if len(diagnostics.errors) > errors:
        return None
    name = component_name(path.stem)
    description = " ".join(document.description.text.split())
    return Program(
        document=document,
        document_name="".join(character if character.isprintable() else "_" for character in path.name),
        name=name,
        class_name=camel_case(name),
        description=description or f"The component {name}.",
        on_error=document.on_error.text.strip() or ON_ERROR[0],
        imports=imports,
        proxies=tuple(
            ProxyProgram(interface.name, interface.identity.strip(), interfaces.find(interface.type)[0])
            for interface in document.interfaces
        ),
        automata=automata,
    )


class _Understanding:
    def __init__(self, path: Path, diagnostics: Diagnostics) -> None:
        self._path = path
        self._diagnostics = diagnostics
        self._methods: dict[str, int] = {}

    def imports(self, document: Document) -> tuple[str, ...]:
        statements: list[str] = []
        for library in document.libraries:
            if library.name.is_blank:
                continue
            found = self._try(analyze_library, library.name)
            if found is None:
                continue
            statement, names = found
            self._refuse_reserved(names, library.name.line)
            if statement not in statements:
                statements.append(statement)
        return tuple(statements)

    def automaton(self, automaton: Automaton) -> AutomatonProgram:
        variables = self._try(lambda text: analyze_block(text, returns=False), automaton.variables)
        shared = variables.bound if variables else frozenset()

        def block(text: Text) -> Code | None:
            return self._try(lambda text: analyze_block(text, shared=shared), text)

        program = AutomatonProgram(
            automaton=automaton,
            period=(milliseconds(automaton.iteration_time) or 0.0) / 1000,
            variables=variables,
            methods=self._add_methods(automaton),
            states=tuple((state, block(state.code)) for state in automaton.states),
            transitions=tuple(
                TransitionProgram(
                    transition=transition,
                    seconds=(
                        (milliseconds(transition.trigger) or 0.0) / 1000
                        if transition.type == "time"
                        else None
                    ),
                    condition=(
                        self._try(analyze_condition, transition.trigger)
                        if transition.type == "condition"
                        else None
                    ),
                    code=block(transition.code),
                )
                for transition in automaton.transitions
            ),
        )
        for piece in (*program.pieces(), *((variables,) if variables else ())):
            self._refuse_reserved(piece.bound, piece.line)
        return program

    def _add_methods(self, automaton: Automaton) -> Code | None:
        found = self._try(analyze_methods, automaton.functions)
        if found is None:
            return None
        code, lines = found
        for name, line in lines.items():
            if name in COMPONENT_ATTRIBUTES or name.startswith("_hfsm"):
                self._error("E523", f"`self.{name}` belongs to every component: rename the function", line)
            elif name in self._methods:
                first = Note("the first is here", Location(self._path, self._methods[name]))
                self._error("E523", f"a second function is called `{name}`", line, first)
            self._methods.setdefault(name, line)
        return code

    def check_methods(self, document: Document) -> None:
        for interface in document.interfaces:
            if interface.name in self._methods:
                note = Note("the function is here", Location(self._path, self._methods[interface.name]))
                message = f"`{interface.name}` is both an interface and a function"
                self._error("E523", message, interface.line, note)

    def _try(self, analyze: Callable[[Text], _T], text: Text) -> _T | None:
        try:
            return analyze(text)
        except CodeError as error:
            self._diagnostics.error(
                "E520", str(error), Location(self._path, error.line, max(1, error.column))
            )
            return None

    def _refuse_reserved(self, names: Iterable[str], line: int) -> None:
        for name in sorted(RESERVED.intersection(names)):
            self._error("E521", f"`{name}` is a name that the component needs: choose another", line)

    def _error(self, code: str, message: str, line: int, *notes: Note) -> None:
        self._diagnostics.error(code, message, Location(self._path, line), notes)
