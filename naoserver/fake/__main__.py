"""Serve the fake robot: `python -m naoserver.fake`."""

from __future__ import annotations

from contextlib import closing

import typer

from hfsm_command.cli import report_ready, run, stop_on_signals, with_settings
from naoserver.errors import RobotError
from naoserver.fake import FakeRobot
from naoserver.server import serve
from zenoh_ice import initialize
from zenoh_ice.settings import DEFAULT_ENDPOINT, Settings

app = typer.Typer(add_completion=False, rich_markup_mode="rich")

_EXAMPLES = """
[bold]Examples[/bold]

  python -m naoserver.fake
  python -m naoserver.fake --realm robot2 --listen tcp/127.0.0.1:7448
"""


@app.command(epilog=_EXAMPLES)
@with_settings(defaults={"listen": (DEFAULT_ENDPOINT,), "connect": (), "clock": "wall"})
def fake(*, settings: Settings) -> None:
    """Serve a robot without physics, with two balls, in wall time.

    Prints a line that begins with 'ready' as soon as it can be called. Ctrl-C ends it.
    """
    with stop_on_signals() as stop, initialize(settings) as communicator, closing(FakeRobot()) as robot:
        robot.start()
        adapter = communicator.createObjectAdapter("FakeRobot")
        with serve(robot, adapter):
            adapter.activate()
            report_ready(f"ready: realm {settings.realm}, {', '.join(settings.reached_at)}")
            stop.wait()


if __name__ == "__main__":
    run(app, expected=(RobotError,))
