"""Help for who types code: what the server asks for."""

from __future__ import annotations

import asyncio
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import msgspec

from codegen.hfsm.document import Automaton, Document, Text
from visualhfsm.editing.commands import Command
from visualhfsm.editing.commands.automata import SetAutomatonCode
from visualhfsm.editing.commands.states import SetArgument, SetStateCode
from visualhfsm.editing.commands.transitions import SetTransitionCode
from visualhfsm.editing.fragments import written
from visualhfsm.editing.places import Place
from visualhfsm.errors import VisualHfsmError
from visualhfsm.line_process import LineProcess, NoAnswerError
from visualhfsm.web.services import ServiceError, Source

from .worker import Question, Wanted

__all__ = ["CodeHelper"]

_PATIENCE: Final = 4.0
"""Seconds that an answer may take."""
_FIRST: Final = 5
"""How many times as long the first answer of a process may take: it reads all that the code imports."""
_UNTITLED: Final = "untitled.xml"
_LARGEST: Final = 200_000
"""Characters of a piece of code for which there is help."""


class CodeHelper:
    """Implements `visualhfsm.web.services.CodeHelp` with two processes, so that no check delays completion.

    Of several questions of a kind that come while one is being answered only the newest is asked; the others
    get nothing.
    """

    def __init__(self, patience: float = _PATIENCE) -> None:
        self._patience = patience
        self._desks = {kind: _Desk() for kind in ("complete", "explain", "signature", "lint", "interfaces")}
        self._reading = LineProcess(f"{__package__}.worker")
        self._checking = LineProcess(f"{__package__}.worker")
        self._warm: set[LineProcess] = set()
        self._context: tuple[Document, Place, str] | None = None

    async def complete(self, source: Source, place: Place, code: str, line: int, column: int) -> Any:  # noqa: ANN401
        """Return what could follow, best first."""
        found = await self._ask("complete", source, place, code, (line, column))
        return found or {"typed": 0, "options": []}

    async def explain(self, source: Source, place: Place, code: str, line: int, column: int) -> Any:  # noqa: ANN401
        """Return what the name at a position stands for, None when there is nothing to say."""
        return await self._ask("explain", source, place, code, (line, column))

    async def signature(self, source: Source, place: Place, code: str, line: int, column: int) -> Any:  # noqa: ANN401
        """Return the parameters of the call around the cursor, None outside of calls."""
        return await self._ask("signature", source, place, code, (line, column))

    async def lint(self, source: Source, place: Place, code: str) -> Any:  # noqa: ANN401
        """Return what is wrong with a piece of code as it is being typed."""
        return await self._ask("lint", source, place, code) or []

    async def interfaces(self) -> Any:  # noqa: ANN401
        """Return the interfaces that a document may declare, with operations and documentation."""
        return await self._answer(Question("interfaces"))

    async def close(self) -> None:
        """End the processes."""
        await asyncio.to_thread(self._close)

    def _close(self) -> None:
        self._reading.close()
        self._checking.close()

    async def _ask(
        self, wanted: Wanted, source: Source, place: Place, code: str, at: tuple[int, int] = (1, 0)
    ) -> Any:  # noqa: ANN401
        if len(code) > _LARGEST:
            return None
        try:
            if wanted == "lint":
                document = written(_with_code(_around(source.document, place), place, code))
            else:
                document = self._context_of(source.document, place)
        except VisualHfsmError as error:
            raise ServiceError(str(error)) from error
        path = source.path or Path.cwd() / _UNTITLED
        return await self._answer(Question(wanted, document, str(path), place, code, *at))

    async def _answer(self, question: Question) -> Any:  # noqa: ANN401
        process = self._checking if question.wanted == "lint" else self._reading
        async with self._desks[question.wanted].turn() as is_newest:
            if not is_newest:
                return None
            patience = self._patience * (1 if process in self._warm else _FIRST)
            try:
                line = await asyncio.to_thread(process.ask, msgspec.json.encode(question), patience)
            except NoAnswerError as error:
                self._warm.discard(process)
                raise ServiceError(f"no help with this code: {error}") from error
            self._warm.add(process)
        return msgspec.json.decode(line)

    def _context_of(self, document: Document, place: Place) -> str:
        """Return the text of what is around a piece of code; it is the same while the piece is typed."""
        if self._context is None or self._context[0] is not document or self._context[1] != place:
            self._context = document, place, written(_with_code(_around(document, place), place, ""))
        return self._context[2]


class _Desk:
    """Where questions of one kind wait; only the newest of them gets its turn."""

    def __init__(self) -> None:
        self._lock = asyncio.Lock()
        self._newest = 0

    def turn(self) -> _Turn:
        """Return a turn; the number tells whether a newer one has come while it waited."""
        self._newest += 1
        return _Turn(self, self._newest)


class _Turn:
    def __init__(self, desk: _Desk, number: int) -> None:
        self._desk = desk
        self._number = number

    async def __aenter__(self) -> bool:
        await self._desk._lock.acquire()
        return self._number == self._desk._newest

    async def __aexit__(self, *_: object) -> None:
        self._desk._lock.release()


def _around(document: Document, place: Place) -> Document:
    """Return a document with the automaton of a place, and of the others only what it may use."""
    automata = tuple(
        each if each.id == place.automaton else _functions_of(each) for each in document.automata
    )
    return replace(document, automata=automata, properties=())


def _functions_of(automaton: Automaton) -> Automaton:
    return replace(automaton, states=(), transitions=(), variables=Text())


def _with_code(document: Document, place: Place, code: str) -> Document:
    """Return a document with another text for a piece of code; raises EditError when there is none such."""
    return _command(place, code).apply(document)


def _command(place: Place, code: str) -> Command:
    where: dict[str, Any] = {"automaton": place.automaton}
    match place.kind, place.part:
        case "state", "argument":
            return SetArgument(**where, state=place.id, name=place.name, value=code, child=place.child)
        case "state", "entry" | "code" | "exit" as part:
            return SetStateCode(**where, state=place.id, part=part, text=code)
        case "transition", "trigger" | "guard" | "fired" as part:
            return SetTransitionCode(**where, transition=place.id, part=part, text=code)
        case "automaton", "variables" | "functions" as part:
            return SetAutomatonCode(**where, part=part, text=code)
    raise ServiceError(f"there is no code in the {place.part or 'whole'} of a {place.kind}")
