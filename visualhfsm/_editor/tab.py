"""An open document, as the windows see it."""

from __future__ import annotations

import asyncio
from collections import Counter, defaultdict
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Concatenate, Final, Generic, ParamSpec, Self, TypeVar

import msgspec

from codegen.diagnostics import Severity
from codegen.hfsm.document import Automaton, Document
from visualhfsm._base.work import retrieve
from visualhfsm._document.diff import differ
from visualhfsm._document.imported_places import ImportedPlaces
from visualhfsm._document.places import texts_at, texts_in
from visualhfsm._document.problems import Findings, Problem
from visualhfsm._monitor.messages import Failed, RecentLines, Source, StartedPush
from visualhfsm._processes.document_tests import version_of
from visualhfsm._processes.test_results import TestsPush
from visualhfsm.project._document import Changed, Checked, Event, FileChanged, OpenDocument
from visualhfsm.project._version import Version

from .protocol import Outside, Problems
from .views import ViewPush

FAILED: Final = "run"
"""The code of a problem that a run has shown."""

P = ParamSpec("P")
R = TypeVar("R")
Report = TypeVar("Report", TestsPush, ViewPush)


class Threads:
    """A few threads for work that takes long."""

    def __init__(self, threads: int) -> None:
        self._pool = ThreadPoolExecutor(threads, thread_name_prefix="editor")

    def begin(self, work: Callable[[], R]) -> asyncio.Future[R]:
        """Begin work in a free thread; it is completed even when its caller is cancelled."""
        future = asyncio.get_running_loop().run_in_executor(self._pool, work)
        future.add_done_callback(retrieve)
        return future

    async def do(self, work: Callable[[], R]) -> R:
        """Do work in a free thread and return its result; it continues when the caller is cancelled."""
        return await asyncio.shield(self.begin(work))

    async def close(self) -> None:
        """Drop what has not begun and wait for what has."""
        await asyncio.to_thread(self._pool.shutdown, cancel_futures=True)


_Stamp = tuple[int, int] | None
"""Time of the last change and size of a file; None where there is none."""


@dataclass(frozen=True)
class Imports:
    """The automata that a document imports; `number` counts the changes."""

    automata: Mapping[int, Automaton] = field(default_factory=dict)
    stamps: Mapping[Path, _Stamp] = field(default_factory=dict)
    number: int = 0

    @classmethod
    def read(cls, places: ImportedPlaces, former: Self) -> Self:
        """Read the imported files; return the former imports if they are the same."""
        before = {file: _stamp(file) for file in places.files}
        automata = {each.id: each for each in places.whole.automata if each.path is not None}
        if automata == former.automata and before == former.stamps:
            return former
        return cls(automata, before, former.number + 1)

    def differ(self) -> bool:
        """Return whether a file is another one than when it was read."""
        return any(_stamp(file) != stamp for file, stamp in self.stamps.items())

    def within(self, document: Document) -> Document:
        """Return a document with the imported automata."""
        if not self.automata:
            return document
        written = {each.id for each in document.automata if each.imported is None}
        own = (each for each in document.automata if each.id in written or each.id not in self.automata)
        imported = (each for each in self.automata.values() if each.id not in written)
        return replace(document, automata=(*own, *imported))


def _stamp(file: Path) -> _Stamp:
    try:
        status = file.stat()
    except OSError:
        return None
    return status.st_mtime_ns, status.st_size


class _Difference:
    """Whether two versions differ, except in positions; remembered, since it is asked again and again."""

    def __init__(self) -> None:
        self._compared: tuple[Document, Document, bool] | None = None

    def between(self, old: Document, new: Document) -> bool:
        """Compare two versions."""
        if self._compared is None or self._compared[0] is not old or self._compared[1] is not new:
            self._compared = (old, new, old is not new and differ(old, new))
        return self._compared[2]


class Dated(Generic[Report]):
    """A report about the document as it was: outdated once the shown version differs."""

    def __init__(self) -> None:
        self.of: Document | None = None
        """The document that it is about."""
        self.now: Report | None = None
        """The report as the windows have it."""
        self._reported: Report | None = None
        self._difference = _Difference()

    def take(self, reported: Report, document: Document, content: Document | None = None) -> Report:
        """Return what the windows get of a report, while they show a document.

        `content` is the document with all that it imports.
        """
        self._reported = reported
        differs = self.of is not None and self._difference.between(self.of, document)
        self.now = msgspec.structs.replace(
            self._present(reported, content or document), outdated=reported.outdated or differs
        )
        return self.now

    def compare(self, document: Document, content: Document | None = None) -> Report | None:
        """Return what the windows get while they show another version, if that is new."""
        if self._reported is None:
            return None
        former = self.now
        now = self.take(self._reported, document, content)
        return None if now == former else now

    def _present(self, report: Report, document: Document) -> Report:  # noqa: ARG002
        """Return a report without what is not true of a document."""
        return report


class DatedTests(Dated[TestsPush]):
    """What tests passed: the lines of code are those of the shown version."""

    def _present(self, report: TestsPush, document: Document) -> TestsPush:
        if not report.code:
            return report
        wanted = {each.place for each in report.code}
        versions = {
            place: version_of(text or "") for place, text, _, _ in texts_in(document) if place in wanted
        }
        code = (each for each in report.code if versions.get(each.place) == each.version)
        return msgspec.structs.replace(report, code=tuple(code))


