"""The command `visualhfsm`, with `edit` and `watch`."""

from __future__ import annotations

import os
import re
import stat
import sys
from contextlib import nullcontext
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Annotated, Final
from urllib.parse import urlsplit

import typer

from codegen.options import require_directories
from visualhfsm._base.errors import MissingPackageError
from visualhfsm._base.options import examples
from visualhfsm._commands import check, convert, diff, document, draw, new, replay, report, verdict
from visualhfsm._commands.plugged import WithPlugged
from visualhfsm._commands.steer import register as register_steering
from zenoh_ice.application.cli import finite, report_ready, with_settings
from zenoh_ice.settings import Settings

if TYPE_CHECKING:  # it needs the packages of the extra `web`
    from visualhfsm._editor.server import Occasion

app = typer.Typer(cls=WithPlugged, add_completion=False, pretty_exceptions_enable=False)

_PACKAGES: Final = frozenset({"h11", "starlette", "uvicorn", "websockets"})
"""Packages of the extra `web` that the server needs from the start."""

_EDIT_EPILOG: Final = examples(
    "edit",
    "edit --demo",
    "edit behaviors/dance_and_follow.xml",
    "edit run.mcap",
    "edit --root ~/robots --port 8800 --no-browser",
    "edit -I ~/robots/shared",
    "edit --port 8800 --base-path /robots/ --allow-host robots.example",
)
_WATCH_EPILOG: Final = examples(
    "watch", "watch dance_and_follow --seconds 60 --report report.html", "watch follow_ball > log.txt"
)


@app.callback(invoke_without_command=True)
def visualhfsm(context: typer.Context) -> None:
    """Draw, check, compare and convert automata; watch, steer and replay the components generated from them.

    Without a command it is `visualhfsm edit --demo`.
    """
    if context.invoked_subcommand is None:
        command = context.command.commands["edit"]  # type: ignore[attr-defined]
        with command.make_context("edit", ["--demo"], parent=context) as own:
            command.invoke(own)


@app.command(epilog=_EDIT_EPILOG)
@with_settings(defaults={"clock": "wall"})
def edit(
    *,
    settings: Settings,
    files: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="FILES",
            exists=True,
            dir_okay=False,
            help="Documents to open, and a recording to look at.",
        ),
    ] = None,
    include: Annotated[
        list[Path] | None,
        typer.Option(
            "-I",
            "--include",
            metavar="DIR",
            help="Also search DIR for packages of interfaces; may be repeated. Those beside a document, and "
            "those in interfaces/ there or one folder up, are found without it.",
        ),
    ] = None,
    port: Annotated[
        int,
        typer.Option(metavar="N", min=0, max=65535, help="Port to listen on; 0 picks a free one."),
    ] = 0,
    browser: Annotated[
        bool, typer.Option("--browser/--no-browser", help="Open the page in the browser.")
    ] = True,
    demo: Annotated[
        bool,
        typer.Option(
            "--demo", help="Run a dance on a simulated robot, unless there are files or a robot is there."
        ),
    ] = False,
    socket: Annotated[
        Path | None,
        typer.Option(
            metavar="PATH",
            dir_okay=False,
            resolve_path=True,
            help="Unix socket to listen at instead of a port, for a proxy of the same user that checks "
            "who comes. Robot and components then open no ports either.",
        ),
    ] = None,
    root: Annotated[
        Path,
        typer.Option(
            metavar="DIR",
            exists=True,
            file_okay=False,
            help="Folder in which the page may open, save and list files.",
            show_default="the current one",
        ),
    ] = Path(),
    allow_host: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME",
            callback=lambda names: [_host_name(name) for name in names or ()],
            help="Host name under which a reverse proxy serves the page; may be repeated.",
        ),
    ] = None,
    base_path: Annotated[
        str,
        typer.Option(metavar="PATH", help="Path below which a reverse proxy serves the page."),
    ] = "/",
    trust_proxy: Annotated[
        bool,
        typer.Option(
            "--trust-proxy",
            help="Believe the headers X-Forwarded-Host and X-Forwarded-Proto: only for a reverse proxy that "
            "sets them itself.",
        ),
    ] = False,
) -> None:
    """Draw automata in the browser, run them, and watch robot and components.

    The page is served to this machine alone, at the printed address, which contains a secret. Unsaved changes
    survive Ctrl-C: they are offered when the document is opened again.
    """
    try:
        from visualhfsm._editor.launch import has_browser, open_browser
        from visualhfsm._editor.parts import make_parts
        from visualhfsm._editor.server import Options, serve
        from visualhfsm.project._root import RECORDING_SUFFIX
    except ModuleNotFoundError as error:
        package = (error.name or "").partition(".")[0]
        if package not in _PACKAGES:
            raise
        raise MissingPackageError(package, "web") from error
    if find_spec("jedi") is None:  # it is loaded by the process that helps with code
        raise MissingPackageError("jedi", "web")

    if sum(file.suffix.lower() == RECORDING_SUFFIX for file in files or ()) > 1:
        raise typer.BadParameter("one recording can be opened at the start", param_hint="FILES")
    if socket is not None and port:
        raise typer.BadParameter("give either --socket or --port")
    directories = [directory.resolve() for directory in require_directories(include)]
    with nullcontext() if socket is None else TemporaryDirectory(prefix="visualhfsm-") as sockets:
        options = Options(
            files=files or [],
            root=root,
            port=port,
            hosts=allow_host or [],
            base_path=base_path,
            trust_proxy=trust_proxy,
            socket=socket,
            make_parts=make_parts(settings, directories, root.resolve(), Path(sockets) if sockets else None),
            include=directories,
            demo=demo,
        )
        opens = browser and socket is None and has_browser()
        serve(options, _print_address, launch=open_browser if opens else None)


