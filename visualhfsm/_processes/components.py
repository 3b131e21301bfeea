"""Run the components of the editor's tabs: generate, start, stop and restart them.

Log lines and tracebacks lead back to the code of the document.
"""

from __future__ import annotations

import asyncio
import contextlib
import shutil
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final, Literal

from codegen.diagnostics import Diagnostics
from codegen.hfsm import (
    component_path,
    extension_path,
    interface_directories,
    read_document,
    write_document,
)
from codegen.hfsm.document import Document
from codegen.messages import NO_MESSAGE, Message
from codegen.reasons import reason
from visualhfsm._base.environment import child_environment
from visualhfsm._base.errors import VisualHfsmError
from visualhfsm._base.output_lines import LineReports, Lines
from visualhfsm._base.work import PerDocument
from visualhfsm._document.generate import generate_component
from visualhfsm._document.origins import Origin, Origins, read_origins
from visualhfsm._document.reasons import refusal
from visualhfsm._monitor import messages
from visualhfsm._processes.ahead import StartedAhead
from visualhfsm._processes.bodies import body_option, require_body
from visualhfsm._processes.failures import Failure, LastWords, describe_end
from zenoh_ice import Settings
from zenoh_ice.application import last_cycle
from zenoh_ice.application.child import ChildProcess

_Status = Literal["generating", "starting", "started", "stopping", "ended"]

_CLOSE_LIMITS: Final = (3.0, 2.0)
"""Seconds from SIGINT to SIGTERM, and from there to SIGKILL, when the editor ends."""

_DRY_RUN: Final = "visualhfsm.simulation._dry_run"
"""The module that runs a component without a robot."""
_WAIT: Final = ("--server-wait", "2")
"""A run waits no longer for a robot: the page says that there is none, and starts one."""
_NOT_STARTED: Final = Message("it could not be started")


