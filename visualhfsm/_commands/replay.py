"""`visualhfsm replay RECORDING [DOCUMENT]`: run a recording again, or an edited document against it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Final

import typer

from codegen.options import require_directories
from visualhfsm._base.options import Include, examples
from zenoh_ice.application.cli import finite

EPILOG: Final = examples(
    "replay run.mcap",
    "replay run.mcap behaviors/dance_and_follow.xml",
    "replay run.mcap edited.xml --from 12.5 --until 60 --json > replay.jsonl",
    notes="Exit codes: 0 the same states, 1 an error, 2 wrong usage, 3 it behaves otherwise.",
)

_OTHERWISE: Final = 3


def replay(
    recording: Annotated[
        Path,
        typer.Argument(
            metavar="RECORDING", exists=True, dir_okay=False, help="A recording, made with --record."
        ),
    ],
    document: Annotated[
        Path | None,
        typer.Argument(
            metavar="DOCUMENT", exists=True, dir_okay=False, help="The document to run; it may be edited."
        ),
    ] = None,
    include: Include = None,
    *,
    since: Annotated[
        float | None,
        typer.Option(
            "--from",
            metavar="SECONDS",
            min=0.0,
            callback=finite,
            help="Run what was recorded until then, and DOCUMENT from then on.",
        ),
    ] = None,
    until: Annotated[
        float | None,
        typer.Option(metavar="SECONDS", min=0.0, callback=finite, help="End there."),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print everything as JSON lines.")] = False,
    output: Annotated[
        bool, typer.Option("--output", help="Show what the document's code prints, on stderr.")
    ] = False,
) -> None:
    """Run a recorded component again, in virtual time, and compare.

    Everything that it read comes from the recording: the same document does the same, cycle by cycle. An
    edited DOCUMENT shows where it would have behaved differently. Without DOCUMENT the code in the recording
    is run: replay only recordings of people whose programs you trust.
    """
    if since is not None and document is None:
        raise typer.BadParameter("--from needs the DOCUMENT that takes over", param_hint="DOCUMENT")
    from visualhfsm._monitor.replay import replay_recording  # slow to import

    outcome = replay_recording(
        recording,
        document,
        [*require_directories(include)],
        since=since,
        until=until,
        as_json=as_json,
        shows_output=output,
    )
    if outcome.divergences:
        raise typer.Exit(_OTHERWISE)
