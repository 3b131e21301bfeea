"""Serve the fake robot: `python -m naoserver.fake`."""

from __future__ import annotations

from contextlib import closing
from functools import partial
from typing import Annotated

import typer

from naoserver.bodies import BODY_NAMES, DEFAULT_BODY, find_body
from naoserver.errors import RobotError
from naoserver.fake import FakeRobot
from naoserver.latch import latch_of
from naoserver.server import problem_of, serve
from zenoh_ice import initialize
from zenoh_ice.application.cli import report_ready, run, stop_on_signals, with_settings
from zenoh_ice.settings import DEFAULT_ENDPOINT, Settings

app = typer.Typer(add_completion=False, rich_markup_mode="rich")

_EXAMPLES = """
[bold]Examples[/bold]

  python -m naoserver.fake
  python -m naoserver.fake --realm robot2 --listen tcp/127.0.0.1:7448
"""


@app.command(epilog=_EXAMPLES)
@with_settings(defaults={"listen": (DEFAULT_ENDPOINT,), "connect": (), "clock": "wall"})
def fake(
    *,
    settings: Settings,
    body: Annotated[
        str, typer.Option(metavar="NAME", help=f"The robot's body: one of {', '.join(BODY_NAMES)}.")
    ] = DEFAULT_BODY,
) -> None:
    """Serve a robot without physics, with two balls, in wall time.

    Prints a line that begins with 'ready' as soon as it can be called. Ctrl-C ends it.
    """
    robot = FakeRobot(body=find_body(body))
    with (
        stop_on_signals() as stop,
        initialize(settings) as communicator,
        latch_of(settings) as latch,
        closing(robot),
    ):
        robot.start()
        adapter = communicator.createObjectAdapter("FakeRobot")
        with serve(robot, adapter, latch=latch) as assembly:
            adapter.activate()
            watchdog = report_ready(f"ready: realm {settings.realm}, {', '.join(settings.reached_at)}")
            watchdog.wait(stop, partial(problem_of, communicator, assembly))


if __name__ == "__main__":
    run(app, expected=(RobotError,))
