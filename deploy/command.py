"""What `nao stack` does."""

from __future__ import annotations

import asyncio
import shlex
from collections.abc import Iterable
from pathlib import Path

import typer

from deploy.launcher import Launcher, free_endpoint
from deploy.stack import Stack
from deploy.units import write_compose_file, write_units

__all__ = ["parse_changes", "start", "write"]


def start(stack: Stack, changes: dict[str, str], seconds: float | None) -> int:
    """Start the processes of a stack, stop all of them together, and return the exit code.

    `seconds` limits how long they run. Raises StackError for a variable that the stack does not have, and
    when its endpoint or the place of its logs cannot be used.
    """
    # A stack whose foreground process counts the seconds itself says so by having that variable.
    counts_itself = "seconds" in stack.variables
    if seconds is not None and counts_itself:
        changes["seconds"] = f"{seconds:g}"
    if stack.endpoint and "endpoint" not in changes:
        changes["endpoint"] = free_endpoint(stack.endpoint)
        if changes["endpoint"] != stack.endpoint:
            typer.echo(f"{stack.endpoint} is in use, perhaps by another robot server; using another endpoint")
    processes = stack.with_variables(changes)
    logs = Path(stack.log_dir)
    typer.echo(f"Starting {stack.name}: {', '.join(process.name for process in processes)}")
    typer.echo(f"  logs in {logs}{', endpoint ' + changes['endpoint'] if stack.endpoint else ''}")
    limit = None if counts_itself or not seconds else seconds
    return asyncio.run(Launcher(processes, logs, typer.echo, limit).run())


def write(stack: Stack, changes: dict[str, str], units: Path | None, compose: Path | None) -> None:
    """Write the processes of a stack as units of systemd into a folder, as a compose file, or both.

    Raises StackError for a variable that the stack does not have, and when a file cannot be written.
    """
    processes = stack.with_variables(changes)
    for process in processes:
        if process.foreground:
            typer.echo(f"left out, since it needs a terminal: {shlex.join(process.command)}")
    if units:
        for path in write_units(stack.name, processes, units):
            typer.echo(f"wrote {path}")
        typer.echo(
            f"next: sudo cp {shlex.quote(str(units))}/{stack.name}*.* /etc/systemd/system/"
            f" && sudo systemctl daemon-reload && sudo systemctl enable --now {stack.name}.target"
        )
    if compose:
        typer.echo(f"wrote {write_compose_file(stack.name, processes, compose)}")
        typer.echo(f"next: VISUALHFSM_IMAGE=... docker compose -f {shlex.quote(str(compose))} up -d")


def parse_changes(settings: Iterable[str]) -> dict[str, str]:
    """Return the variables that `--set NAME=VALUE` gives."""
    changes = {}
    for setting in settings:
        name, equals, value = setting.partition("=")
        if not equals or not name:
            raise typer.BadParameter(f"{setting!r} is not NAME=VALUE", param_hint="--set")
        changes[name] = value
    return changes
