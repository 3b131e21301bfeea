"""Problems of a document as it would be saved now, with the places to jump to.

The editor never waits for a check: `CheckProcess` runs this module as a separate process.
"""

from __future__ import annotations

import signal
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Final, Literal

import msgspec

from codegen.diagnostics import Diagnostic, Diagnostics, Location, Note, Severity
from codegen.hfsm.codes import FOLLOWED, PROVED, Code
from codegen.hfsm.document import Document
from codegen.hfsm.loading import check_pieces, explore_document, load_checked
from codegen.messages import NO_MESSAGE, Message
from visualhfsm._base.errors import EditError
from visualhfsm._base.languages import encode_message
from visualhfsm._base.line_process import answer_lines
from zenoh_ice.data import typed

from .imported_places import ImportedPlaces, shown_path
from .parts import Parts
from .places import Locator, Place

if TYPE_CHECKING:
    from codegen.hfsm.model_checker import ModelReport  # the editor leaves it to its process for checks
    from codegen.hfsm.model_checker.properties import PropertyResult

_MOST_PROBLEMS: Final = 1000
"""Problems that are listed whatever they are about; more are usually repetitions of one."""
_MOST_STEPS: Final = 2000
"""Steps of a counterexample that are sent; longer ones are in the notes."""
_VIOLATED: Final = Code.VIOLATED_PROPERTY
_NO_STATE: Final = Code.NO_STATE
_ORDER: Final = {"error": 0, "warning": 1, "note": 2}
UNTITLED: Final = "untitled.xml"
"""The name of a document that has no file."""
GIVE_UP: Final = signal.SIGUSR1
"""Ends the search of the model checker in the process that checks."""


class StepView(msgspec.Struct, frozen=True, kw_only=True, rename="camel", omit_defaults=True):
    """A step of a run, as `CounterexampleStep` of the model checker; the rest are ids of the document."""

    time_ms: float
    automaton: int
    kind: str
    text: Message
    state: int
    origin: int | None = None
    transition: int | None = None


class CounterexampleView(msgspec.Struct, frozen=True, kw_only=True, rename="camel", omit_defaults=True):
    """The steps until a property is violated; from the index `repeats` on they may go on forever.

    It is a run only if the `guards` ever hold.
    """

    steps: tuple[StepView, ...]
    repeats: int | None = None
    guards: tuple[str, ...] = ()


class Misspelt(msgspec.Struct, frozen=True, kw_only=True, rename="camel", omit_defaults=True):
    """The `name` that is written at a place, and the one that is probably meant.

    At an element as a whole it is the value of a `field`.
    """

    name: str
    meant: str
    field: str = ""


class Problem(msgspec.Struct, frozen=True, kw_only=True, rename="camel", omit_defaults=True):
    """One thing that is wrong, doubtful or worth knowing: `error`, `warning` or `note`.

    Line, column and length are those in the text at the place; both count from 1, line 0 means the element as
    a whole. Without a place it is about the document, or about another `file`. The path of an imported file
    is that from the folder of the document. There, the place is that of the automaton in the document;
    `source` is that in the file, in words `where`, `copies` are further places, of an automaton that is
    imported several times, and `owners` the states that own the imported automata. A violated property has a
    `counterexample`, a name that is probably another one is `misspelt`, one that is defined by a `library` of
    that statement lacks it. `assumes` says what the problem holds under, if it is not true in any case.
    """

    code: str
    severity: Severity
    message: Message
    notes: tuple[Message, ...] = ()
    place: Place | None = None
    line: int = 0
    column: int = 0
    length: int = 0
    file: str = ""
    source: Place | None = None
    where: Message = NO_MESSAGE
    copies: tuple[Place, ...] = ()
    owners: tuple[Place, ...] = ()
    counterexample: CounterexampleView | None = None
    misspelt: Misspelt | None = None
    library: str = ""
    assumes: Message = NO_MESSAGE


class Proof(msgspec.Struct, frozen=True, kw_only=True, rename="camel", omit_defaults=True):
    """What the model checker found out about a property: it holds in all runs, or a run violates it.

    `undecided` means that there are more configurations than it explores, `invalid` that it is no property,
    as a problem says. A property that is violated has a counterexample.
    """

    name: str
    kind: str
    expression: str
    verdict: Literal["holds", "violated", "undecided", "invalid"]
    counterexample: CounterexampleView | None = None


