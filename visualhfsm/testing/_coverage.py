"""Coverage of automata in a run of pytest: states entered, transitions fired, guards seen true and false.

`Hits` counts while behaviors run; `CoverageSession` adds up the counts of xdist's workers, and the lines of
code that ran if they are measured, compares them with the contents of the documents, and prints a table and
the gaps.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import pytest

from codegen.files import is_regular
from codegen.hfsm.document import Automaton, Document
from codegen.hfsm.formats.reader import looks_like_document
from hfsm_runtime import Transition
from hfsm_runtime.observer import Observer
from hfsm_runtime.tree import Actor, ChangeKind, Tree
from visualhfsm._document.places import Located, Locator, texts_in
from visualhfsm.simulation._loading import DocumentInvalid, read

from ._lines import Lines

_OUTPUT: Final = "hfsm_coverage"
_OUTPUT_OF_LINES: Final = "hfsm_lines"

_Key = tuple[str, int, str, int]
"""The absolute path of a document, the id of an automaton, the kind of hit, and the id of the state or
transition that was hit."""

_Code = tuple[str, str, int, int, str, str, int]
"""The absolute path of a document, and the place of a piece of its code, as xdist can send it."""


class Hits(Counter[_Key]):
    """Counts of states `entered`, transitions `fired`, and guards `true` and `false`."""

    def watch(self, document: Callable[[], Path | None], tree: Tree) -> None:
        """Count what automata do from now on; their current states count as entered.

        `document` returns their file, which changes with a reload.
        """
        counter = _Counter(self, document)
        for run in tree.actors:
            if run.active:
                counter.changed(0, run, ChangeKind.ENTERED)
        tree.observers.append(counter)


class _Counter(Observer):
    def __init__(self, counts: Counter[_Key], document: Callable[[], Path | None]) -> None:
        self._counts = counts
        self._document = document

    def guard_evaluated(self, run: Actor, transition: Transition, value: bool, at: int) -> None:  # noqa: ARG002
        self._count(run, "true" if value else "false", transition.id)

    def fired(self, run: Actor, transition: Transition, at: int) -> None:  # noqa: ARG002
        self._count(run, "fired", transition.id)

    def changed(self, now: int, run: Actor, kind: ChangeKind) -> None:  # noqa: ARG002
        if kind is ChangeKind.ENTERED:
            self._count(run, "entered", run.current.id)

    def _count(self, run: Actor, what: str, id: int) -> None:
        document = str((self._document() or Path()).resolve())
        self._counts[document, run.automaton.id, what, id] += 1


@dataclass
class _Covered:
    """Which states, transitions, values of guards and lines were hit.

    `missing` has the places of the others.
    """

    name: str
    states: list[bool] = field(default_factory=list)
    transitions: list[bool] = field(default_factory=list)
    guards: list[bool] = field(default_factory=list)
    lines: list[bool] = field(default_factory=list)
    missing: list[str] = field(default_factory=list)

    @property
    def all(self) -> list[bool]:
        return self.states + self.transitions + self.guards + self.lines

    @property
    def percent(self) -> float:
        return 100.0 * sum(self.all) / len(self.all) if self.all else 100.0

    def add(self, other: _Covered) -> None:
        self.states += other.states
        self.transitions += other.transitions
        self.guards += other.guards
        self.lines += other.lines
        self.missing += other.missing


class CoverageSession:
    """Count what behaviors do in this process, and report the coverage: a plugin of pytest."""

    def __init__(self, config: pytest.Config, lines: Lines | None) -> None:
        self.hits: Final = Hits()
        self._lines: Final = lines
        self._code: Final[dict[_Code, tuple[set[int], set[int]]]] = {}
        """Of each piece of code the lines that it has, and those that ran."""
        self._config: Final = config
        self._root: Final = config.rootpath.resolve()
        self._documents: Final = self._read_documents()
        self._least: Final[float | None] = config.getoption("--hfsm-cov-fail-under")
        self._covered: list[_Covered] | None = None
        self._unmeasured: Final[list[str]] = []
        self._total: Final = _Covered("total")

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Add the lines that ran in a test."""
        if self._lines is None or report.when != "call":
            return
        for code in self._lines.pieces():
            place = code.place
            key = place.kind, place.automaton, place.id, place.part, place.name, place.child
            self._add_lines((code.document, *key), code.lines, code.ran)
        if self._lines.unmeasured and self._lines.unmeasured not in self._unmeasured:
            self._unmeasured.append(self._lines.unmeasured)

    def pytest_sessionfinish(self, session: pytest.Session) -> None:
        """Send the counts of a worker, or merge all counts and fail when the coverage is too low."""
        output: dict[str, Any] | None = getattr(self._config, "workeroutput", None)
        if output is not None:  # a worker of xdist
            output[_OUTPUT] = dict(self.hits)
            output[_OUTPUT_OF_LINES] = [(key, [*there], [*ran]) for key, (there, ran) in self._code.items()]
            return
        self._covered = [self._cover(file, document) for file, document in self._documents.items()]
        for each in self._covered:
            self._total.add(each)
        if self._too_little and session.exitstatus == pytest.ExitCode.OK:
            session.exitstatus = pytest.ExitCode.TESTS_FAILED

    @pytest.hookimpl(optionalhook=True)
    def pytest_testnodedown(self, node: Any, error: object) -> None:  # noqa: ANN401, ARG002 - of xdist
        """Add the counts of a worker."""
        output = getattr(node, "workeroutput", {})
        self.hits.update(output.get(_OUTPUT, {}))
        for key, there, ran in output.get(_OUTPUT_OF_LINES, ()):
            self._add_lines(key, there, ran)

    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter) -> None:
        """Print the table, the gaps, and whether the coverage is too low."""
        if self._covered is None:
            return
        terminalreporter.section("coverage of automata")
        for line, missing in _table(self._covered, self._total, lines=self._lines is not None):
            terminalreporter.write_line(line, red=missing)
        for why in self._unmeasured:
            terminalreporter.write_line(f"lines were not measured: {why}", red=True)
        if self._too_little:
            terminalreporter.write_line(
                f"FAIL: {self._total.percent:.1f} % of the automata is covered, "
                f"less than the required {self._least:g} %",
                red=True,
                bold=True,
            )

    @property
    def _too_little(self) -> bool:
        return self._least is not None and self._total.percent < self._least

    def _read_documents(self) -> dict[Path, Document]:
        base = self._config.invocation_params.dir
        try:
            paths = [base / path for path in self._config.getoption("--hfsm-cov")]
            return {file: read(file) for file in dict.fromkeys(_files(paths))}
        except (DocumentInvalid, OSError) as error:
            raise pytest.UsageError(str(error)) from error

    def _cover(self, file: Path, document: Document) -> _Covered:
        covered = _Covered(self._shown(file))
        names = {each.id: _path(document, each) or file.stem for each in document.automata}
        for each in document.automata:
            name = names[each.id]
            several = list(names.values()).count(name) > 1
            self._cover_automaton(covered, file, each, f"{name} ({each.id})" if several else name)
        if self._lines is not None:
            self._cover_lines(covered, file, document)
        return covered

    def _add_lines(self, key: _Code, there: Iterable[int], ran: Iterable[int]) -> None:
        known = self._code.setdefault(key, (set(), set()))
        known[0].update(there)
        known[1].update(ran)

    def _cover_lines(self, covered: _Covered, file: Path, document: Document) -> None:
        """Add the lines of the code of a document that some test ran."""
        missing = []
        locator = Locator(document)
        for placed in texts_in(document):
            place = placed.place
            key = place.kind, place.automaton, place.id, place.part, place.name, place.child
            there, ran = self._code.get((str(file), *key), (set(), set()))
            covered.lines += (line in ran for line in there)
            if never := sorted(there - ran):
                lines = ", ".join(str(placed.line + line - 1) for line in never)
                automaton = document.automaton(place.automaton)
                shown = self._shown((automaton and automaton.path) or file)
                what = f"{locator.name(Located(place, 1, 0))}: never ran {lines}"
                missing.append((shown, placed.line + never[0] - 1, what))
        covered.missing += [f"{shown}:{line}: {what}" for shown, line, what in sorted(missing)]

    def _cover_automaton(self, covered: _Covered, file: Path, automaton: Automaton, name: str) -> None:
        def hit(what: str, id: int) -> bool:
            return self.hits[str(file), automaton.id, what, id] > 0

        names = {state.id: state.name or f"state {state.id}" for state in automaton.states}
        missing = []
        for state in automaton.states:
            covered.states.append(hit("entered", state.id))
            if not hit("entered", state.id):
                missing.append((state.line, f"state {name}/{names[state.id]} was never entered"))
        for each in automaton.transitions:
            covered.transitions.append(hit("fired", each.id))
            problems = [] if hit("fired", each.id) else ["never fired"]
            if each.type == "condition" or not each.guard.is_blank:
                covered.guards += [hit("true", each.id), hit("false", each.id)]
                unseen = [value for value in ("true", "false") if not hit(value, each.id)]
                if unseen:
                    problems.append(f"its guard was never {'asked' if len(unseen) == 2 else unseen[0]}")
            if problems:
                ends = (names.get(end, f"state {end}") for end in (each.origin, each.destination))
                what = f"transition {each.name or f'transition {each.id}'} of {name} ({' -> '.join(ends)})"
                missing.append((each.line, f"{what}: {', '.join(problems)}"))
        shown = self._shown(automaton.path or file)
        covered.missing += [f"{shown}:{line}: {what}" for line, what in sorted(missing)]

    def _shown(self, file: Path) -> str:
        """Return the name of a file in reports: relative to the root of the project, if it is below it."""
        file = file.resolve()
        return (file.relative_to(self._root) if file.is_relative_to(self._root) else file).as_posix()


