"""The command `visualhfsm agent`: a server for agents that draw behaviors and must prove them."""

from __future__ import annotations

from contextlib import closing
from pathlib import Path
from typing import Annotated, Final

import typer

from visualhfsm.plugins import MissingPackageError, examples
from zenoh_ice.application.cli import report_ready, with_settings
from zenoh_ice.settings import Settings

_EPILOG: Final = examples(
    "agent",
    "agent --root ~/robots",
    "agent --http --port 8765",
    notes="""Without --http it speaks over stdin and stdout, as clients start it.
agent.toml in the folder says what it may do on a robot; without that file, nothing.""",
)

app: Final = typer.Typer(add_completion=False)


@app.command(epilog=_EPILOG)
@with_settings(defaults={"clock": "wall"})
def agent(
    *,
    settings: Settings,
    root: Annotated[
        Path,
        typer.Option(
            metavar="DIR",
            exists=True,
            file_okay=False,
            help="Folder of the project; nothing outside of it is read or written.",
            show_default="the current one",
        ),
    ] = Path(),
    http: Annotated[
        bool, typer.Option("--http", help="Serve HTTP on loopback, with a token, instead.")
    ] = False,
    port: Annotated[
        int, typer.Option(metavar="N", min=0, max=65535, help="Port of --http; 0 picks one.")
    ] = 0,
) -> None:
    """Let an agent draw, judge, try and run behaviors, by the Model Context Protocol.

    It runs a behavior on a robot only if its verdict is ready, nothing has changed since, and a person allows
    it. It clears no emergency stop, takes no lease and writes documents of the project alone.
    """
    try:
        from visualhfsm_agent._server import make_server, serve_http, serve_stdio
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] not in {"mcp", "mcp_types"}:
            raise
        raise MissingPackageError("mcp", "agent") from error
    from visualhfsm_agent._desk import Desk

    def announce(address: str, token: str) -> None:
        typer.echo(f"The agent's server is at {address}, token: {token}")
        report_ready("Ctrl-C ends it.")

    checkout = Path(__file__).parents[4]
    with closing(Desk(root, settings)) as desk:
        server = make_server(desk, [checkout / "docs", *checkout.glob("plugins/*/docs")])
        serve_http(server, port, announce) if http else serve_stdio(server)
