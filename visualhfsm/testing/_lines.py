"""Which lines of a document's code a test runs, measured by coverage.py.

It measures the component that is generated from the document; the source map leads its lines back. Lines
count that hold code of a function: states, conditions and functions are functions, and their `def` lines say
nothing.
"""

from __future__ import annotations

import inspect
import linecache
import sys
from collections.abc import Iterable, Iterator
from contextlib import ExitStack
from functools import lru_cache
from pathlib import Path
from types import CodeType
from typing import TYPE_CHECKING, Final

from codegen.hfsm.source_map import SourceMap
from hfsm_runtime import Component
from hfsm_runtime.component import source_of
from visualhfsm._editing.places import Place, Spot, spots
from visualhfsm._test_results import CodeRun, version_of
from visualhfsm.simulation import Behavior
from visualhfsm.simulation._loading import COMPILED, DocumentInvalid, measurable, read

if TYPE_CHECKING:
    from coverage import Coverage

_KINDS: Final = {
    "functions": "automaton",
    "variables": "automaton",
    "entry": "state",
    "code": "state",
    "exit": "state",
    "argument": "state",
    "trigger": "transition",
    "guard": "transition",
    "fired": "transition",
}
"""The parts that are measured, each with the kind of element that has it."""


class Lines:
    """Measures the lines that run in one test after the other."""

    def __init__(self) -> None:
        self._files: dict[str, Path] = {}
        """The documents of the components that were measured."""
        self._known: set[tuple[str, int]] = set()
        """The components whose code that never ran has been said: their files, and versions."""
        self._ran: dict[str, set[int]] = {}
        self._coverage: Coverage | None = None
        self._measures = False
        self._included = {f"*/{COMPILED}/*"}
        self._naming = ExitStack()
        self._behaviors: list[Behavior] = []
        self.unmeasured = ""
        """Why nothing is measured in the present test; empty if it is."""

    def begin(self, component: type[Component] | None) -> None:
        """Measure from now on, before a document is loaded, or the `component` of one is made."""
        if component is not None:
            self._include(component.automaton.__code__.co_filename)
        if not self._measures and not self.unmeasured:
            self._naming.enter_context(measurable())
            self._start()

    def watch(self, behavior: Behavior) -> None:
        """Take a behavior of the present test."""
        self._behaviors.append(behavior)
        self._take_file(behavior)

    def end(self) -> None:
        """Measure no longer."""
        for behavior in self._behaviors:
            self._take_file(behavior)  # the document may be another one since a reload
        self._stop()
        self._naming.close()

    def clear(self) -> None:
        """Forget the present test."""
        self.end()
        self._behaviors.clear()
        self._files.clear()
        self._ran.clear()
        self.unmeasured = ""

    def pieces(self, error: BaseException | None) -> Iterator[CodeRun]:
        """Yield the code that ran in the present test; `error` is the exception by which it failed."""
        failed = {} if error is None else _lines_in(error, self._files)
        for file, document in self._files.items():
            text = "".join(linecache.getlines(file))
            component = file, version_of(text)
            is_new = component not in self._known
            self._known.add(component)
            ran = self._ran.get(file, set())
            try:
                code = _code_of(document, document.stat().st_mtime_ns, file, text)
            except (DocumentInvalid, OSError):
                self.unmeasured = f"{document.name} was changed by a test"
                continue
            for place, version, lines in code:
                here = tuple(line for number, line in lines if number in ran)
                if here or is_new:
                    there = tuple(line for number, line in lines if number in failed.get(file, ()))
                    yield CodeRun(
                        str(document), place, version, tuple(line for _, line in lines), here, there
                    )

    def _take_file(self, behavior: Behavior) -> None:
        if behavior.document is not None and not self.unmeasured:
            self._files[source_of(behavior.component)] = behavior.document.resolve()

    def _include(self, file: str) -> None:
        if file not in self._included:
            self._stop()
            self._included.add(file)
            self._coverage = None

    def _start(self) -> None:
        try:
            from coverage import Coverage
        except ImportError:
            self.unmeasured = "coverage is not installed: pip install 'visualhfsm[test]'"
            return
        if sys.gettrace() is not None or Coverage.current() is not None:
            self.unmeasured = "another program measures or debugs these tests"
            return
        if self._coverage is None:
            self._coverage = Coverage(
                data_file=None, config_file=False, include=sorted(self._included), messages=False
            )
            self._coverage.set_option("run:disable_warnings", ["no-data-collected"])
        self._coverage.start()
        self._measures = True

    def _stop(self) -> None:
        if self._coverage is None or not self._measures:
            return
        self._measures = False
        self._coverage.stop()
        data = self._coverage.get_data()
        for file in data.measured_files():
            self._ran.setdefault(file, set()).update(data.lines(file) or ())
        self._coverage.erase()


@lru_cache(maxsize=32)
def _code_of(
    document: Path,
    changed: int,  # noqa: ARG001 - of the file
    file: str,
    text: str,
) -> tuple[tuple[Place, int, tuple[tuple[int, int], ...]], ...]:
    """Return place, version and lines of each piece of code in a document.

    A line is its number in the component, and that in the piece.
    """
    content: dict[tuple[str, int, int, str], list[Spot]] = {}
    for spot in spots(read(document)):
        place = spot.place
        if spot.text and place.part in _KINDS:
            content.setdefault((place.kind, place.automaton, place.id, place.part), []).append(spot)
    lines = sorted(set(_lines_of(compile(text, file, "exec"))))
    found = []
    for row in SourceMap.read(text).rows:
        if row.part not in _KINDS:
            continue
        for spot in content.get((_KINDS[row.part], row.automaton, row.id, row.part), ()):
            assert spot.text is not None
            begin = row.line_of(row.first) - spot.line  # lines of the piece before the code
            if 0 <= begin <= spot.text.count("\n"):
                inside = tuple(
                    (each, each - row.first + begin + 1) for each in lines if row.first <= each <= row.last
                )
                if inside:
                    found.append((spot.place, version_of(spot.text), inside))
                break
    return tuple(found)


def _lines_of(code: CodeType) -> Iterator[int]:
    """Yield the lines of the functions in a piece of code."""
    if code.co_flags & inspect.CO_OPTIMIZED:
        lines = {line for _, _, line in code.co_lines() if line}
        yield from lines - {code.co_firstlineno} or lines
    for each in code.co_consts:
        if isinstance(each, CodeType):
            yield from _lines_of(each)


def _lines_in(error: BaseException, files: Iterable[str]) -> dict[str, set[int]]:
    """Return the lines of some files through which an exception went, or one that led to it."""
    found: dict[str, set[int]] = {file: set() for file in files}
    seen: set[int] = set()
    present: BaseException | None = error
    while present is not None and id(present) not in seen:
        seen.add(id(present))
        trace = present.__traceback__
        while trace is not None:
            if (lines := found.get(trace.tb_frame.f_code.co_filename)) is not None:
                lines.add(trace.tb_lineno)
            trace = trace.tb_next
        present = present.__cause__ or present.__context__
    return found