class Findings(msgspec.Struct, frozen=True, kw_only=True):
    """The problems of a document, by severity, and the verdict on each of its properties, in their order.

    Of very many, the first 1,000 and the worst of each piece are listed; `counts` has the number of all by
    severity. `proofs` is None if the model checker did not run, after errors or because it took too long. The
    findings are not `complete` while problems of some codes are `pending`, which take longer.
    """

    problems: tuple[Problem, ...] = ()
    counts: Mapping[Severity, int] = {}
    proofs: tuple[Proof, ...] | None = None
    pending: frozenset[str] = frozenset()

    @property
    def complete(self) -> bool:
        """Whether all is known."""
        return not self.pending


def find(
    document: Document | None,
    file: Path,
    diagnostics: Diagnostics,
    include: Sequence[Path] = (),
    *,
    limit: int | None = None,
    most: int | None = _MOST_PROBLEMS,
) -> Iterator[Findings]:
    """Yield what is found in each piece of code, what follows from all of them together, and all.

    `diagnostics` has what was found when the document was read from a text that its places refer to. The
    first `most` problems are listed, and the worst of each piece. The model checker explores up to `limit`
    configurations, by default as many as `check_document`: `CheckProcess` does so in another process.
    """
    checked = None
    if document is not None and not diagnostics.has_errors:
        checked = check_pieces(file, None, diagnostics, include, document=document)
    locator = Locator(document or Document())
    imports = ImportedPlaces(document or Document(), file, include)

    def findings(report: ModelReport | None = None, pending: frozenset[str] = frozenset()) -> Findings:
        reported = (each for each in diagnostics if each.code != _NO_STATE or not _is_blank(document))
        found = sorted(reported, key=lambda each: _ORDER[each.severity])
        problems = (_with_steps(problem_of(each, file, locator, imports), report) for each in found)
        return Findings(
            problems=tuple(problems if most is None else _listed(problems, most)),
            counts=Counter(each.severity for each in found),
            proofs=None if report is None else tuple(map(_proof, report.properties)),
            pending=pending,
        )

    if checked is not None:
        yield findings(pending=FOLLOWED | PROVED)
    loaded = None if checked is None else load_checked(checked, diagnostics)
    if loaded is None:
        yield findings()
        return
    yield findings(pending=PROVED)
    yield findings(explore_document(loaded, file, diagnostics, limit=limit))


def _listed(problems: Iterable[Problem], most: int) -> Iterator[Problem]:
    """Yield the first problems, and the first of each further element or piece of code, which shows it."""
    seen: set[object] = set()
    for number, each in enumerate(problems):
        places = (each.place, *each.copies, *each.owners)
        about = {(at.kind, at.automaton, at.id, at.part, at.index) for at in places if at is not None}
        if number < most or not about <= seen:
            yield each
        seen |= about


def _is_blank(document: Document | None) -> bool:
    """Return whether nothing was drawn yet; missing states are then not reported."""
    return document is not None and not any(each.states or each.imported for each in document.automata)


def _with_steps(problem: Problem, report: ModelReport | None) -> Problem:
    """Return the problem of a violated property with the steps that violate it."""
    place = problem.place
    if problem.code != _VIOLATED or place is None or place.part != "properties" or report is None:
        return problem
    return msgspec.structs.replace(problem, counterexample=_view(report.properties[place.index]))


def _proof(result: PropertyResult) -> Proof:
    stated = result.property
    return Proof(
        name=stated.name.strip(),
        kind=stated.kind.strip(),
        expression=stated.expression.text,
        verdict=result.verdict.value,
        counterexample=_view(result),
    )


def _view(result: PropertyResult) -> CounterexampleView | None:
    found = result.counterexample
    if found is None or len(found.steps) > _MOST_STEPS:
        return None
    return typed.convert(found, CounterexampleView, from_attributes=True)


