"""One run of a component: generated, started, told about, stopped, started again."""

from __future__ import annotations

import asyncio
import signal
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal

from codegen.hfsm.document import Document
from visualhfsm.child import child_environment
from visualhfsm.errors import VisualHfsmError

from .directory import Generated, RunDirectory
from .origins import Origin, Origins
from .process import ChildProcess, Lines, Stream

__all__ = ["DocumentSource", "OutputLine", "Run", "RunChange", "Status", "describe_exit"]

Status = Literal["generating", "starting", "running", "stopping", "ended"]

PATIENCE: Final = (5.0, 3.0)
"""Seconds from SIGINT, at which a component stops the robot, to SIGTERM, and from there to SIGKILL."""

_INTERRUPTED: Final = 130
_TERMINATED: Final = 143


@dataclass(frozen=True, slots=True)
class DocumentSource:
    """A document as it stands in the editor; `dirty` says that its file holds something else."""

    document: Document
    path: Path | None
    dirty: bool
    title: str = ""


@dataclass(frozen=True, slots=True)
class OutputLine:
    """A line that a component wrote, and the line of the document's code of which it speaks, if any."""

    stream: Stream
    text: str
    origin: Origin | None


@dataclass(frozen=True, slots=True)
class RunChange:
    """What became of a run; `exit_code` is minus the number of the signal that ended it, if one did."""

    status: Status
    exit_code: int | None = None
    message: str = ""


class Run:
    """The component of one document as a child process; started anew as often as wanted.

    What happens is told on the event loop, the output through `told` (lines, and how many older ones were
    left out) and all else through `changed`. It ends with `close`, on every way out.
    """

    def __init__(
        self,
        told: Callable[[Sequence[OutputLine], int], None],
        changed: Callable[[RunChange], None],
        environment: Mapping[str, str] | None = None,
    ) -> None:
        self._told = told
        self._changed = changed
        self._environment = dict(environment or {})
        self._directory = RunDirectory()
        self._generated: Generated | None = None
        self._child: ChildProcess | None = None
        self._watch: asyncio.Task[None] | None = None
        self._stopping = False
        self._busy = asyncio.Lock()

    @property
    def is_running(self) -> bool:
        """Whether the process is there."""
        return self._watch is not None and not self._watch.done()

    @property
    def origins(self) -> Origins | None:
        """Where the lines of the component that runs come from; None while none does."""
        return self._generated.origins if self._generated and self.is_running else None

    async def generate(self, source: DocumentSource) -> Generated:
        """Write the component, for a start or for a reload of the one that runs. Raises VisualHfsmError.

        The component of a document that has a file is written beside it, unless one runs elsewhere.
        """
        async with self._busy:
            return await self._generate(source, beside=True)

    async def start(self, source: DocumentSource, arguments: Sequence[str] = ()) -> None:
        """Generate the component and start it; one that runs is stopped first. Raises VisualHfsmError."""
        async with self._busy:
            await self._stop(PATIENCE)
            self._directory.close()
            self._changed(RunChange("generating"))
            try:
                generated = await self._generate(source)
                self._changed(RunChange("starting"))
                await self._launch([sys.executable, str(generated.component), *arguments])
            except BaseException as error:
                told = str(error) if isinstance(error, VisualHfsmError) else "it could not be started"
                self._changed(RunChange("ended", None, told))
                raise
            self._changed(RunChange("running"))

    async def stop(self, patience: Sequence[float] = PATIENCE) -> None:
        """End the process; nothing happens when there is none."""
        async with self._busy:
            await self._stop(patience)

    async def close(self, patience: Sequence[float] = PATIENCE) -> None:
        """End the process, and delete what was generated aside."""
        try:
            await self.stop(patience)
        finally:
            if self._child is not None:
                self._child.kill()
            self._directory.close()

    async def _generate(self, source: DocumentSource, *, beside: bool = False) -> Generated:
        self._generated = await asyncio.to_thread(
            self._directory.generate,
            source.document,
            source.path,
            dirty=source.dirty,
            beside=beside,
            title=source.title,
        )
        return self._generated

    async def _launch(self, command: Sequence[str]) -> None:
        child = ChildProcess(self._take)
        try:
            await child.start(command, child_environment() | self._environment)
        except OSError as error:
            raise VisualHfsmError(f"the component cannot be started: {error.strerror or error}") from error
        self._child = child
        self._stopping = False
        self._watch = asyncio.create_task(self._follow(child))

    async def _stop(self, patience: Sequence[float]) -> None:
        if self._child is None or self._watch is None or self._watch.done():
            return
        self._stopping = True
        self._changed(RunChange("stopping"))
        await self._child.stop(patience)
        await self._watch

    async def _follow(self, child: ChildProcess) -> None:
        code = await child.wait()
        message = describe_exit(code, stopped=self._stopping)
        self._changed(RunChange("ended", code, message))

    def _take(self, written: Lines) -> None:
        origins = self._generated.origins if self._generated else None
        lines = [
            OutputLine(stream, text, origins.find(text) if origins else None)
            for stream, text in written.lines
        ]
        self._told(lines, written.dropped)


def describe_exit(code: int, *, stopped: bool) -> str:
    """Say in words how a component ended; `stopped` when it was told to."""
    if code == 0 or (stopped and code in (_INTERRUPTED, _TERMINATED)):
        return "it was stopped" if stopped else "it has ended by itself"
    if code > 0:
        hint = {1: " after an error", 2: ": its command line is wrong", _INTERRUPTED: " by Ctrl-C"}
        return f"it ended with exit code {code}{hint.get(code, '')}"
    name = signal.Signals(-code).name if -code in signal.valid_signals() else f"signal {-code}"
    return f"it was ended by {name}"
