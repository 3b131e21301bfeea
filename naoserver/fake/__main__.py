"""Serve the fake robot: `python -m naoserver.fake`."""

from __future__ import annotations

from typing import Annotated

import typer

from naoserver.bodies import BODY_NAMES, DEFAULT_BODY, find_body
from naoserver.errors import RobotError
from naoserver.fake import FakeRobot
from naoserver.hardware.serving import SERVER_DEFAULTS, serve_hardware
from naoserver.options import ServerOptions
from naoserver.serving.server import TeamName
from zenoh_ice.application.cli import run, with_settings
from zenoh_ice.settings import Settings

app = typer.Typer(add_completion=False, rich_markup_mode="rich")

_EXAMPLES = """
[bold]Examples[/bold]

  python -m naoserver.fake
  python -m naoserver.fake --realm robot2 --listen tcp/127.0.0.1:7448
"""


@app.command(epilog=_EXAMPLES)
@with_settings(defaults=SERVER_DEFAULTS)
def fake(
    *,
    settings: Settings,
    body: Annotated[
        str, typer.Option(metavar="NAME", help=f"The robot's body: one of {', '.join(BODY_NAMES)}.")
    ] = DEFAULT_BODY,
    team: TeamName = "",
) -> None:
    """Serve a robot without physics, with two balls, in wall time.

    Prints a line that begins with 'ready' as soon as it can be called. Ctrl-C ends it.
    """
    serve_hardware(FakeRobot(body=find_body(body)), settings, ServerOptions(team=team))


if __name__ == "__main__":
    run(app, expected=(RobotError,))