def _table(documents: Sequence[_Covered], total: _Covered, *, lines: bool) -> Iterator[tuple[str, bool]]:
    """Yield the lines of the report, each with a flag for missing coverage."""
    width = max([len("document"), *(len(each.name) for each in documents)])
    of_lines = f"  {'lines':>9}" if lines else ""
    head = (
        f"{'document':<{width}}  {'states':>8}  {'transitions':>11}  {'guards':>8}{of_lines}  {'covered':>8}"
    )
    rule = "-" * len(head), False
    yield from ((head, False), rule)
    for each in (*documents, total):
        if each is total:
            yield rule
        # Never 100 % while something is missing.
        percent = 100 if all(each.all) else min(99, int(each.percent))
        kinds = (each.states, each.transitions, each.guards, each.lines)
        states, transitions, guards, ran = (f"{sum(hits)}/{len(hits)}" if hits else "-" for hits in kinds)
        ratios = f"{states:>8}  {transitions:>11}  {guards:>8}" + (f"  {ran:>9}" if lines else "")
        yield f"{each.name:<{width}}  {ratios}  {percent:>6} %", not all(each.all)
    if total.missing:
        yield from (("", False), ("missing:", False), *((f"  {line}", True) for line in total.missing))


def _files(paths: Sequence[Path]) -> Iterator[Path]:
    for path in paths:
        if path.is_dir():
            files = filter(is_regular, sorted(path.resolve().rglob("*.xml")))
            yield from filter(looks_like_document, files)
        elif path.is_file():
            yield path.resolve()
        else:
            raise FileNotFoundError(f"--hfsm-cov: there is no {path}")


def _path(document: Document, automaton: Automaton) -> str:
    """Return the names of the states that own an automaton, from the root down; empty for the root."""
    owners = map(document.owner, (automaton, *document.above(automaton)))
    return "/".join(reversed([owner.name for owner in owners if owner is not None]))
