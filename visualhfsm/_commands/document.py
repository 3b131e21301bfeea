"""The command `visualhfsm document`: all that is known of a project as one HTML file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Final

import typer

from codegen.options import require_directories
from visualhfsm._base.options import Include, examples
from visualhfsm._commands.check import documents_of
from zenoh_ice.application.cli import finite

EPILOG: Final = examples("document", "document behaviors --out robot.html", "document dance.xml --no-run")


def document(
    project: Annotated[
        Path,
        typer.Argument(
            metavar="PROJECT", exists=True, help="A folder with documents, or one document (.xml)."
        ),
    ] = Path(),
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="HTML", dir_okay=False, help="The file to write.", show_default="the name of PROJECT"
        ),
    ] = None,
    include: Include = None,
    *,
    run: Annotated[
        bool, typer.Option("--run/--no-run", help="Run documents without errors, and their tests.")
    ] = True,
    patience: Annotated[
        float,
        typer.Option(
            metavar="S", min=1.0, max=86_400.0, callback=finite, help="Time of each run, and of its tests."
        ),
    ] = 60.0,
    force: Annotated[bool, typer.Option("--force", help="Overwrite HTML.")] = False,
) -> None:
    """Write the documentation of a project as one HTML file, to print, to send and to hand in.

    Of each document it shows all automata with their code, what they need, the properties with the verdicts
    of the model checker, the tests with their results, and what these reach. What is wrong with a document is
    said in its place. The file needs neither a server nor a network.
    """
    # Imported here: other commands need not wait for them.
    from visualhfsm import Project
    from visualhfsm._base.html_file import check_place, write_html
    from visualhfsm._commands.documentation import chapter_of, documentation_page

    name = project.resolve().stem
    target = out or Path(f"{name}.html")
    if target.exists() and not force:
        raise typer.BadParameter(f"{target} exists: --force overwrites it", param_hint="--out")
    check_place(target, force=force)
    paths = [*documents_of([project])]
    here = project.resolve().is_relative_to(Path.cwd())  # where the tests may be beside the folder
    root = Path() if here else project if project.is_dir() else project.parent
    chapters = []
    with Project(root, include=require_directories(include), granted=paths) as opened:
        for path in paths:
            typer.echo(f"{path} ...", err=True)
            chapters.append(chapter_of(opened, path.resolve(), runs=run, patience=patience))
    size = write_html(target, documentation_page(name, chapters))
    typer.echo(f"{target}: {size / 1e6:.1f} MB")
