"""Run the tests of the editor's documents by pytest, in a process that ends with the editor.

The tests of a document are those in files that name it, beside it or in a folder `tests`. What they report is
data of users' code: its size is limited, and it is checked.
"""

from __future__ import annotations

import asyncio
import contextlib
import importlib.util
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import islice
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

import msgspec

from codegen.messages import NO_MESSAGE
from codegen.reasons import reason
from visualhfsm._base.environment import child_environment
from visualhfsm._base.errors import MissingPackageError, VisualHfsmError
from visualhfsm._base.languages import decode_message
from visualhfsm._base.recognition import reason_of
from visualhfsm._base.work import PerDocument
from visualhfsm._document.places import Place
from visualhfsm._monitor.messages import Source
from visualhfsm._processes.document_tests import (
    FOLDER,
    MOST_TESTS,
    PATTERN,
    Files,
    TestResult,
    find_tests,
    test_files,
    tests_command,
    top_of,
)
from visualhfsm._processes.test_results import Passed, PassedCode, TestsPush, TestView
from zenoh_ice.application.child import ChildProcess
from zenoh_ice.data import typed

Publish = Callable[[TestsPush], None]
MOST_CODE: Final = 5000
"""Pieces of code of which the page gets the lines."""
_KINDS: Final = {"entered": "state", "fired": "transition", "true": "transition", "false": "transition"}
_MOST_RESULTS: Final = 8 << 20  # bytes
_LONGEST_REASON: Final = 800
_LONGEST_TIMELINE: Final = 2000
_LONGEST_WORDS: Final = 2000  # characters of what pytest says
_LOOK_PERIOD: Final = 0.3  # s
_STOP_LIMITS: Final = (3.0, 2.0)
"""Seconds from SIGINT, to which pytest answers with what is done, to SIGTERM, and to SIGKILL."""


class StartedTests(PerDocument["_TabTests"]):
    """At most one run of tests for each tab, used on the event loop. All methods raise VisualHfsmError."""

    def __init__(self, publish: Publish, root: Path, include: Sequence[Path] = ()) -> None:
        super().__init__(lambda tab: _TabTests(tab, publish, root, tuple(include)))

    async def find(self, source: Source) -> None:
        """Find the tests of a document, unless they run."""
        await self.do(source.tab, lambda tests: tests.find(source))

    async def refresh(self, source: Source) -> None:
        """Find the tests of a document again if they were looked for and their files have changed since."""
        if self.get(source.tab) is not None and source.path is not None:
            await self.do(source.tab, lambda tests: tests.find(source, unless_same=True))

    async def start(self, source: Source, names: Sequence[str] = ()) -> None:
        """Begin to run all tests of a document, or those of some names."""
        await self.do(source.tab, lambda tests: tests.start(source, names))


class _TabTests:
    """The tests of the document of a tab, and how they went."""

    def __init__(self, tab: int, publish: Publish, root: Path, include: tuple[Path, ...]) -> None:
        self._state = TestsPush(tab=tab)
        self._publish = publish
        self._root = root
        self._include = include
        self._child: ChildProcess | None = None
        self._following: asyncio.Task[None] | None = None
        self._words = ""
        self._stopped = False
        self._results: dict[str, TestResult | None] = {}
        """By name; None for those that run again, which keep their place."""
        self._files: Files = {}
        """The files of tests when they were last looked for."""

    async def find(self, source: Source, *, unless_same: bool = False) -> None:
        """Find the tests, and forget how those went whose files have changed."""
        if self._child is None:
            path = _saved(source)
            files = await asyncio.to_thread(test_files, path, self._root)
            if unless_same and files == self._files:
                return
            found = await asyncio.to_thread(find_tests, files, path, self._root)
            self._forget_changed(files, top_of(path, self._root), found)
            self._show(path, found)

    async def start(self, source: Source, names: Sequence[str]) -> None:
        """Begin to run them."""
        if self._child is not None:
            raise VisualHfsmError.because("the tests run already")
        if importlib.util.find_spec("pytest") is None:
            raise MissingPackageError("pytest", "test")
        path = _saved(source)
        files = await asyncio.to_thread(test_files, path, self._root)
        found = await asyncio.to_thread(find_tests, files, path, self._root)
        chosen = [name for name in names if _plain(name) in found] if names else found
        if not chosen:
            raise VisualHfsmError.because(
                "no file {pattern} beside {path} or in {folder} names it",
                pattern=PATTERN,
                path=path.name,
                folder=FOLDER,
            )
        folder = TemporaryDirectory(prefix="visualhfsm-tests-", ignore_cleanup_errors=True)
        results = Path(folder.name, "results")
        results.touch()
        top = top_of(path, self._root)
        places = (names and chosen) or dict.fromkeys(name.partition("::")[0] for name in chosen)
        command = tests_command(top, places, results)
        self._words, self._stopped = "", False
        self._forget_changed(files, top, found)
        again = set(names) if names else {_plain(name) for name in chosen}
        for name in self._results:
            if {name, _plain(name)} & again:
                self._results[name] = None
        child = ChildProcess(self._receive_words)
        try:
            await child.start(command, {**child_environment(self._include), "TMPDIR": folder.name})
        except OSError as error:
            folder.cleanup()
            raise VisualHfsmError.because(
                "pytest cannot be started: {reason}", reason=reason(error)
            ) from error
        self._child = child
        self._report(status="running", error="")
        self._show(path, found)
        self._following = asyncio.create_task(self._follow(child, path, found, folder), name="tests")

    async def stop(self) -> None:
        """End them."""
        if self._child is not None and self._following is not None:
            self._stopped = True
            self._report(status="stopping")
            await self._child.stop(_STOP_LIMITS)
            await self._following

    close = stop

    async def _follow(
        self, child: ChildProcess, path: Path, found: Sequence[str], folder: TemporaryDirectory[str]
    ) -> None:
        """Show results as they come, until the process has ended."""
        results = Path(folder.name, "results")
        ended = asyncio.create_task(child.wait())
        read = 0
        while not ended.done():
            await asyncio.wait({ended}, timeout=_LOOK_PERIOD)
            data = await asyncio.to_thread(_new_lines, results, read)
            if data:
                read += len(data)
                self._receive(data)
                self._show(path, found)
            if read > _MOST_RESULTS:
                child.kill()
        code = ended.result()
        await asyncio.to_thread(folder.cleanup)
        self._child = None
        self._results = {name: each for name, each in self._results.items() if each is not None}
        self._show(path, found)
        error = ""
        if code not in (0, 1) and not self._stopped:  # 1: some tests have failed
            error = f"pytest ended with {code}:\n{self._words.strip()}"
        self._report(status="idle", error=error)

    def _forget_changed(self, files: Files, top: Path, found: Sequence[str]) -> None:
        """Keep only results of tests that are there as they were; `files` are those that are there now."""
        changed = {
            file.relative_to(top).as_posix()
            for file in self._files.keys() & files.keys()
            if self._files[file] != files[file]
        }
        self._files = files
        self._results = {
            name: each
            for name, each in self._results.items()
            if _plain(name) in found and name.partition("::")[0] not in changed
        }

    def _receive_words(self, _: int, data: bytes) -> None:
        self._words = (self._words + data.decode(errors="replace"))[-_LONGEST_WORDS:]

    def _receive(self, data: bytes) -> None:
        for line in data.splitlines():
            with contextlib.suppress(msgspec.DecodeError, RecursionError):  # a test wrote it
                result = typed.from_json(line, TestResult, dec_hook=decode_message)
                former = self._results.get(result.name)
                if former is None or former.outcome != "failed":  # a failed call, not its clean end
                    self._results[result.name] = result

    def _show(self, path: Path, found: Sequence[str]) -> None:
        ran: dict[str, list[str]] = {}
        for name in self._results:
            ran.setdefault(_plain(name), []).append(name)  # one for each set of parameters
        results = [each for each in self._results.values() if each is not None]
        names = dict.fromkeys(name for each in (*found, *ran) for name in ran.get(each, [each]))
        self._report(
            tests=tuple(view_of(name, self._results.get(name)) for name in islice(names, MOST_TESTS)),
            passed=tuple(passed_in(path, results)),
            code=tuple(islice(passed_code(path, results), MOST_CODE)),
            unmeasured=next((each.unmeasured for each in results if each.unmeasured), NO_MESSAGE),
        )

    def _report(self, **changes: object) -> None:
        self._state = msgspec.structs.replace(self._state, **changes)
        self._publish(self._state)


