"""Run a recording again in a separate process, and print what differs."""

from __future__ import annotations

import asyncio
import shutil
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from datetime import UTC, datetime
from itertools import chain, zip_longest
from pathlib import Path
from typing import Any, Final, TypeVar

import msgspec
import typer
from msgspec.structs import replace

from codegen.diagnostics import Diagnostics
from codegen.messages import Message
from codegen.options import ErrorFormat, show
from codegen.reasons import reason
from hfsm_runtime.recording_file.messages import WATCHED
from hfsm_runtime.recording_file.outcome import (
    Begin,
    Difference,
    Divergence,
    Line,
    Outcome,
    Progress,
    Side,
    Step,
)
from hfsm_runtime.recording_file.reader import RecordingError, RecordingFile
from visualhfsm._base.environment import child_environment
from visualhfsm._base.errors import VisualHfsmError
from visualhfsm._base.reporting_process import ReportingProcess
from zenoh_ice.application.cli import stop_on_signals
from zenoh_ice.data import typed
from zenoh_ice.data.status import own_version
from zenoh_ice.data.text import printable

_T = TypeVar("_T", Step, Divergence, Difference)

_ROWS: Final = 40
_MOST_LINES: Final = 10
_WIDE: Final = 34
_LONG_TEXT: Final = 60
_SILENCE: Final = 90.0
"""Seconds without output after which the process is stopped: it reports its progress each second."""
_CHECK_PERIOD: Final = 0.2  # s between two checks for a signal
_LONGEST_LINE: Final = 64 << 20
_END_LIMIT: Final = 5.0  # s
_VERBS: Final = {"entered": "", "ghost": " (ghost)", "resumed": " (goes on)", "finished": " (finished)"}


def replay_recording(
    recording: Path,
    document: Path | None,
    include: Sequence[Path],
    *,
    since: float | None,
    until: float | None,
    as_json: bool,
    shows_output: bool,
) -> Outcome:
    """Run a recording again, with a document's code or its own, print what differs, and return how it ended.

    `include` are directories in which the component finds packages. From `since` on, in s of the recording,
    the document takes over from the recorded code; `until` ends it. Raises VisualHfsmError.
    """
    directories = [*include]
    with VisualHfsmError.in_place_of(RecordingError):
        recorded = RecordingFile(recording)
    if WATCHED in recorded.metadata:
        raise VisualHfsmError.because(
            "{recording} was recorded to be looked at: what --record writes is replayed",
            recording=str(recording),
        )
    if recorded.altered:
        raise VisualHfsmError.because(
            "{recording} is damaged: its {files} is not what was recorded",
            recording=str(recording),
            files=", ".join(recorded.altered),
        )
    if not as_json:
        _announce(recorded, recording)
    with stop_on_signals() as stop, tempfile.TemporaryDirectory(prefix="visualhfsm-replay-") as folder:
        given = None if document is None else _generate(document, Path(folder, "given"), directories)
        arguments = [str(recording)]
        if given is None or since is not None:
            arguments.append(str(_write_recorded(recorded, Path(folder, "recorded"))))
            directories += _interfaces_beside(recording)
            if given is not None:
                arguments += ["--edited", str(given), "--from", str(since)]
        else:
            arguments.append(str(given))
        if until is not None:
            arguments += ["--until", str(until)]
        report = _Report(as_json=as_json)
        outcome = asyncio.run(
            _run_in_process(arguments, directories, report, stop, shows_output=shows_output)
        )
    assert outcome is not None  # a signal would have ended the command with the block
    if not as_json:
        for line in outcome_lines(outcome):
            typer.echo(line)
    if outcome.error:
        raise VisualHfsmError.because(
            "at {seconds:.3f} s: {error}", seconds=outcome.seconds, error=outcome.error
        )
    return outcome


class _Report:
    """Print the progress of a replay."""

    def __init__(self, *, as_json: bool) -> None:
        self._as_json = as_json
        self._shows_progress = not as_json and sys.stderr.isatty()

    def __call__(self, line: Line) -> None:
        if self._as_json:
            typer.echo(msgspec.json.encode(line))
        elif isinstance(line, Begin):
            for failure in line.failures:
                typer.echo(printable(f"made to fail: {failure}"))
            if line.truncated:
                typer.echo("the recording was cut off: it is replayed as far as it goes")
        elif isinstance(line, Progress) and self._shows_progress:
            typer.echo(f"\r{line.seconds:.0f} s ", nl=False, err=True)
        elif isinstance(line, Outcome) and self._shows_progress:
            typer.echo("\r", nl=False, err=True)