class Tab:
    """An open document, on which requests work in order in threads, and its state as windows show it.

    It is made and used on the event loop, where `changed` is called whenever `shown` is new, and `found` with
    what else is found out. `recording` is the file of the recording that contains the document, which is not
    changed then.
    """

    def __init__(
        self,
        number: int,
        document: OpenDocument,
        threads: Threads,
        *,
        changed: Callable[[Tab], None],
        found: Callable[[Tab, Problems | Outside], None] = lambda *_: None,
        output: RecentLines,
        recording: Path | None = None,
    ) -> None:
        self.id = number
        self.document = document
        self.recording = recording
        self.outside: Outside | None = None
        self.findings: Problems | None = None
        """The newest result of the checks."""
        self.failures: list[Failed] = []
        """The failures since its component was started."""
        self.started: StartedPush | None = None
        self.output = output
        self.generated: Document | None = None
        """The document as its component was generated last."""
        self.loaded: Document | None = None
        """The document as its running component has loaded it."""
        self.of_views: defaultdict[str, Dated[ViewPush]] = defaultdict(Dated)
        """What views do for the document, by their names."""
        self.tests = DatedTests()
        self._from_loaded = _Difference()
        self._imports = Imports()
        self._threads = threads
        self._changed, self._found = changed, found
        self._lock = asyncio.Lock()
        self._loop = asyncio.get_running_loop()
        document.subscribe(self._take_event)
        self.shown = document.version

    @property
    def source(self) -> Source:
        """The document as those parts of the server get it that start something for it."""
        shown = self.shown
        return Source(self.id, shown.revision, shown.document, shown.path, shown.dirty, shown.title)

    @property
    def problems(self) -> Problems | None:
        """What the checks found, after the errors of the last run in code that has not changed since."""
        findings = self.findings
        if findings is None:
            return None
        failed = [
            _problem(each)
            for each in self.failures
            if texts_at(self.content, each.origin.place) == each.texts
        ]
        counts = Counter(findings.counts) + Counter(each.severity for each in failed)
        items = [*failed, *findings.items]
        return msgspec.structs.replace(findings, items=items, counts=counts, imports=self._imports.number)

    @property
    def content(self) -> Document:
        """The shown document with what it imports, as that was looked at last."""
        return self._imports.within(self.shown.document)

    @property
    def listed(self) -> tuple[object, ...]:
        """What the list of the tabs says of it; besides, it says what runs."""
        return self.shown.path, self.shown.title, self.shown.dirty, self.outside

    @property
    def is_started(self) -> bool:
        """Whether a component was started from it and has not ended."""
        return self.started is not None and self.started.status != "ended"

    @property
    def component(self) -> str:
        """The name of the component that was started from it and runs, or else of the one it would become."""
        return (
            self.started.component if self.started is not None and self.is_started else self.shown.component
        )

    async def look_at_imports(self) -> bool:
        """Read the imported files, and return whether they have changed since this was done before."""
        former, document = self._imports, self.document
        automata = document.version.document.automata
        if former == Imports() and all(each.imported is None for each in automata):
            return False
        self._imports = await self._threads.do(lambda: Imports.read(document.imports(), former))
        return self._imports is not former

    async def imports_changed(self) -> bool:
        """Return whether an imported file has changed since they were read."""
        imports = self._imports
        return bool(imports.stamps) and await self._threads.do(imports.differ)

    def take_findings(self, version: Version, findings: Findings) -> None:
        """Keep what was found in a version, with what was found before of the kinds that are pending."""
        items, counts = findings.problems, findings.counts
        if findings.pending and self.findings is not None:
            former = [each for each in self.findings.items if each.code in findings.pending]
            items, counts = (*items, *former), Counter(counts) + Counter(each.severity for each in former)
        self.findings = Problems(
            tab=self.id, revision=version.revision, items=items, counts=counts, complete=not findings.pending
        )

    def take_generated(self) -> None:
        """Remember that the running component has loaded the last generated document."""
        self.loaded = self.generated

    @property
    def differs_from_loaded(self) -> bool:
        """Whether the document differs from what its component runs, except in positions."""
        if self.loaded is None or not self.is_started:
            return False
        return self._from_loaded.between(self.loaded, self.shown.document)

    async def edit(
        self, work: Callable[Concatenate[OpenDocument, P], R], *args: P.args, **kwargs: P.kwargs
    ) -> R:
        """Do work on the document in a thread, after earlier work; its exceptions are raised here.

        Its changes are shown before this returns. Work that has begun is completed even when the caller is
        cancelled, and later work waits for it.
        """
        together = self.document.together()(partial(work, self.document, *args, **kwargs))
        await self._lock.acquire()
        future = self._threads.begin(together)
        future.add_done_callback(lambda _: self._lock.release())
        return await asyncio.shield(future)

    def _take_event(self, event: Event) -> None:
        """Show a change, in the order of events: before the caller of `edit` continues."""
        with suppress(RuntimeError):  # the loop is closed: nothing is shown any more
            self._loop.call_soon_threadsafe(self._take, event)

    def _take(self, event: Event) -> None:
        match event:
            case Changed(version=version):
                self.shown = version
                if version.file == "same":
                    self.outside = None
                self._changed(self)
            case Checked(version=version, findings=findings):
                self.take_findings(version, findings)
                if (problems := self.problems) is not None:
                    self._found(self, problems)
            case FileChanged(state=state, message=message):
                outside = Outside(tab=self.id, state=state, message=message)
                self.outside = outside if state in {"changed", "deleted"} else None
                self._found(self, outside)


def _problem(failed: Failed) -> Problem:
    """Return a failure as a problem, of the whole line."""
    place, line, file, source, where, owners, _ = failed.origin
    lines = failed.texts[0].split("\n") if line and failed.texts else []
    written = lines[line - 1] if line <= len(lines) and line else ""
    return Problem(
        code=FAILED,
        severity=Severity.ERROR,
        message=failed.message,
        place=place,
        line=line,
        column=len(written) - len(written.lstrip()) + 1 if line else 0,
        length=len(written.strip()),
        file=file,
        source=source,
        where=where,
        owners=owners,
    )
