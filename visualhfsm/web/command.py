"""The command `visualhfsm edit`."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Annotated, Final
from urllib.parse import urlsplit

import typer

from visualhfsm.errors import MissingPackageError
from zenoh_ice.command import with_settings
from zenoh_ice.settings import Settings

__all__ = ["register"]

_PACKAGES: Final = frozenset({"h11", "jedi", "starlette", "uvicorn", "websockets"})
"""What the extra `web` installs, as far as the server begins with it."""

_EPILOG: Final = """Examples:

visualhfsm edit

visualhfsm edit behaviors/dance_and_follow.xml

visualhfsm edit --root ~/robots --port 8800 --no-browser"""


def register(app: typer.Typer) -> None:
    """Add the command to an application."""
    app.command(epilog=_EPILOG)(edit)


@with_settings(defaults={"clock": "wall"})
def edit(
    *,
    settings: Settings,
    files: Annotated[
        list[Path] | None,
        typer.Argument(metavar="FILES", exists=True, dir_okay=False, help="Documents to open."),
    ] = None,
    port: Annotated[
        int,
        typer.Option(metavar="N", min=0, max=65535, help="Port to serve on; 0 lets the system pick."),
    ] = 0,
    browser: Annotated[
        bool, typer.Option("--browser/--no-browser", help="Open the page in the browser.")
    ] = True,
    root: Annotated[
        Path,
        typer.Option(
            metavar="DIR",
            exists=True,
            file_okay=False,
            help="Folder below which the page opens, saves and lists files.",
            show_default="the current one",
        ),
    ] = Path(),
    allow_host: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME",
            callback=lambda names: [_host_name(name) for name in names or ()],
            help="Name under which a proxy shows the page; may be repeated.",
        ),
    ] = None,
) -> None:
    """Draw automata in the browser, run them, and watch robot and components.

    The page is served to this machine alone, at the address that is printed;
    it holds a secret. Unsaved changes outlive Ctrl-C: they are offered when
    the document is opened again.
    """
    try:
        from .server import Options, launch_browser, serve
        from .services import make_services
    except ModuleNotFoundError as error:
        package = (error.name or "").partition(".")[0]
        if package not in _PACKAGES:
            raise
        raise MissingPackageError(package, "web") from error

    options = Options(
        files=files or [],
        root=root,
        port=port,
        hosts=allow_host or [],
        make_services=make_services(settings),
    )
    serve(options, _print_address, launch=launch_browser if browser else None)


def _host_name(name: str) -> str:
    """Return a name in small letters; refuse an address, which would never be the name of a machine."""
    if not re.fullmatch(r"[A-Za-z0-9._-]+", name):
        raise typer.BadParameter(f"{name} is not the name of a machine: leave out scheme and port")
    return name.lower()


def _print_address(address: str) -> None:
    typer.echo(f"The editor is at {address}")
    if os.environ.get("SSH_CONNECTION"):
        port = urlsplit(address).port
        typer.echo(
            f"From where you logged in, it is there after: ssh -L {port}:localhost:{port} THIS_MACHINE"
        )
    typer.echo("Ctrl-C ends it.")
