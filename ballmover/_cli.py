"""The command `ballmover`."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from zenoh_ice.application.cli import SERVER_WAIT, ServerWait, finite, stop_on_signals, with_settings
from zenoh_ice.settings import Settings

from ._exceptions import BallMoverException
from ._waypoints import Color, built_in_waypoints, read_waypoints

app = typer.Typer(add_completion=False, rich_markup_mode="rich", pretty_exceptions_enable=False)

_EPILOG = """
[bold]Examples[/bold]

  ballmover green                    built-in waypoints, repeated
  ballmover red figure.csv --once    your own file, once
  ballmover green --speed 0.1 --connect tcp/192.168.1.7:7447

[bold]Files[/bold]

  x,   y,   z,    speed, dwell             x forward, y left, z up, in metres
  0.9, 0.0, 0.55                           speed in m/s and time to stay in s,
  0.9, 0.3, 0.60, 0.1,   1.5               both optional

  A first line of names may reorder the columns. # begins a comment.
  The same in TOML: an array of tables named waypoints, with these keys.
"""


@app.command(epilog=_EPILOG)
@with_settings()
def move(
    *,
    settings: Settings,
    color: Annotated[Color, typer.Argument(metavar="COLOR", help="Ball to move: green or red.")],
    waypoints: Annotated[
        Path | None,
        typer.Argument(metavar="WAYPOINTS", help="CSV or TOML file. Default: the built-in waypoints."),
    ] = None,
    loop: Annotated[
        bool, typer.Option("--loop/--once", help="Repeat the waypoints, or stop at the last one.")
    ] = True,
    speed: Annotated[
        float,
        typer.Option(metavar="M/S", min=0.001, callback=finite, help="Speed to waypoints that set none."),
    ] = 0.25,
    server_wait: ServerWait = SERVER_WAIT,
) -> None:
    """Carry a ball of the simulated world along waypoints in space."""
    points = read_waypoints(waypoints) if waypoints else built_in_waypoints(color)

    from zenoh_ice import ObjectNotExistException, initialize
    from zenoh_ice.application.patience import Patience

    from ._mover import Ball, Mover

    patience = Patience(server_wait)
    with patience.until_served(partial(initialize, settings)) as communicator:

        def has_robot() -> bool:
            return "Safety" in communicator.identities()

        try:
            ball = patience.until_served(partial(Ball, communicator, color), has_robot)
        except ObjectNotExistException as error:
            if not has_robot():
                raise
            where = f"the robot of realm {communicator.realm!r} has no {color} ball"
            hint = "only a simulation has balls, such as naoserver-sim --world balls"
            raise BallMoverException(f"{where}: {hint}") from error
        typer.echo(f"{color}: {len(points)} waypoints")
        with stop_on_signals() as stop:
            Mover(ball, communicator.clock, points, stop, speed).run(loop=loop)