def problem_of(found: Diagnostic, file: Path, locator: Locator, imports: ImportedPlaces) -> Problem:
    """Return what was found in a document, or in what it imports, with the place that the locator knows."""
    location = found.location
    notes = tuple(
        Message("{note} ({place})", note=note.message, place=_where(note.location, file, locator, imports))
        if note.location
        else note.message
        for note in found.notes
    )
    problem = Problem(
        code=found.code,
        severity=found.severity,
        message=found.message,
        notes=notes,
        length=location.length,
        misspelt=next(filter(None, map(_misspelt, found.notes)), None),
        library=next((note.library for note in found.notes if note.library), ""),
        assumes=found.assumes,
    )
    if location.path != file:
        return _elsewhere(problem, location, imports)
    located = locator.find(location.line, location.column) if location.line else None
    if located is None:
        return problem
    place, line, column = located
    importing = imports.whole.automaton(place.automaton) if place.kind == "automaton" else None
    owners = () if importing is None else imports.owners(importing)
    return msgspec.structs.replace(problem, place=place, line=line, column=column, owners=owners)


def _misspelt(note: Note) -> Misspelt | None:
    return None if note.misspelt is None else typed.convert(note.misspelt, Misspelt, from_attributes=True)


def _elsewhere(problem: Problem, location: Location, imports: ImportedPlaces) -> Problem:
    """Return a problem with its place in another file, and in the document if that imports it."""
    found = imports.find(location.path, location.line, location.column)
    if found is None or found.source is None:
        problem = msgspec.structs.replace(problem, line=location.line, column=location.column)
        if found is None:
            return msgspec.structs.replace(problem, file=str(location.path))
        place = found.owners[0] if found.owners else None
        return msgspec.structs.replace(problem, file=found.file, place=place, owners=found.owners)
    place, *copies = found.places or (found.owners or (None,))[:1]
    return msgspec.structs.replace(
        problem,
        place=place,
        copies=tuple(each for each in copies if each is not None),
        owners=found.owners,
        file=found.file,
        source=found.source.place,
        where=found.name,
        line=found.source.line,
        column=found.source.column,
    )


def _where(location: Location, file: Path, locator: Locator, imports: ImportedPlaces) -> Message:
    """Return the place of a note in words: in this document, or in another file."""
    if location.path == file:
        located = locator.find(location.line, location.column) if location.line else None
        return locator.name(located) if located else Message("in this document")
    name = shown_path(location.path, file)
    found = imports.find(location.path, location.line, location.column)
    if found is not None and found.name:
        return Message("{file}: {place}", file=name, place=found.name)
    if location.line:
        return Message("{file}, line {line}", file=name, line=location.line)
    return Message.verbatim(name)


class Question(msgspec.Struct, frozen=True):
    """The parts of a document to check, and the other parameters of `find`, which `ProblemsAnswer`s answer.

    On GIVE_UP, the last of them says what was found until then.
    """

    parts: list[msgspec.Raw]
    path: str
    include: list[str]
    limit: int | None


class ProblemsAnswer(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """What was found so far, or why a document cannot be written, and what to do."""

    found: Findings = Findings()
    is_last: bool = False
    refused: tuple[Message, ...] = ()


class _GivenUp(BaseException):
    """A search is given up; no code of ours takes this for an error."""


def _answers(parts: Parts, line: bytes) -> Iterator[bytes]:
    question = typed.from_json(line, Question)
    signal.sigtimedwait({GIVE_UP}, 0)  # one that came too late means an earlier question
    diagnostics = Diagnostics(decoded=True)
    path, include = Path(question.path), [Path(directory) for directory in question.include]
    try:
        document = parts.read(question.parts, path, diagnostics)
    except EditError as error:
        yield _encoded(ProblemsAnswer(is_last=True, refused=(error.what, error.why, error.hint)))
        return
    findings = find(document, path, diagnostics, include, limit=question.limit)
    found = next(findings)
    try:
        while not found.complete:
            yield _encoded(ProblemsAnswer(found=found))
            signal.pthread_sigmask(signal.SIG_UNBLOCK, {GIVE_UP})
            found = next(findings)
            signal.pthread_sigmask(signal.SIG_BLOCK, {GIVE_UP})
    except _GivenUp:
        pass
    yield _encoded(ProblemsAnswer(found=found, is_last=True))


def _encoded(answer: ProblemsAnswer) -> bytes:
    return msgspec.json.encode(answer, enc_hook=encode_message)


def _give_up(*_: object) -> None:
    signal.pthread_sigmask(signal.SIG_BLOCK, {GIVE_UP})
    raise _GivenUp


if __name__ == "__main__":
    signal.pthread_sigmask(signal.SIG_BLOCK, {GIVE_UP})
    signal.signal(GIVE_UP, _give_up)
    answer_lines(partial(_answers, Parts()))
