"""The trials of the editor's tabs, each series in a process below the editor, which ends with it.

What that process writes depends on code of users: its size is limited, and it is checked.
"""

from __future__ import annotations

import asyncio
import contextlib
import hashlib
import os
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final, Literal

import msgspec
from msgspec import UNSET

from codegen.messages import Message
from codegen.reasons import reason
from visualhfsm import VisualHfsmError
from visualhfsm.plugins import (
    PerDocument,
    ReportingProcess,
    Source,
    child_environment,
    decode_message,
    written,
)
from visualhfsm.trials import SUFFIX
from zenoh_ice.data import typed

from ._messages import Action, Choices, Order, Report, TrialsPush
from ._record import SUFFIX as OUTCOMES

_PROCESS: Final = "visualhfsm_trials._series_process"

Publish = Callable[[TrialsPush], None]


@dataclass(frozen=True, slots=True, kw_only=True)
class TrialsLimits:
    """What a process of trials may do."""

    stop: tuple[float, float] = (3.0, 2.0)
    """s from SIGINT, after which what is done is kept, to SIGTERM, and from there to SIGKILL."""
    longest_report: int = 2 << 20
    """Bytes of a line that it writes."""


class RunningTrials(PerDocument["_TabTrials"]):
    """At most one series for each tab. All methods raise VisualHfsmError; used on the event loop only."""

    def __init__(
        self, publish: Publish, include: Sequence[Path] = (), limits: TrialsLimits = TrialsLimits()
    ) -> None:
        super().__init__(lambda tab: _TabTrials(tab, publish, tuple(include), limits))

    async def read(self, source: Source, body: str = "") -> bool:
        """Read the plan of a document, and what the outcomes beside it say, unless that is known.

        The robot has that body if the plan names none. Returns False while the trials run: what is reported
        is of the version that runs.
        """
        return await self.do(source.tab, lambda trials: trials.read(source, body))

    async def run(self, source: Source, choices: Choices, *, again: bool = False) -> None:
        """Begin to run the trials that are missing; `again` replaces outcomes of an older version."""
        await self.do(source.tab, lambda trials: trials.run(source, choices, again=again))

    async def record(self, tab: int, number: int, folder: Path, name: Callable[[Path], str]) -> None:
        """Begin to run one of the trials again, recorded into a file in a folder.

        A push says when it is done, with the file as `name` calls it.
        """
        if self.get(tab) is None:
            raise VisualHfsmError.because("run the trials first")
        await self.do(tab, lambda trials: trials.record(number, folder, name))


