"""Serve the fake robot as NAOqi: `python -m visualhfsm_naoqi.programs`."""

from __future__ import annotations

import math
from contextlib import closing
from typing import Annotated, NoReturn

import typer

from visualhfsm_naoqi.programs import Disk, serve_as_naoqi
from zenoh_ice.application import begin_loading

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)


@app.command(epilog="Example: python -m visualhfsm_naoqi.programs --qi tcp://127.0.0.1:9560 --speed 5")
def serve_fake(
    *,
    qi: Annotated[
        str, typer.Option(metavar="URL", help="Address to listen on; port 0 picks a free port.")
    ] = "tcp://127.0.0.1:9559",
    disk: Disk = None,
    speed: Annotated[float, typer.Option(min=0.1, max=100.0, help="Robot seconds per wall second.")] = 1.0,
) -> None:
    """Serve a robot without physics as NAOqi.

    Prints a line that begins with 'ready' as soon as it can be called. Ctrl-C ends it.
    """
    from naoserver.fake import FakeRobot
    from naoserver.serving.server import serve
    from zenoh_ice import Communicator, RobotClock, Settings
    from zenoh_ice.application.cli import report_ready, stop_on_signals
    from zenoh_ice.routes.in_process import InProcessTransport

    clock = RobotClock(0.0, speed, simulated=True, silence=math.inf)
    with (
        stop_on_signals() as stop,
        Communicator(Settings(), transport=InProcessTransport) as network,  # nobody joins it
        closing(FakeRobot(clock)) as robot,
    ):
        robot.start()
        adapter = network.createObjectAdapter("NaoServer")
        with (
            serve(robot, adapter) as assembly,
            serve_as_naoqi(robot, assembly, qi, disk=disk) as url,
        ):
            report_ready(f"ready: {url}")
            stop.wait()


def main() -> NoReturn:
    """Run the command."""
    begin_loading()
    from naoserver.errors import RobotError
    from zenoh_ice.application.cli import run

    run(app, expected=(RobotError,))


if __name__ == "__main__":
    main()