class StartedComponents(PerDocument["StartedComponent"]):
    """At most one child process for each tab. All methods raise VisualHfsmError.

    `include` are directories with packages of interfaces, `folder` is that of documents without a file, by
    default the current one. With a folder for `sockets`, the processes listen there, and nowhere else.
    """

    def __init__(
        self,
        publish: messages.Publish,
        settings: Settings | None = None,
        include: Sequence[Path] = (),
        folder: Path | None = None,
        sockets: Path | None = None,
        *,
        limits: messages.PartLimits = messages.USUAL_LIMITS,
    ) -> None:
        super().__init__(self._component_of)
        self._limits = limits
        self._publish = publish
        self._include = tuple(include)
        self._folder = folder or Path.cwd()
        self._environment = settings.environment() if settings else {}
        self._sockets = sockets
        self._ahead = StartedAhead(self._shared_environment, limits.preparation)
        self._written: dict[Path, bytes] = {}
        """The components that were generated beside their documents, by their files."""

    def prepare(self) -> None:
        """Begin what makes the next start a fast one: a document was opened."""
        self._ahead.prepare()

    async def generate(self, source: messages.Source) -> Path:
        """Write the component beside its document, or where the tab's component runs; return its path."""
        if source.path is None and self.get(source.tab) is None:
            raise VisualHfsmError.because("save the document first: its component is written beside it")
        generated = await self.do(source.tab, lambda component: component.generate(source))
        return generated.component

    def names(self, *, dry: bool | None = None) -> set[str]:
        """Return the names of what starts or runs: with `dry` only of dry runs, or only of others."""
        return {name for each in self for name, is_dry in each.names if dry in (None, is_dry)}

    async def start(
        self,
        source: messages.Source,
        arguments: Sequence[str],
        *,
        dry_run: str | None = None,
        require_ready: Callable[[], None] = lambda: None,
    ) -> str:
        """Generate and start; the tab's former process is stopped first. Return the name of the component.

        A `dry_run` has a fake robot with the body of this name instead of the realm's robot. Without one,
        `require_ready` raises VisualHfsmError while nothing may begin; it is asked at the last moment.

        Nobody could distinguish two components of the same name: the second one is refused.
        """
        if dry_run is not None:
            dry_run = body_option(self._folder, await asyncio.to_thread(require_body, self._folder, dry_run))

        async def start(component: StartedComponent) -> None:
            if any(source.component in dict(other.names) for other in self if other is not component):
                raise VisualHfsmError.because(
                    "another document runs as {name}: stop it first, or save this one under another name",
                    name=source.component,
                )
            if dry_run is None:
                require_ready()
            await component.start(source, arguments, dry_run=dry_run)  # which takes the name before it waits

        await self.do(source.tab, start)
        return source.component

    async def stop(self, tab: int, by: messages.Stopper | None = None) -> None:
        """Stop the tab's process, if one runs; `by` says who wants that."""
        if (started := self.get(tab)) is not None:
            started.announce_stop(by)
        await super().stop(tab)

    def announce_stop(self, by: messages.Stopper | None = None) -> None:
        """Report that all processes are being stopped, before they are; `by` says who wants that."""
        for each in self:
            each.announce_stop(by)

    async def stop_all(self) -> None:
        """Stop all processes, also those that are being started."""
        await asyncio.gather(*map(super().stop, [*self._kept]))

    async def locate(
        self, source: messages.Source, text: str, automaton: int = 0, state: int = 0
    ) -> Origin | None:
        """Return the code to which a line of a log or a report refers, or None.

        A report has the `automaton` and the `state`, which distinguish pieces that share a line. It may come
        from a component that runs elsewhere, from the same file.
        """
        started = self.get(source.tab)
        origins = started.origins if started is not None else None
        if origins is None and source.path is not None:
            path = source.path
            origins = await asyncio.to_thread(read_origins, path, component_path(path, None), self._include)
        return None if origins is None else origins.find(text, automaton=automaton, state=state)

    async def close(self) -> None:
        """Stop everything that runs."""
        for each in self:
            each.patience = _CLOSE_LIMITS
        try:
            await super().close()
        finally:
            await self._ahead.close()

    def _shared_environment(self) -> dict[str, str]:
        return {**child_environment(), **self._environment}

    def _component_of(self, tab: int) -> StartedComponent:
        return StartedComponent(
            tab,
            self._publish,
            messages.own_listener(self._sockets),
            self._ahead,
            partial(_Directory, self._include, self._folder, self._written),
            patience=(self._limits.interruption, self._limits.termination),
        )


@dataclass(frozen=True, slots=True)
class _Generated:
    """A component that was written: its file, the origins of its lines, and if it has unsaved changes."""

    component: Path
    origins: Origins | None
    unsaved: bool