class _TabTrials:
    """The trials of the document of a tab: their process, and what it has reported."""

    def __init__(self, tab: int, publish: Publish, include: tuple[Path, ...], limits: TrialsLimits) -> None:
        processors = len(os.sched_getaffinity(0))
        self._state = TrialsPush(tab=tab, workers=max(1, processors - 1))  # the editor needs one, too
        self._publish = publish
        self._include = include
        self._limits = limits
        self._series: ReportingProcess[Report] | None = None
        self._recorder: ReportingProcess[Report] | None = None
        self._choices = Choices()
        self._known: object = None
        """The outcomes that the state follows from, if they were read."""
        self._tried: Order | None = None
        """The order of the outcomes that are shown."""
        self._files = TemporaryDirectory(prefix="visualhfsm-trials-", ignore_cleanup_errors=True)

    @property
    def _runs(self) -> bool:
        return self._series is not None and self._state.status in ("running", "stopping")

    async def read(self, source: Source, body: str) -> bool:
        """Read plan and outcomes, unless the trials run, or nothing has changed since the last time."""
        if self._runs:
            return False
        self._choices = msgspec.structs.replace(self._choices, body=body)
        order, known = await asyncio.to_thread(self._ordered, "look", source, self._choices)
        if self._known != known:
            await self._start(order, "reading", known)
        return True

    async def run(self, source: Source, choices: Choices, *, again: bool) -> None:
        """Begin to run."""
        if self._runs:
            raise VisualHfsmError.because("the trials run already")
        order, _ = await asyncio.to_thread(self._ordered, "run", source, choices)
        self._choices = choices
        if (plan := self._state.plan) is not None and not plan.file:  # until the process has read it again
            chosen = {
                "runs": choices.runs or plan.runs,
                "robot": choices.robot or plan.robot,
                "limit": choices.limit or plan.limit,
            }
            self._report(plan=msgspec.structs.replace(plan, state=choices.state, **chosen))
        await self._start(msgspec.structs.replace(order, again=again), "running")

    async def stop(self) -> None:
        """End what runs, and wait for its end."""
        if self._runs:
            self._report(status="stopping")
        for process in (self._series, self._recorder):
            if process is not None:
                await process.stop(self._limits.stop)

    async def record(self, number: int, folder: Path, name: Callable[[Path], str]) -> None:
        """Begin to run a trial again, recorded; `name` gives the name of a file in the page."""
        if self._recorder is not None:
            raise VisualHfsmError.because(
                "trial {recording} is being recorded", recording=str(self._state.recording)
            )
        if self._tried is None:
            raise VisualHfsmError.because("the document or its plan has changed: run the trials again")
        version = Path(self._tried.content).stem
        target = folder / f"{Path(self._tried.document).stem}-trial-{number}-{version[:6]}.mcap"
        order = msgspec.structs.replace(self._tried, action="record", number=number, recording=str(target))

        def ended(error: str) -> None:
            self._recorder = None
            if error or not target.is_file():  # it failed, or was stopped
                self._report(recording=None, error=error)
            else:
                self._report(recording=None, recorded=number, file=name(target))

        self._report(recording=number, recorded=None, error="")
        self._recorder = await self._carry_out(order, lambda _: None, ended)

    async def close(self) -> None:
        """End what runs, and remove the files."""
        try:
            await self.stop()
        finally:
            await asyncio.to_thread(self._files.cleanup)

    async def _start(self, order: Order, status: Literal["reading", "running"], known: object = None) -> None:
        if self._series is not None:  # it reads what is read again now
            await self._series.stop(self._limits.stop)
        self._known = None

        def receive(report: Report) -> None:
            if report.plan is not UNSET:
                self._report(plan=report.plan)
            if report.view is not UNSET:
                if not report.outdated and report.view is not None:
                    self._tried = order
                opens = self._tried is not None
                self._report(view=report.view, left=report.left, outdated=report.outdated, opens=opens)

        def ended(error: str) -> None:
            self._series = None
            self._known = None if error else known
            self._report(status="idle", left=None, error=error)

        self._report(status=status, error="", left=None)
        self._series = await self._carry_out(order, receive, ended)

    async def _carry_out(
        self, order: Order, receive: Callable[[Report], object], ended: Callable[[str], object]
    ) -> ReportingProcess[Report]:
        """Start the process of an order; `receive` gets its reports without errors, `ended` why it failed.

        Raises VisualHfsmError.
        """
        failed = ""

        def reported(report: Report) -> None:
            nonlocal failed
            failed = report.error
            if failed:
                self._report(error=failed)
            else:
                receive(report)

        def over(code: int, stopped: bool) -> None:
            error = failed
            if process.invalid is not None:
                error = f"the process of the trials wrote something else than a report: {process.invalid}"
            elif code and not failed and not stopped:
                error = f"the process of the trials ended with {code}: {process.words}".rstrip(": ")
            ended(error)

        process = ReportingProcess(_report, reported, over, self._limits.longest_report)
        command = [sys.executable, "-P", "-m", _PROCESS, msgspec.json.encode(order).decode()]
        try:
            await process.start(command, {**child_environment(self._include), "TMPDIR": self._files.name})
        except OSError as error:
            why = Message("the trials cannot be started: {reason}", reason=reason(error))
            ended(why)
            raise VisualHfsmError(why) from error
        return process

    def _ordered(self, action: Action, source: Source, choices: Choices) -> tuple[Order, object]:
        """Return the order to do something with a document as it is shown, and what all depends on.

        Raises VisualHfsmError when it has no file.
        """
        path = source.path
        if path is None:
            raise VisualHfsmError.because(
                "save the document first: trials use the plan and the files beside it"
            )
        try:
            content = written(source.document).encode() if source.dirty else path.read_bytes()
            digest = hashlib.sha256(content).hexdigest()
            kept = Path(self._files.name, f"{digest}.xml")
            if not kept.exists():
                kept.write_bytes(content)
        except OSError as error:
            raise VisualHfsmError.because(
                "{filename} cannot be read: {reason}", filename=error.filename, reason=reason(error)
            ) from error
        order = Order(
            action=action, document=str(path), content=str(kept), choices=choices, workers=self._state.workers
        )
        beside = [_changed_at(path.with_name(path.stem + suffix)) for suffix in (SUFFIX, OUTCOMES)]
        return order, (path, digest, choices, *beside)

    def _report(self, **changes: object) -> None:
        self._state = msgspec.structs.replace(self._state, **changes)
        self._publish(self._state)


def _report(line: bytes) -> Report:
    return typed.from_json(line, Report, dec_hook=decode_message)


def _changed_at(path: Path) -> tuple[int, int] | None:
    with contextlib.suppress(OSError):
        status = path.stat()
        return status.st_mtime_ns, status.st_size
    return None
