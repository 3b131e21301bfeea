"""The command `python -m deploy`."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Annotated

import typer

from deploy.launcher import Launcher, free_endpoint
from deploy.stack import load_stack
from hfsm_command.cli import finite

__all__ = ["app"]

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)

_EPILOG = """Examples:

python -m deploy deploy/demo.toml

python -m deploy deploy/demo.toml --seconds 60

python -m deploy deploy/demo.toml --set speed=5"""


@app.command(epilog=_EPILOG)
def launch(
    stack: Annotated[Path, typer.Argument(help="Stack file (TOML).", metavar="STACK.toml")],
    seconds: Annotated[
        float | None,
        typer.Option(min=0.0, callback=finite, help="Stop after this many seconds; 0 means never."),
    ] = None,
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="NAME=VALUE", help="Change a variable of the stack; repeatable."),
    ] = None,
) -> None:
    """Start the processes of a stack file and stop them all together.

    Each writes its own log file; the foreground process, if the stack
    has one, gets the terminal. Ctrl-C ends everything in reverse order; a
    second Ctrl-C at once.
    """
    description = load_stack(stack)
    changes = dict(_parse(setting) for setting in settings or [])
    # A stack whose foreground process counts the seconds itself says so by having that variable.
    counts_itself = "seconds" in description.variables
    if seconds is not None and counts_itself:
        changes["seconds"] = f"{seconds:g}"
    if description.endpoint and "endpoint" not in changes:
        changes["endpoint"] = free_endpoint(description.endpoint)
        if changes["endpoint"] != description.endpoint:
            typer.echo(
                f"{description.endpoint} is in use, perhaps by another robot server; using another endpoint"
            )
    processes = description.with_variables(changes)
    logs = Path(description.log_dir)
    typer.echo(f"Starting {description.name}: {', '.join(process.name for process in processes)}")
    typer.echo(f"  logs in {logs}{', endpoint ' + changes['endpoint'] if description.endpoint else ''}")
    limit = None if counts_itself or not seconds else seconds
    launcher = Launcher(processes, logs, typer.echo, limit)
    raise typer.Exit(asyncio.run(launcher.run()))


def _parse(setting: str) -> tuple[str, str]:
    name, equals, value = setting.partition("=")
    if not equals or not name:
        raise typer.BadParameter(f"{setting!r} is not NAME=VALUE", param_hint="--set")
    return name, value
