"""Which lines of a document's code a test runs, measured by coverage.py.

It measures the component that is generated from the document; the marks in it lead its lines back. Lines
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
from traceback import walk_tb
from types import CodeType
from typing import TYPE_CHECKING, Final

import pytest

from codegen.code_marks import read_marks
from codegen.messages import NO_MESSAGE, Message
from hfsm_runtime import Component
from hfsm_runtime.component import source_of
from visualhfsm._document.places import CODE, Place, PlacedText, text_of, texts_in
from visualhfsm._processes.document_tests import CodeRun, version_of
from visualhfsm.simulation import Behavior
from visualhfsm.simulation._loading import COMPILED, DocumentInvalid, measurable, read

if TYPE_CHECKING:
    from coverage import Coverage

_WARNINGS: Final = ["no-ctracer", "no-data-collected", "no-sysmon", "trace-changed"]
"""Warnings of coverage.py that are not issued: a project may make errors of all warnings."""
_PARTS: Final = CODE - {"result"}
"""The parts that are measured: each is one of automata, of states, or of transitions."""


class Lines:
    """Measures the lines that run in one test after the other: a plugin of pytest."""

    def __init__(self) -> None:
        self._files: dict[str, Path] = {}
        """The documents of the components that were measured."""
        self._ran: dict[str, set[int]] = {}
        self._coverage: Coverage | None = None
        self._measures = False
        self._included = {f"*/{COMPILED}/*"}
        self._naming = ExitStack()
        self._behaviors: list[Behavior] = []
        self._error: BaseException | None = None
        """The exception by which the present test has failed."""
        self.unmeasured = NO_MESSAGE
        """Why nothing is measured in the present test; empty if it is."""

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_logstart(self) -> None:
        """Begin a test: forget the one before."""
        self._stop()
        self._behaviors.clear()
        self._files.clear()
        self._ran.clear()
        self._error = None
        self.unmeasured = NO_MESSAGE

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_makereport(self, call: pytest.CallInfo[None]) -> None:
        """Measure no longer once the test has run."""
        if call.when == "teardown" or (call.when == "setup" and call.excinfo is None):
            return
        self._stop()
        self._error = None if call.excinfo is None else call.excinfo.value
        for behavior in self._behaviors:
            self._take_file(behavior)  # the document may be another one since a reload

    def begin(self, component: type[Component] | None) -> None:
        """Measure from now on, before a document is loaded, or the `component` of one is made."""
        if component is not None:
            self._include(component.automaton.__code__.co_filename)
        if not self._measures and not self.unmeasured:
            self._start()

    def watch(self, behavior: Behavior) -> None:
        """Take a behavior of the present test."""
        self._behaviors.append(behavior)
        self._take_file(behavior)

    def pieces(self) -> Iterator[CodeRun]:
        """Yield the code of the documents of the present test, and what ran of it."""
        failed = {} if self._error is None else _lines_in(self._error, self._files)
        for file, document in self._files.items():
            text = "".join(linecache.getlines(file))
            ran = self._ran.get(file, set())
            try:
                code = _code_of(document, document.stat().st_mtime_ns, file, text)
            except (DocumentInvalid, OSError):
                self.unmeasured = Message("{file} was changed by a test", file=document.name)
                continue
            for place, version, lines in code:
                yield CodeRun(
                    document=str(document),
                    place=place,
                    version=version,
                    lines=tuple(line for _, line in lines),
                    ran=tuple(line for number, line in lines if number in ran),
                    failed=tuple(line for number, line in lines if number in failed.get(file, ())),
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
            self.unmeasured = Message("coverage is not installed: pip install 'visualhfsm[test]'")
            return
        if sys.gettrace() is not None or Coverage.current() is not None:
            self.unmeasured = Message("another program measures or debugs these tests")
            return
        if self._coverage is None:
            self._coverage = Coverage(
                data_file=None, config_file=False, include=sorted(self._included), messages=False
            )
            self._coverage.set_option("run:disable_warnings", _WARNINGS)
        self._naming.enter_context(measurable())
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
        self._naming.close()


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
    texts: dict[tuple[int, int], list[PlacedText]] = {}
    for each in texts_in(read(document)):
        texts.setdefault((each.place.automaton, each.place.id), []).append(each)
    lines = sorted(set(_lines_of(compile(text, file, "exec"))))
    found = []
    for code in read_marks(text):
        of = text_of(code, texts.get((code.automaton, code.id), ())) if code.part in _PARTS else None
        if of is None:
            continue
        placed, before = of
        inside = tuple(
            (line, line - code.first + before + 1) for line in lines if code.first <= line <= code.last
        )
        if inside:
            found.append((placed.place, version_of(placed.text or ""), inside))
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
        for frame, line in walk_tb(present.__traceback__):
            if (lines := found.get(frame.f_code.co_filename)) is not None:
                lines.add(line)
        present = present.__cause__ or present.__context__
    return found
