"""Why a document is not ready: what a verdict says of it, and a refusal to run it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Final, Literal

import msgspec

from codegen.diagnostics import Diagnostics
from codegen.hfsm import read_document
from codegen.hfsm.codes import PROVED
from codegen.hfsm.document import Document
from codegen.messages import Message, joined
from visualhfsm._base.errors import VisualHfsmError

from .imported_places import ImportedPlaces
from .places import Located, Locator, Place, texts_in
from .problems import Problem, problem_of

MOST: Final = 100
"""Reasons, warnings, and steps of a reason, that are listed."""


class Reason(msgspec.Struct, frozen=True, kw_only=True, rename="camel", omit_defaults=True):
    """One thing to fix, who `found` it, and where; `code` is that of an error of the checks.

    `line` is that of the `file`, from 1; `place` is an element of the document, as in its commands, and
    `where` says it in words. `steps` lead there: those of a counterexample, or of the run. `hints` are what
    else is known, and what to do. Texts for people may be `Message`s: `enc_hook=str` writes them.
    """

    found: Literal["checks", "model checker", "run", "survives", "tests"]
    message: str
    code: str = ""
    file: str = ""
    line: int = 0
    state: str = ""
    where: str = ""
    place: Place | None = None
    steps: tuple[str, ...] = ()
    hints: tuple[str, ...] = ()

    @property
    def text(self) -> Message:
        """The reason with file, line, code and place."""
        at = f"{self._at}: " if self._at else ""
        parts = [self.message] if self.message.startswith(at) else [at, self.message]
        if self.code:
            parts.append(f" [{self.code}]")
        if where := self.where or self.state:
            parts += [" (", where, ")"]
        return joined("", parts)

    @property
    def said(self) -> Message:
        """The reason for who draws: first the place in the document, then that in its file."""
        where, at = self.where or self.state, self._at
        if not where or (at and self.message.startswith(at)):
            return self.text
        code = f" [{self.code}]" if self.code else ""
        return joined("", [where, f" ({at})" if at else "", ": ", self.message, code])

    @property
    def _at(self) -> str:
        return f"{self.file}:{self.line}" if self.file and self.line else ""


def summary(reasons: Sequence[Reason], *, terminal: bool = True) -> Message:
    """Return the first reason, what to do about it, and the number of the others.

    What to do may be a command for a `terminal`.
    """
    first, others = reasons[0], len(reasons) - 1
    told = terminal or first.found not in ("run", "survives", "tests")
    hints = [each for each in first.hints if told and "\n" not in each]
    text = joined("; ", [first.said, *hints[:1]])
    return Message("{reason} (and {more} more)", reason=text, more=others) if others else text


def refusal(
    file: Path,
    diagnostics: Diagnostics,
    include: Sequence[Path] = (),
    *,
    document: Document | None = None,
    home: Path | None = None,
) -> VisualHfsmError:
    """Return the error of a document with errors, of which nothing is made, in the words of a verdict.

    The parameters are those of `find`; `file` may be a copy of `home`.
    """
    known = document or read_document(file, Diagnostics()) or Document()
    locator, imports = Locator(known), ImportedPlaces(known, file, include, home=home)
    problems = (problem_of(each, file, locator, imports) for each in diagnostics.errors)
    reasons = [*reasons_of(known, home or file, problems)]
    return VisualHfsmError.because("It is not ready: {message}", message=summary(reasons))


def reasons_of(
    document: Document, file: Path, problems: Iterable[Problem], severity: str = "error"
) -> Iterator[Reason]:
    """Yield the problems of a severity as reasons, with their places in words and as lines of the file."""
    locator = Locator(document)
    lines = {placed.place: placed.line for placed in texts_in(document)}
    states = {(each.id, state.id): state.name for each in document.automata for state in each.states}
    for problem in problems:
        if problem.severity != severity:
            continue
        place, where, line, state = problem.place, problem.where, problem.line, ""
        if place is not None and not problem.file:
            where = locator.name(Located(place, line, problem.column))
            line = lines.get(place, 0) + max(line - 1, 0)
        if place is not None and place.kind == "state":
            state = states.get((place.automaton, place.id), "").strip()
        steps = problem.counterexample.steps[:MOST] if problem.counterexample else ()
        if steps:
            state = states.get((steps[-1].automaton, steps[-1].state), "").strip()
        yield Reason(
            found="model checker" if problem.code in PROVED else "checks",
            message=problem.message,
            code=problem.code,
            file=problem.file or file.name,
            line=line,
            state=state,
            where=where,
            place=place,
            steps=tuple(f"{each.time_ms / 1000:9.3f} s  {each.text}" for each in steps),
            hints=tuple(note for note in problem.notes if not steps or "\n" not in note),
        )
