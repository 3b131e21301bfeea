"""Help with code, as the server requests it."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import msgspec

from codegen.hfsm.document import Document, Text
from visualhfsm.child import LineProcess, NoAnswerError
from visualhfsm.editing.commands.text import with_code
from visualhfsm.editing.places import Place
from visualhfsm.editing.serialization import written
from visualhfsm.errors import VisualHfsmError
from visualhfsm.services import Source, retrieve

from .question import Question, Wanted

_PATIENCE: Final = 4.0
"""Limit of the time of an answer, in seconds."""
_FIRST: Final = 5
"""Factor of that limit for the first answer of a process, which reads everything that the code imports."""
_UNTITLED: Final = "untitled.xml"
_LARGEST: Final = 200_000
"""Limit of the length of a piece of code, in characters."""


class CodeHelper:
    """Answers questions about code in two processes, so that no check delays completion.

    Of several questions of a kind that arrive while one is being answered, only the newest waits; the others
    get None at once. `include` are directories with packages of interfaces.
    """

    def __init__(self, patience: float = _PATIENCE, include: Sequence[Path] = ()) -> None:
        self._patience = patience
        self._include = tuple(map(str, include))
        self._desks = {wanted: _Desk() for wanted in ("complete", "explain", "signature", "lint")}
        self._interfaces: asyncio.Task[Any] | None = None
        self._reading = LineProcess(f"{__package__}.worker")
        self._checking = LineProcess(f"{__package__}.worker")
        self._warm: set[LineProcess] = set()
        self._context: tuple[Document, Place, str] | None = None

    async def ask(
        self, wanted: Wanted, source: Source, place: Place, code: str, *, line: int = 1, column: int = 0
    ) -> Any:  # noqa: ANN401
        """Answer a question about a piece of code; `line` counts from 1, `column` from 0.

        `wanted` is `complete`: completions, best first; `explain`: explanation of the name at the position;
        `signature`: the parameters of the call around it; `lint`: problems of the code. None when there is no
        answer, or when a newer question has replaced this one. Raises VisualHfsmError.
        """
        if len(code) > _LARGEST:
            return None
        if wanted == "lint":
            document = written(with_code(_around(source.document, place), place, code))
        else:
            document = self._context_of(source.document, place)
        path = source.path or Path.cwd() / _UNTITLED
        desk = self._desks[wanted]
        if not await desk.enter():
            return None
        try:
            question = Question(wanted, document, str(path), place, code, line, column, self._include)
            return await self._answer(question)
        finally:
            desk.leave()

    async def interfaces(self, folder: Path) -> Any:  # noqa: ANN401
        """Return the interfaces that documents in a folder may declare, with operations and documentation."""
        if self._interfaces is None or self._interfaces.done():
            question = Question("interfaces", path=str(folder / _UNTITLED), include=self._include)
            self._interfaces = asyncio.create_task(self._answer(question))
            self._interfaces.add_done_callback(retrieve)
        return await asyncio.shield(self._interfaces)

    async def close(self) -> None:
        """End the processes."""
        await asyncio.to_thread(self._close)

    def _close(self) -> None:
        self._reading.close()
        self._checking.close()

    async def _answer(self, question: Question) -> Any:  # noqa: ANN401
        process = self._checking if question.wanted == "lint" else self._reading
        patience = self._patience * (1 if process in self._warm else _FIRST)
        try:
            line = await asyncio.to_thread(process.ask, msgspec.json.encode(question), patience)
        except NoAnswerError as error:
            self._warm.discard(process)
            raise VisualHfsmError(f"no help with this code: {error}") from error
        self._warm.add(process)
        return msgspec.json.decode(line)

    def _context_of(self, document: Document, place: Place) -> str:
        """Return the text around a piece of code; it is the same while the piece is typed."""
        if self._context is None or self._context[0] is not document or self._context[1] != place:
            self._context = document, place, written(with_code(_around(document, place), place, ""))
        return self._context[2]


class _Desk:
    """A queue for questions of one kind, one at a time; a newer question replaces the one that waits."""

    def __init__(self) -> None:
        self._busy = False
        self._waiting: asyncio.Future[bool] | None = None

    async def enter(self) -> bool:
        """Wait for the turn; return False when a newer question took it, else `leave` must be called."""
        if self._waiting is not None and not self._waiting.done():
            self._waiting.set_result(False)
        if not self._busy:
            self._busy = True
            return True
        waiting: asyncio.Future[bool] = asyncio.get_running_loop().create_future()
        self._waiting = waiting
        try:
            return await waiting
        except asyncio.CancelledError:
            if not waiting.cancelled() and waiting.result():  # the turn came in the same moment
                self.leave()
            raise

    def leave(self) -> None:
        """Pass the turn to the question that waits, if any."""
        waiting, self._waiting = self._waiting, None
        if waiting is None or waiting.done():
            self._busy = False
        else:
            waiting.set_result(True)


def _around(document: Document, place: Place) -> Document:
    """Return a document with the automaton of a place, and only the parts of others that it may use."""
    automata = tuple(
        each if each.id == place.automaton else replace(each, states=(), transitions=(), variables=Text())
        for each in document.automata
    )
    return replace(document, automata=automata, properties=())