def _host_name(name: str) -> str:
    """Return a host name in lower case; refuse an address with a scheme or a port."""
    if not re.fullmatch(r"[A-Za-z0-9._-]+", name):
        raise typer.BadParameter(f"{name} is not a host name: leave out the scheme and the port")
    return name.lower()


def _print_address(occasion: Occasion, address: str) -> None:
    shown = _printable(address)
    match occasion:
        case "used":
            typer.echo(f"For another browser the editor is at {shown}")
        case "started":
            typer.echo(f"The editor is at {shown}")
            if os.environ.get("SSH_CONNECTION") and (port := urlsplit(address).port):
                # Not localhost, which may mean ::1 there: anybody could listen at that port of it.
                typer.echo(
                    f"On the machine from which you logged in, run: "
                    f"ssh -L {port}:127.0.0.1:{port} THIS_MACHINE"
                )
            report_ready("Ctrl-C ends it.")


def _printable(address: str) -> str:
    """Return an address as it may be printed: without its token into a file that others can read."""
    try:
        status = os.fstat(sys.stdout.fileno())
    except (OSError, ValueError):  # it is no file
        return address
    if not stat.S_ISREG(status.st_mode) or not status.st_mode & 0o077 or "?token=" not in address:
        return address
    return f"{address.partition('?')[0]} (its token is left out: others may read this file)"


@app.command(epilog=_WATCH_EPILOG)
@with_settings(defaults={"clock": "wall"})
def watch(
    *,
    settings: Settings,
    component: Annotated[
        str, typer.Argument(metavar="COMPONENT", help="Name of a running component; needed if several run.")
    ] = "",
    seconds: Annotated[
        float,
        typer.Option(
            metavar="S", min=0.0, callback=finite, help="Stop after this many seconds; 0 means never."
        ),
    ] = 0.0,
    report: Annotated[
        Path | None,
        typer.Option(
            metavar="HTML", dir_okay=False, help="Write the run as a page at the end, with pictures."
        ),
    ] = None,
    wait: Annotated[
        float,
        typer.Option(metavar="S", min=0.0, callback=finite, help="How long to wait for the component."),
    ] = 3.0,
) -> None:
    """Print what a component and its robot do, a line each second.

    A line has the current states, errors, the marks on pictures, the angles of the head, and how well the
    robot's server keeps up. A component or a robot that is lost is waited for.
    """
    from rich.console import Console

    from visualhfsm._commands.watch import watch as watch_component
    from visualhfsm._monitor.realm.realm import find_component
    from zenoh_ice import initialize

    with initialize(settings) as communicator:
        component = component or find_component(communicator, wait)
        watch_component(communicator, component, Console(), seconds=seconds, wait=wait, report=report)


register_steering(app)
app.command(epilog=new.EPILOG)(new.new)
app.command(epilog=check.EPILOG)(check.check)
app.command(epilog=convert.EPILOG)(convert.convert)
app.command(epilog=diff.EPILOG)(diff.diff)
app.command(epilog=document.EPILOG)(document.document)
app.command(epilog=draw.EPILOG)(draw.draw)
app.command(epilog=replay.EPILOG)(replay.replay)
app.command(epilog=report.EPILOG)(report.report)
app.command(epilog=verdict.EPILOG)(verdict.verdict)