def view_of(name: str, result: TestResult | None) -> TestView:
    """Return a test as the page shows it, which may not have run."""
    file, _, function = name.partition("::")
    if result is None:
        return TestView(name=function or file, file=file)
    return TestView(
        name=function or file,
        file=file,
        outcome=result.outcome,
        seconds=result.seconds,
        reason=reason_of(result.reason[:_LONGEST_REASON]),
        timeline=result.timeline[-_LONGEST_TIMELINE:],
    )


def _plain(name: str) -> str:
    return name.partition("[")[0]


def _saved(source: Source) -> Path:
    if source.path is None:
        raise VisualHfsmError.because("save the document first: tests run its file")
    return source.path


def _new_lines(file: Path, begin: int) -> bytes:
    """Return the whole lines from a place of a file."""
    try:
        with file.open("rb") as opened:
            opened.seek(begin)
            data = opened.read(_MOST_RESULTS + 1)
    except FileNotFoundError:  # a test has deleted it, of which pytest tells
        return b""
    return data[: data.rfind(b"\n") + 1]


def passed_in(path: Path, results: Iterable[TestResult]) -> Iterator[Passed]:
    """Yield what tests passed in a document."""
    document = str(path.resolve())
    counts: Counter[tuple[int, str, int]] = Counter()
    failed = set()
    for result in results:
        for hit in result.hits:
            if hit.document == document:
                counts[hit.automaton, hit.kind, hit.id] += hit.count
        failed |= {(hit.automaton, hit.id) for hit in result.ended if hit.document == document}
    elements = {(automaton, _KINDS[kind], id_) for automaton, kind, id_ in counts if kind in _KINDS}
    for automaton, kind, id_ in sorted(elements | {(automaton, "state", id_) for automaton, id_ in failed}):
        is_state = kind == "state"
        held = counts[automaton, "true", id_]
        yield Passed(
            automaton=automaton,
            kind="state" if is_state else "transition",
            id=id_,
            count=counts[automaton, "entered" if is_state else "fired", id_],
            asked=0 if is_state else held + counts[automaton, "false", id_],
            held=0 if is_state else held,
            failed=is_state and (automaton, id_) in failed,
        )


def passed_code(path: Path, results: Iterable[TestResult]) -> Iterator[PassedCode]:
    """Yield which lines of a document's code tests passed; the same code in another version is other code."""
    document = str(path.resolve())
    lines: dict[tuple[Place, int], tuple[set[int], set[int], set[int]]] = {}
    for result in results:
        for code in result.code:
            if code.document == document:
                found = lines.setdefault((code.place, code.version), (set(), set(), set()))
                for known, new in zip(found, (code.lines, code.ran, code.failed), strict=True):
                    known.update(new)
    for (place, version), (there, ran, failed) in lines.items():
        yield PassedCode(
            place=place,
            version=version,
            passed=tuple(sorted((there & ran) - failed)),
            missed=tuple(sorted(there - ran - failed)),
            failed=tuple(sorted(there & failed)),
        )