class StartedComponent:
    """The component of the document of a tab as a child process, which can be restarted any number of times.

    Its output and its changes are published on the event loop. `close` ends it in every case.
    """

    def __init__(
        self,
        tab: int,
        publish: messages.Publish,
        own_variables: Mapping[str, str],
        ahead: StartedAhead,
        make_directory: Callable[[], _Directory],
        *,
        patience: Sequence[float],
    ) -> None:
        self._tab = tab
        self.patience = patience
        """Seconds from SIGINT to SIGTERM, and from there to SIGKILL."""
        self._publish = publish
        self._own_variables = own_variables
        self._ahead = ahead
        self._make_directory = make_directory
        self._directory = make_directory()
        self._generated: _Generated | None = None
        self._process = ChildProcess(LineReports(self._receive), self._end)
        self._words = LastWords()
        self._last_cycle: Path | None = None
        """The file in which the component keeps what it executes."""
        self._stopping = False
        self._stopped_by: messages.Stopper | None = None
        self.component = ""
        """The name of the component that starts or runs; empty when there is none."""
        self._is_dry = False
        self._next = ("", False)
        """The name of the component that starts once the former one has ended, and true for a dry run."""

    @property
    def names(self) -> list[tuple[str, bool]]:
        """The names that no other component may have, each with whether it is a dry run."""
        return [each for each in ((self.component, self._is_dry), self._next) if each[0]]

    @property
    def origins(self) -> Origins | None:
        """The origins of the lines of the running component, or of the last one if it has unsaved changes."""
        generated = self._generated
        if generated is None or not (self._process.is_running or generated.unsaved):
            return None
        return generated.origins

    async def generate(self, source: messages.Source) -> _Generated:
        """Write the component, for a start or for a reload of the one that runs. Raises VisualHfsmError.

        The component of a document that has a file is written beside it, unless one runs elsewhere.
        """
        self._generated = await asyncio.to_thread(self._directory.generate, source, beside=True)
        return self._generated

    async def start(
        self, source: messages.Source, arguments: Sequence[str] = (), *, dry_run: str | None = None
    ) -> None:
        """Generate the component and start it; one that runs is stopped first. Raises VisualHfsmError.

        It is only stopped when the next one could be generated.
        """
        self._next = source.component, dry_run is not None
        directory, generated = self._make_directory(), None
        try:
            if self._process.is_running:
                generated = await asyncio.to_thread(directory.generate, source)
                await self.stop()
        except BaseException:
            self._next = ("", False)
            directory.close()
            raise
        self._directory.close()
        self._directory = directory
        (self.component, self._is_dry), self._next = self._next, ("", False)
        self._stopping = False
        self._stopped_by = None
        self._report("generating")
        try:
            if generated is None:
                generated = await asyncio.to_thread(directory.generate, source)
            self._generated = generated
            self._report("starting")
            runner = [] if dry_run is None else ["-P", "-m", _DRY_RUN, f"--body={dry_run}"]
            await self._launch(runner, [str(generated.component), *_WAIT, *arguments])
        except BaseException as error:
            message = error.message if isinstance(error, VisualHfsmError) else _NOT_STARTED
            self._report("ended", None, message)
            raise
        self._report("started")

    def announce_stop(self, by: messages.Stopper | None = None) -> None:
        """Report that the process, if there is one, is being stopped, and who was the first to want that."""
        if self.component:
            self._stopped_by = self._stopped_by or by
        if self._process.is_running and not self._stopping:
            self._stopping = True
            self._report("stopping")

    async def stop(self) -> None:
        """End the process, if there is one."""
        self.announce_stop()
        await self._process.stop(self.patience)

    async def close(self) -> None:
        """End the process, and delete its temporary files."""
        try:
            await self.stop()
        finally:
            self._process.kill()
            self._directory.close()

    async def _launch(self, runner: Sequence[str], command: Sequence[str]) -> None:
        self._words = LastWords()
        with VisualHfsmError.in_place_of(OSError, "the component cannot be started: {reason}"):
            kept = self._last_cycle = self._directory.file_for_last_cycle()
            own = {**self._own_variables, last_cycle.VARIABLE: str(kept)}
            self._process = await self._ahead.start(self._process, runner, command, own)

    def _end(self, code: int, stopped: bool) -> None:
        kept = last_cycle.read(self._last_cycle) if self._last_cycle else None
        origins = self._generated.origins if self._generated else None
        describe = partial(describe_end, code, self._words, kept, origins, stopped=stopped or self._stopping)
        end, by = describe(), self._stopped_by
        self._report_failures(self._words.failures.end(*end))
        self._report("ended", code, end.message, end.origin, describe(by=by).message if by else NO_MESSAGE)

    def _report(
        self,
        status: _Status,
        exit_code: int | None = None,
        message: Message = NO_MESSAGE,
        origin: Origin | None = None,
        elsewhere: Message = NO_MESSAGE,
    ) -> None:
        self._publish(
            messages.StartedPush(
                tab=self._tab,
                component=self.component,
                status=status,
                exit_code=exit_code,
                message=message,
                elsewhere=elsewhere,
                place=origin.place if origin else None,
                line=origin.line if origin else 0,
            )
        )
        if status == "ended":
            self.component = ""

    def _report_failures(self, found: Iterable[Failure]) -> None:
        origins = self._generated.origins if self._generated else None
        for each in found:
            texts = origins.texts(each.origin.place) if origins else ()
            self._publish(
                messages.Failed(tab=self._tab, origin=each.origin, message=each.message, texts=texts)
            )

    def _receive(self, written: Lines) -> None:
        lines = [self._line(stream, text) for stream, text in written.lines]
        self._publish(messages.Output(tab=self._tab, lines=lines, dropped=written.dropped))

    def _line(self, stream: Literal["out", "err"], text: str) -> messages.OutputLine:
        origins = self._generated.origins if self._generated else None
        origin = origins.find(text) if origins else None
        if stream == "err":
            self._report_failures(self._words.parse(text, origin))
        if origin is None:
            return messages.OutputLine(text=text, stream=stream)
        return messages.OutputLine(text=text, stream=stream, place=origin.place, line=origin.line)


