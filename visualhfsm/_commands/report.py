"""The command `visualhfsm report`: a recorded run as one HTML file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Final

import typer

from visualhfsm._base.options import examples

EPILOG: Final = examples("report dance.mcap", "report recordings/dance.mcap hand-in/dance.html")


def report(
    recording: Annotated[
        Path, typer.Argument(metavar="RECORDING", exists=True, dir_okay=False, help="The file to read.")
    ],
    page: Annotated[
        Path | None,
        typer.Argument(
            metavar="HTML", dir_okay=False, help="The file to write.", show_default="RECORDING.html"
        ),
    ] = None,
    *,
    force: Annotated[bool, typer.Option("--force", help="Overwrite HTML.")] = False,
) -> None:
    """Write a recorded run as one HTML file: automata, variables, timeline, robot in 3D and pictures.

    The file needs neither a server nor a network. It contains the whole document with its code.
    """
    # Imported here: other commands need not wait for them.
    from visualhfsm._monitor.recordings import recorded_run
    from visualhfsm._monitor.run_page import write_run_page

    target = page or recording.with_suffix(".html")
    if target.exists() and not force:
        raise typer.BadParameter(f"{target} exists: --force overwrites it", param_hint="HTML")
    run = recorded_run(recording)
    size = write_run_page(target, run)
    typer.echo(f"{target}: {size / 1e6:.1f} MB")
    for failure in run.log.timeline().failures:
        typer.echo(f"made to fail: {failure}")
    if text := str(run.shortened):
        typer.echo(text)
