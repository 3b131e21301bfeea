"""Find the Python 2 in a document, piece by piece, and mend it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from codegen.diagnostics import Diagnostics, Location, Note

from ...document import Automaton, Document, Library, State, Text, Transition
from ..pieces import pieces_of
from .mending import Finding, find_divisions, find_python2, mend, names_in

__all__ = ["mend_document", "report_python2"]

_IMPORT = "import "


def report_python2(document: Document, path: Path, diagnostics: Diagnostics) -> None:
    """Warn of each thing in the code of a document that is Python 2."""
    _Mender(document, path, diagnostics, mends=False).document()


def mend_document(document: Document, path: Path, diagnostics: Diagnostics) -> Document:
    """Return the document with its Python 2 mended, telling each thing that was.

    A piece of code that is not valid after that stays as it is, with warnings.
    """
    return _Mender(document, path, diagnostics, mends=True).document()


class _Mender:
    def __init__(self, document: Document, path: Path, diagnostics: Diagnostics, *, mends: bool) -> None:
        self._document = document
        self._path = path
        self._diagnostics = diagnostics
        self._mends = mends
        pieces = (names_in(piece.text.text) for piece in pieces_of(document, path))
        self._bound = frozenset[str]().union(*pieces)

    def document(self) -> Document:
        document = self._document
        return replace(
            document,
            automata=tuple(self._automaton(automaton) for automaton in document.automata),
            libraries=tuple(self._library(library) for library in document.libraries),
        )

    def _automaton(self, automaton: Automaton) -> Automaton:
        return replace(
            automaton,
            states=tuple(self._state(state) for state in automaton.states),
            transitions=tuple(self._transition(transition) for transition in automaton.transitions),
            variables=self._code(automaton.variables),
            functions=self._code(automaton.functions),
        )

    def _state(self, state: State) -> State:
        entry, code = self._code(state.entry), self._code(state.code)
        arguments = tuple(replace(each, value=self._code(each.value)) for each in state.arguments)
        return replace(state, entry=entry, code=code, exit=self._code(state.exit), arguments=arguments)

    def _transition(self, transition: Transition) -> Transition:
        trigger = transition.trigger
        return replace(
            transition,
            trigger=self._code(trigger) if transition.type == "condition" else trigger,
            guard=self._code(transition.guard),
            code=self._code(transition.code),
        )

    def _library(self, library: Library) -> Library:
        """Mend a module's name, which becomes `queue as Queue` where that was `Queue`."""
        name = library.name
        if not library.is_module or name.text.lstrip().startswith(("from ", _IMPORT)):
            return replace(library, name=self._code(name)) if library.is_module else library
        mended = self._code(replace(name, text=_IMPORT + name.text, column=name.column - len(_IMPORT)))
        return replace(library, name=replace(name, text=mended.text.removeprefix(_IMPORT)))

    def _code(self, text: Text) -> Text:
        """Return a piece of code mended, if it is to be and can be, after telling what is wrong with it."""
        findings = () if text.is_blank else find_python2(text.text, self._bound)
        if not findings:
            return text
        mended = mend(text.text, self._bound)
        divisions = [Note(each.message, self._place(text, each)) for each in find_divisions(text.text)]
        for finding in findings:
            place = self._place(text, finding)
            if self._mends and mended is not None:
                self._diagnostics.note("N503", f"mended: {finding.message}", place, divisions)
            else:
                how = "`visualhfsm convert --mend-python2` mends it"
                if mended is None:
                    how = "more than this is wrong with the code, so it has to be mended by hand"
                message = f"Python 2: {finding.message}"
                self._diagnostics.warning("W506", message, place, [Note(how), *divisions])
            divisions = []
        return text if mended is None or not self._mends else replace(text, text=mended)

    def _place(self, text: Text, finding: Finding) -> Location:
        left = text.column - 1 if finding.line == 1 else 0
        return Location(self._path, text.line + finding.line - 1, max(1, left + finding.column))
