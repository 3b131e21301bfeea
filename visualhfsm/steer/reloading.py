"""What the command `reload` does: compile a document and let the running component go on in it."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import typer

from codegen.diagnostics import Diagnostics
from codegen.hfsm import component_path
from interfaces.hfsm import ReloadRefused
from visualhfsm.errors import VisualHfsmError
from visualhfsm.generate import generate_component
from visualhfsm.steer.actions import print_json
from visualhfsm.steer.target import Target
from visualhfsm.watch.automata import printable

__all__ = ["RELOAD_PATIENCE", "reload_document"]

RELOAD_PATIENCE: Final = 30_000
"""Milliseconds that a component may take to load its file, with its libraries."""
_PLACES: Final = (Path(), Path("behaviors"))


def reload_document(
    target: Target, document: Path | None, output: Path | None, include: Sequence[Path], *, as_json: bool
) -> None:
    """Compile a document, write the component's file, and reload the component.

    Errors of the document are shown and end the command with exit code 1 before anything is touched. When the
    component refuses, its file gets its former content back. Raises VisualHfsmError and ReloadRefused.
    """
    path = document or _find(target)
    file = component_path(path, output)
    former = file.read_bytes() if file.is_file() else None
    written = _generate(path, output, include)
    try:
        report = target.monitor.ice_invocationTimeout(RELOAD_PATIENCE).reload()
    except ReloadRefused:
        if former is not None:
            written.write_bytes(former)
        raise
    if as_json:
        print_json(report)
        return
    typer.echo(f"{written} is written")
    typer.echo(f"{target.name} was reloaded, and held for {report.held * 1000:.1f} ms")
    for sentence in report.notKept:
        typer.echo(f"not kept: {printable(sentence)}")


def _find(target: Target) -> Path:
    """Return the document of a component; its file name is known."""
    name = Path(target.structure.document).name
    found = [place / name for place in _PLACES if name and (place / name).is_file()]
    if len(found) == 1:
        return found[0]
    places = " and ".join(str(path) for path in found) if found else "not here nor in behaviors/"
    raise VisualHfsmError(f"which document? {printable(name) or 'it'} is {places}: name it")


def _generate(document: Path, output: Path | None, include: Sequence[Path]) -> Path:
    diagnostics = Diagnostics()
    written = generate_component(document, output, diagnostics, include)
    if len(diagnostics):
        rendered = diagnostics.render(color=sys.stderr.isatty(), outcome="nothing was written or reloaded")
        typer.echo(rendered, err=True)
    if written is None:
        raise typer.Exit(1)
    return written