class _Directory:
    """The place where the component of a document is generated, again after each change.

    The component of a document that is saved is written beside it, as `codegen` does. A document with unsaved
    changes is generated from a copy in a temporary directory, which `close` deletes; its component is written
    there, too, unless one beside the file is to be updated.
    """

    def __init__(self, include: tuple[Path, ...], folder: Path, written: dict[Path, bytes]) -> None:
        self._include = include
        self._folder = folder
        self._written = written
        self._aside: TemporaryDirectory[str] | None = None
        self._notes: TemporaryDirectory[str] | None = None
        self._target: Path | None = None

    def generate(self, source: messages.Source, *, beside: bool = False) -> _Generated:
        """Write the component. Raises VisualHfsmError, with the first reason of a verdict after errors.

        `beside` writes it beside the file also when that lacks the changes. After that the place stays the
        same: a running component reloads its file.
        """
        diagnostics = Diagnostics(decoded=True)
        path = source.path
        include: Sequence[Path] = self._include
        if path is not None and not source.dirty:
            file = path
        else:
            file = self._copy(source.document, path.name if path else f"{source.component}.xml")
            include = interface_directories(path or self._folder / file.name, include)
        target = self._target or (path.parent if beside and path else file.parent)
        if path is not None and self._aside is not None and target == Path(self._aside.name):
            _copy_extension(path, target / file.name)
        written = self._written if path is not None and target == path.parent else None
        content = read_document(file, diagnostics)
        component = None
        if content is not None:
            component = generate_component(
                file, target, diagnostics, include, document=content, written=written
            )
        if component is None:
            raise refusal(file, diagnostics, include, document=content, home=path)
        self._target = target
        origins = read_origins(file, component, include, home=path, content=content)
        return _Generated(component, origins, unsaved=file != path)

    def file_for_last_cycle(self) -> Path:
        """Make the file in which a component that starts keeps what it executes. Raises OSError."""
        if self._notes is None:
            self._notes = TemporaryDirectory(prefix="visualhfsm-run-", ignore_cleanup_errors=True)
        path = Path(self._notes.name) / "last_cycle"
        last_cycle.create(path)
        return path

    def close(self) -> None:
        """Delete the temporary files."""
        for directory in (self._aside, self._notes):
            if directory is not None:
                directory.cleanup()
        self._aside = self._notes = self._target = None

    def _copy(self, document: Document, name: str) -> Path:
        try:
            if self._aside is None:
                self._aside = TemporaryDirectory(prefix="visualhfsm-", ignore_cleanup_errors=True)
            source = Path(self._aside.name) / name
            source.write_text(write_document(document), encoding="utf-8")
        except OSError as error:
            raise VisualHfsmError.because(
                "nothing was generated: {reason}: {filename}", reason=reason(error), filename=error.filename
            ) from error
        return source


def _copy_extension(path: Path, copy: Path) -> None:
    """Copy the handwritten files beside a document to its copy."""
    with contextlib.suppress(FileNotFoundError):
        shutil.copyfile(
            extension_path(component_path(path, None)), extension_path(component_path(copy, None))
        )
