"""Help with code: the questions to the process that reads it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import msgspec

from codegen.hfsm.document import Document, Text
from codegen.reasons import reason
from visualhfsm._base.errors import VisualHfsmError
from visualhfsm._base.line_process import LineProcess, NoAnswerError
from visualhfsm._document.commands.text import SetText
from visualhfsm._document.places import Place
from visualhfsm._document.problems import UNTITLED
from visualhfsm._document.serialization import written
from zenoh_ice.data import typed

from .protocol import Question, Wanted

_ANSWER_LIMIT: Final = 4.0
"""Limit of the time of an answer, in seconds."""
_FIRST: Final = 5
"""Factor of that limit for the first answer of a process, which reads everything that the code imports."""
_LONGEST_CODE: Final = 200_000
"""Limit of the length of a piece of code, in characters."""


class CodeHelp:
    """Answers questions about code in a process.

    It is one because all that code imports is read for an answer, which may take long or any amount of
    memory; none of it is run. It is started on first use. `include` are directories with packages of
    interfaces, `folder` is that of documents without a file, by default the current one. Thread-safe: callers
    wait for their turn.
    """

    def __init__(
        self, patience: float = _ANSWER_LIMIT, include: Sequence[Path] = (), folder: Path | None = None
    ) -> None:
        self._patience = patience
        self._folder = folder or Path.cwd()
        self._include = tuple(map(str, include))
        self._process = LineProcess(f"{__package__}.worker")
        self._is_warm = False
        self._context: tuple[Document, Place, str] | None = None

    def ask(
        self,
        wanted: Wanted,
        document: Document,
        path: Path | None,
        place: Place,
        code: str,
        *,
        line: int = 1,
        column: int = 0,
    ) -> Any:  # noqa: ANN401
        """Answer a question about a piece of code, in JSON; `line` counts from 1, `column` from 0.

        `path` is the file of the document, if it has one. `wanted` is `complete`: completions, best first;
        `explain`: explanation of the name at the position; `signature`: the parameters of the call around it.
        None when there is no answer. Raises VisualHfsmError.
        """
        if len(code) > _LONGEST_CODE:
            return None
        text = self._context_of(document, place)
        file = path or self._folder / UNTITLED
        return self._answer(Question(wanted, text, str(file), place, code, line, column, self._include))

    def interfaces(self, folder: Path) -> Any:  # noqa: ANN401
        """Return the interfaces that documents in a folder may declare, with operations and documentation.

        Raises VisualHfsmError.
        """
        return self._answer(Question("interfaces", path=str(folder / UNTITLED), include=self._include))

    def close(self) -> None:
        """End the process."""
        self._process.close()

    def _answer(self, question: Question) -> Any:  # noqa: ANN401
        patience = self._patience * (1 if self._is_warm else _FIRST)
        try:
            line = self._process.ask(msgspec.json.encode(question), patience)
        except UnicodeEncodeError as error:
            raise VisualHfsmError.because("no help with this code: {reason}", reason=reason(error)) from error
        except NoAnswerError as error:
            self._is_warm = False
            raise VisualHfsmError.because("no help with this code: {reason}", reason=reason(error)) from error
        self._is_warm = True
        return typed.from_json(line)

    def _context_of(self, document: Document, place: Place) -> str:
        """Return the text around a piece of code; it is the same while the piece is typed."""
        context = self._context
        if context is None or context[0] is not document or context[1] != place:
            around = SetText(place=place, text="").apply(_around(document, place))
            context = document, place, written(around)
            self._context = context
        return context[2]


def _around(document: Document, place: Place) -> Document:
    """Return a document with the automaton of a place and those above, and of others only what it may use."""
    edited = document.automaton(place.automaton)
    kept = set() if edited is None else {edited.id, *(each.id for each in document.above(edited))}
    automata = tuple(
        each if each.id in kept else replace(each, states=(), transitions=(), variables=Text())
        for each in document.automata
    )
    return replace(document, automata=automata, properties=())