def _announce(recorded: RecordingFile, recording: Path) -> None:
    when = (
        datetime.fromtimestamp(recorded.start // 1_000_000_000, UTC)
        .astimezone()
        .strftime("%Y-%m-%d %H:%M:%S")
    )
    theirs, own = printable(recorded.version), own_version()
    by = "" if theirs == own else f" by VisualHFSM {theirs}, this is {own}"
    typer.echo(f"{recording.name}: {printable(recorded.name)}, recorded on {when}{by}")


def _generate(document: Path, folder: Path, include: list[Path]) -> Path:
    """Generate a document's component into a folder, with the handwritten files beside it."""
    from codegen.hfsm import compile_document, component_path, extension_path

    folder.mkdir()
    shutil.copy(document, folder)  # beside its component, so that errors name its lines
    by_hand = extension_path(component_path(document, None))
    if by_hand.is_file():
        shutil.copy(by_hand, folder)
    diagnostics = Diagnostics()
    files = compile_document(document, folder, diagnostics, include)
    if files is None:
        show(diagnostics, ErrorFormat.TEXT, "nothing was replayed")
        raise typer.Exit(1)
    for file in files:
        file.path.write_text(file.text, encoding="utf-8")
    return files[0].path


def _interfaces_beside(recording: Path) -> list[Path]:
    """Return where the project of a recording has its interfaces, which the recorded component imports."""
    from codegen.hfsm import interface_directories

    return [each for each in interface_directories(recording) if (each / "interfaces").is_dir()]


def _write_recorded(recorded: RecordingFile, folder: Path) -> Path:
    """Write the component of the recording into a folder, and report that it will be run."""
    files = recorded.files
    if "component" not in files:
        raise VisualHfsmError.because("the recording does not contain its component: name the document")
    folder.mkdir()
    for kind in ("component", "extension", "document"):
        if kind in files:
            name, content = files[kind]
            (folder / name).write_bytes(content)
    file = folder / files["component"][0]
    typer.echo(f"the code is that of the recording: {file.name}", err=True)
    return file


async def _run_in_process(
    arguments: Sequence[str],
    include: Sequence[Path],
    report: Callable[[Line], None],
    stop: threading.Event,
    *,
    shows_output: bool,
) -> Outcome | None:
    """Run `hfsm_runtime._replay` with these arguments; return how it ended, or None when `stop` was set.

    `report` gets each line. `include` are directories in which the component finds packages. Raises
    VisualHfsmError.
    """
    lines: asyncio.Queue[Line | int] = asyncio.Queue()
    process = ReportingProcess[Line](
        typed.json_decoder(Line),
        lines.put_nowait,
        lambda code, _: lines.put_nowait(code),
        _LONGEST_LINE,
        sys.stderr.buffer if shows_output else None,
    )
    await process.start(
        [sys.executable, "-P", "-m", "hfsm_runtime._replay", *arguments], child_environment(include)
    )
    reported_at = time.monotonic()
    try:
        while not stop.is_set():
            try:
                line = await asyncio.wait_for(lines.get(), _CHECK_PERIOD)
            except TimeoutError:
                if time.monotonic() - reported_at < _SILENCE:
                    continue
                raise VisualHfsmError.because(
                    "the replay has sent nothing for {silence:g} s and was stopped", silence=_SILENCE
                ) from None
            if isinstance(line, int):
                raise VisualHfsmError(_failure(line, process))
            reported_at = time.monotonic()
            report(line)
            if isinstance(line, Outcome):
                return line
        return None
    finally:
        await process.stop((0.0, _END_LIMIT))


def _failure(code: int, process: ReportingProcess[Line]) -> Message:
    if process.invalid is not None:
        return Message("the replay sent an invalid message: {reason}", reason=reason(process.invalid))
    text = " ".join(process.words.split())
    why = text.rpartition("error: ")[2] if "error: " in text else text
    return Message.verbatim(why) if why else Message("the replay ended with exit code {code}", code=code)


def outcome_lines(outcome: Outcome) -> Iterator[str]:
    """Yield the lines of the result of a replay: the first difference, both timelines, and guessed values."""
    outcome = _with_ids(outcome)
    yield from (f"note: {printable(note)}" for note in outcome.notes)
    cycles = f"{outcome.cycles:,}".replace(",", " ")
    verb = "stopped short after" if outcome.error else "replayed"
    did = f"{verb} {outcome.seconds:.1f} s, {cycles} cycles"
    if outcome.divergences:
        # 0 is the component, with differing events: most often of an automaton that is counted anyway.
        count = len({found.automaton for found in outcome.divergences} - {0}) or 1
        yield f"{did}: {count} {'automaton behaves' if count == 1 else 'automata behave'} otherwise"
        yield ""
        yield from _first(outcome.divergences[0])
        yield ""
        yield from _timelines(outcome.recorded, outcome.replayed, outcome.divergences[0].time)
    elif outcome.error:
        yield f"{did}: {printable(outcome.error)}"
    else:
        yield f"{did}, identical" if outcome.identical else f"{did}: the same states"
    if outcome.missing_cycles:
        yield f"{outcome.missing_cycles} cycles of the recording were not run"
    yield from _differences(outcome.differences)
    yield from _guesses(outcome.guesses)


def _with_ids(outcome: Outcome) -> Outcome:
    """Return an outcome in which automata of the same name are shown with their ids."""
    everything: Iterator[Step | Divergence | Difference] = chain(
        outcome.divergences, outcome.recorded, outcome.replayed, outcome.differences
    )
    ids: dict[str, set[int]] = {}
    for found in everything:
        ids.setdefault(found.name, set()).add(found.automaton)

    def named(found: _T) -> _T:
        alone = len(ids[found.name]) == 1
        return found if alone else replace(found, name=f"{found.name} ({found.automaton})")

    return replace(
        outcome,
        divergences=[named(each) for each in outcome.divergences],
        recorded=[named(each) for each in outcome.recorded],
        replayed=[named(each) for each in outcome.replayed],
        differences=[named(each) for each in outcome.differences],
    )


def _first(found: Divergence) -> Iterator[str]:
    recorded, replayed = found.recorded, found.replayed
    state = printable(recorded.state) or "-"
    yield f"first at {found.time:.3f} s: {printable(found.name)} in the state {state}"
    yield _row("", "recorded", "replayed")
    for name in dict.fromkeys([*recorded.guards, *replayed.guards]):
        yield _row(f"guard {name}", _value(recorded, name), _value(replayed, name))
    yield _row("fired", _listed(recorded.fired), _listed(replayed.fired))
    errors = [*zip_longest(recorded.errors, replayed.errors, fillvalue="-")]
    for ours, theirs in errors[:_MOST_LINES]:
        yield _row("error", ours, theirs)
    if len(errors) > _MOST_LINES:
        yield f"... and {len(errors) - _MOST_LINES} more errors: --json has all"
    yield _row("then in", recorded.state_after or "-", replayed.state_after or "-")


def _timelines(recorded: Sequence[Step], replayed: Sequence[Step], since: float) -> Iterator[str]:
    ours = {(step.time, step.automaton, step.kind, step.state): step for step in recorded}
    theirs = {(step.time, step.automaton, step.kind, step.state): step for step in replayed}
    rows = sorted((ours | theirs).items(), key=lambda row: row[0][:2])
    before = [row for row in rows if row[0][0] < since][-3:]
    after = [row for row in rows if row[0][0] >= since]
    yield f"{'time':>12}  {'automaton':<{_WIDE - 12}}{'recorded':<{_WIDE}}replayed"
    for key, step in before + after[:_ROWS]:
        shown = printable(step.state) + _VERBS.get(step.kind, "")
        left, right = (shown if key in side else "" for side in (ours, theirs))
        mark = " " if left == right else "*"
        name = printable(step.name)[: _WIDE - 13]
        yield f"{step.time:>10.3f} s{mark} {name:<{_WIDE - 12}}{left:<{_WIDE}}{right}".rstrip()
    if len(after) > _ROWS:
        yield f"... and {len(after) - _ROWS} more: --json has all"


def _differences(differences: Sequence[Difference]) -> Iterator[str]:
    if differences:
        yield ""
        yield "other values, the first of each:"
    for found in differences[:_MOST_LINES]:
        recorded, replayed = _shown(found.recorded), _shown(found.replayed)
        what = f"{found.kind} {printable(found.what)}"
        yield f"{found.time:>10.3f} s  {printable(found.name)}: {what} was {recorded} and is {replayed}"
    if len(differences) > _MOST_LINES:
        yield f"... and {len(differences) - _MOST_LINES} more: --json has all"


def _guesses(guesses: dict[str, int]) -> Iterator[str]:
    if guesses:
        yield ""
        yield "values requested now that were not requested then; each got the newest earlier value:"
    for what, count in list(guesses.items())[:_MOST_LINES]:
        yield f"{count:>8} x {printable(what)}"
    if len(guesses) > _MOST_LINES:
        yield f"... and {len(guesses) - _MOST_LINES} more: --json has all"


def _row(label: str, recorded: str, replayed: str) -> str:
    left = printable(recorded)[: _WIDE - 1]
    return f"  {printable(label)[:_WIDE]:<{_WIDE}}{left:<{_WIDE}}{printable(replayed)[:_LONG_TEXT]}".rstrip()


def _value(side: Side, guard: str) -> str:
    return str(side.guards[guard]).lower() if guard in side.guards else "-"


def _listed(names: Sequence[str]) -> str:
    return ", ".join(names) or "-"


def _shown(value: Any) -> str:  # noqa: ANN401 - JSON
    text = "nothing" if value is None else repr(value)
    return printable(text if len(text) <= _LONG_TEXT else f"{text[:_LONG_TEXT]}...")
