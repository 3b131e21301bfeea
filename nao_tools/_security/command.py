"""The commands `nao security ...`."""

from __future__ import annotations

import json
import socket
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from datetime import timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from zenoh_ice import ConfigurationException
from zenoh_ice.application import missing_package
from zenoh_ice.settings import ROUTER_DEFAULTS, Role, load_settings

if TYPE_CHECKING:
    from nao_tools._security.folder import SecurityFolder

app = typer.Typer(
    help="Make certificates and settings for robots and people on a network, and show who may do what.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)

_LAST_PORT = 65535

_Folder = Annotated[Path, typer.Argument(metavar="FOLDER", help="Folder of the authority.")]
_Days = Annotated[int, typer.Option(min=1, max=3650, help="How long certificates are valid.")]
_File = Annotated[Path, typer.Argument(metavar="TOML", help="File of settings.")]


@app.command(
    epilog="Examples:\n\nnao security init keys --host robotlab.local --host 192.168.1.5\n\n"
    "nao security init keys --realm nao3 --days 180"
)
def init(
    folder: _Folder,
    *,
    host: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME", help="Name or address of the router's machine; may be repeated. [default: this]"
        ),
    ] = None,
    port: Annotated[int, typer.Option(min=1, max=_LAST_PORT, help="Port of the router.")] = 7447,
    operator_port: Annotated[
        int | None,
        typer.Option(
            min=1,
            max=_LAST_PORT,
            help="Port of the router for all but students and agents, which a firewall keeps from them. "
            "[default: the next one]",
            show_default=False,
        ),
    ] = None,
    realm: Annotated[str, typer.Option(help="Realm of the robot.")] = "nao",
    days: _Days = 365,
) -> None:
    """Make an authority, certificates, and the settings of a router, a robot and its users."""
    hosts = host or [socket.gethostname()]
    own_port = operator_port or min(port + 1, _LAST_PORT)
    files = _folder(folder).create(
        realm=realm, hosts=hosts, port=port, operator_port=own_port, valid=timedelta(days=days)
    )
    router, robot, *users = files
    typer.echo(f"{router}: start the router with it, on {hosts[0]}: nao router --config {router}")
    typer.echo(f"{robot}: for the robot's server: naoserver-sim --config {robot}")
    for user in users:
        typer.echo(f"{user}: for user {user.stem}: nao list --config {user}")
    typer.echo(
        f"Give each, beside the settings, {folder / 'authority.pem'} and the .pem and .key of the same name; "
        f"keep {folder / 'authority.key'} secret: it can sign a certificate for any name."
    )


@app.command(epilog="Examples:\n\nnao security add keys ann --role student")
def add(
    folder: _Folder,
    name: Annotated[str, typer.Argument(metavar="NAME", help="User who gets a certificate.")],
    role: Annotated[str, typer.Option(metavar="ROLE", help="Role of the user.")],
    days: _Days = 365,
) -> None:
    """Issue a certificate for one more user, and give it a role at the router."""
    files = _folder(folder).add(name, role, valid=timedelta(days=days))
    typer.echo(f"{name} needs {', '.join(map(str, files))}")
    typer.echo(f"start the router again with {folder / 'router.toml'}")


@app.command(epilog="Examples:\n\nnao security renew keys router --days 180")
def renew(
    folder: _Folder,
    name: Annotated[str, typer.Argument(metavar="NAME", help="Name in the certificate to replace.")],
    days: _Days = 365,
) -> None:
    """Replace a certificate by a new one with a new key, before it expires."""
    _folder(folder).renew(name, valid=timedelta(days=days))
    typer.echo(f"{name} needs {folder / f'{name}.pem'} and {folder / f'{name}.key'}, and to be started again")


@app.command(epilog="Examples:\n\nnao security show keys/router.toml\n\nnao security show keys/student.toml")
def show(file: _File) -> None:
    """Show the identity of a component, its expiry, and the roles that a router grants."""
    from rich.console import Console
    from rich.table import Table

    settings = load_settings(file, environment={})
    security = settings.security
    if security.certificate:
        with _needs_cryptography():
            from nao_tools._security.folder import common_name, load_certificate
        certificate = load_certificate(Path(security.certificate))
        known = f"known as {common_name(certificate)}, until {certificate.not_valid_after_utc:%Y-%m-%d}"
    else:
        known = f"known as user {security.user}, by a password" if security.user else "known by nothing"
    typer.echo(f"{file}: {known}")
    if security.roles:
        columns = ("role", "users", "call", "read", "serve", "liveliness")
        table = Table(*columns, title=f"realm {settings.realm}")
        for name, role in security.roles.items():
            users = [user for user, granted in security.users.items() if granted == name]
            cells = ("\n".join(items) or "-" for items in (users, role.call, role.read, role.serve))
            table.add_row(name, *cells, "yes" if role.liveliness else "no")
        Console().print(table)
        _show_ros(security.roles)
    elif settings.mode != "client":
        typer.echo("It has no roles: every accepted user may do everything.")


def _show_ros(roles: Mapping[str, Role]) -> None:
    """Print what roles may do in the graph of ROS, if any may do anything."""
    from rich.console import Console
    from rich.table import Table

    table = Table("role", "ros_call", "ros_read", "ros_serve", "ros_domains", title="ROS")
    for name, role in roles.items():
        if role.ros_call or role.ros_read or role.ros_serve:
            rights = ("\n".join(names) or "-" for names in (role.ros_call, role.ros_read, role.ros_serve))
            table.add_row(name, *rights, ", ".join(map(str, role.ros_domains)))
    if table.rows:
        Console().print(table)


@app.command(
    epilog="Examples:\n\nnao security zenohd keys/router.toml > router.json5\n\nzenohd -c router.json5"
)
def zenohd(file: _File) -> None:
    """Print the configuration with which Zenoh's own router, zenohd, does what ours does."""
    from nao_tools._deployment.router import check_router
    from zenoh_ice.carriers.zenoh.session import session_config
    from zenoh_ice.settings.security import check_security

    settings = load_settings(file, defaults=ROUTER_DEFAULTS, environment={})
    check_router(settings)
    check_security(settings)
    typer.echo(f"// Made from {file.name} by `nao security zenohd`; do not edit.")
    typer.echo(json.dumps(session_config(settings), indent=2))


def _folder(path: Path) -> SecurityFolder:
    with _needs_cryptography():
        from nao_tools._security.folder import SecurityFolder
    return SecurityFolder(path)


@contextmanager
def _needs_cryptography() -> Iterator[None]:
    try:
        yield
    except ModuleNotFoundError as error:
        raise ConfigurationException(missing_package(error, "security")) from error
