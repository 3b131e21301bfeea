"""`visualhfsm replay RECORDING [DOCUMENT]`: run a recording again, or an edited document against it."""

from __future__ import annotations

import shutil
import sys
import tempfile
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, Final

import msgspec
import typer

from codegen.commands.options import ErrorFormat, require_directories, show
from codegen.diagnostics import Diagnostics
from hfsm_recording.outcome import Begin, Line, Outcome, Progress
from visualhfsm.errors import VisualHfsmError
from zenoh_ice.command import finite, stop_on_signals

from .process import replay_in_process
from .sources import RecordedSources, open_file, sources_of
from .view import outcome_lines

__all__ = ["EPILOG", "replay"]

EPILOG: Final = """Examples:

visualhfsm replay run.mcap

visualhfsm replay run.mcap behaviors/dance_and_follow.xml

visualhfsm replay run.mcap edited.xml --from 12.5 --until 60 --json > replay.jsonl

Exit codes: 0 the same states, 1 an error, 2 wrong usage, 3 it behaves otherwise."""

_OTHERWISE: Final = 3


def replay(
    recording: Annotated[
        Path, typer.Argument(metavar="RECORDING", exists=True, dir_okay=False, help="A run, from --record.")
    ],
    document: Annotated[
        Path | None,
        typer.Argument(
            metavar="DOCUMENT", exists=True, dir_okay=False, help="The document to run, perhaps edited."
        ),
    ] = None,
    include: Annotated[
        list[Path] | None,
        typer.Option("-I", "--include", metavar="DIR", help="Find proxies and imported files in DIR, too."),
    ] = None,
    *,
    since: Annotated[
        float | None,
        typer.Option(
            "--from",
            metavar="SECONDS",
            min=0.0,
            callback=finite,
            help="Run what was recorded until then, and DOCUMENT from there.",
        ),
    ] = None,
    until: Annotated[
        float | None,
        typer.Option(metavar="SECONDS", min=0.0, callback=finite, help="End there."),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print everything as lines of JSON.")] = False,
    output: Annotated[
        bool, typer.Option("--output", help="Show what the document's code prints, on stderr.")
    ] = False,
) -> None:
    """Run a recorded component again, in virtual time, and compare.

    Whatever it read is read from the recording: the same document does the
    same, cycle by cycle. An edited DOCUMENT shows where it would have behaved
    otherwise. Without DOCUMENT the code in the recording is run: replay only
    recordings of people whose programs you would run.
    """
    if since is not None and document is None:
        raise typer.BadParameter("--from needs the DOCUMENT that takes over", param_hint="DOCUMENT")
    directories = require_directories(include)
    sources = sources_of(open_file(recording))
    if not as_json:
        _announce(sources, recording)
    with stop_on_signals() as stop, tempfile.TemporaryDirectory(prefix="visualhfsm-replay-") as folder:
        given = None if document is None else _generate(document, Path(folder, "given"), directories)
        arguments = [str(recording)]
        if given is None or since is not None:
            arguments.append(str(_recorded(sources, Path(folder, "recorded"))))
            if given is not None:
                arguments += ["--edited", str(given), "--from", str(since)]
        else:
            arguments.append(str(given))
        if until is not None:
            arguments += ["--until", str(until)]
        teller = _Teller(as_json=as_json)
        outcome = replay_in_process(arguments, directories, teller, stop, shows_output=output)
    assert outcome is not None  # a signal would have ended the command with the block
    if not as_json:
        for line in outcome_lines(outcome):
            typer.echo(line)
    if outcome.error:
        raise VisualHfsmError(f"at {outcome.seconds:.3f} s: {outcome.error}")
    if outcome.divergences:
        raise typer.Exit(_OTHERWISE)


class _Teller:
    """Tell of a replay while it runs."""

    def __init__(self, *, as_json: bool) -> None:
        self._as_json = as_json
        self._shows_progress = not as_json and sys.stderr.isatty()

    def __call__(self, line: Line) -> None:
        if self._as_json:
            typer.echo(msgspec.json.encode(line))
        elif isinstance(line, Begin) and line.truncated:
            typer.echo("the recording was cut off: it is replayed as far as it goes")
        elif isinstance(line, Progress) and self._shows_progress:
            typer.echo(f"\r{line.seconds:.0f} s ", nl=False, err=True)
        elif isinstance(line, Outcome) and self._shows_progress:
            typer.echo("\r", nl=False, err=True)


def _announce(sources: RecordedSources, recording: Path) -> None:
    when = (
        datetime.fromtimestamp(sources.start // 1_000_000_000, UTC).astimezone().strftime("%Y-%m-%d %H:%M:%S")
    )
    name = "".join(character if character.isprintable() else "?" for character in sources.name)
    typer.echo(f"{recording.name}: {name}, recorded on {when}")


def _generate(document: Path, folder: Path, include: list[Path]) -> Path:
    """Generate a document's component into a folder, with what is written by hand beside it."""
    from codegen.hfsm import compile_document, component_path, extension_path

    folder.mkdir()
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


def _recorded(sources: RecordedSources, folder: Path) -> Path:
    """Write the component of the recording into a folder, and say that it is going to be run."""
    folder.mkdir()
    file = sources.write(folder)
    typer.echo(f"the code that is run is that in the recording: {file.name}", err=True)
    return file
