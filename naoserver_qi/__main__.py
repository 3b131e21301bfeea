"""Serve the fake robot as NAOqi: `python -m naoserver_qi`."""

from __future__ import annotations

import time
from contextlib import ExitStack, closing
from typing import Annotated, Final, NoReturn

import typer

from startup import loading

app = typer.Typer(add_completion=False, rich_markup_mode="rich", pretty_exceptions_enable=False)

_LOOK: Final = 0.5
"""Wall seconds of a wait: a signal that strikes just before one is heard at its end."""

_EXAMPLES = """
[bold]Examples[/bold]

  python -m naoserver_qi
  python -m naoserver_qi --qi tcp://127.0.0.1:9560 --faults --speed 5
"""


@app.command(epilog=_EXAMPLES)
def serve_fake(
    *,
    qi: Annotated[
        str, typer.Option(metavar="URL", help="Where to listen; port 0 lets the system pick.")
    ] = "tcp://127.0.0.1:9559",
    speed: Annotated[float, typer.Option(min=0.1, max=100.0, help="Robot seconds in a wall second.")] = 1.0,
    faults: Annotated[
        bool, typer.Option("--faults", help="Serve also Faults, which makes calls late or fail, for tests.")
    ] = False,
) -> None:
    """Serve a robot without physics as NAOqi.

    Prints a line that begins with 'ready' as soon as it can be called. Ctrl-C ends it.
    """
    from naoserver.assembly import Assembly
    from naoserver.fake import FakeRobot
    from naoserver.fake.clock import FastClock
    from naoserver.jobs import JobThreads
    from naoserver.options import ServerOptions
    from naoserver_qi import serve_as_naoqi
    from zenoh_ice import WallClock

    with ExitStack() as stack:
        robot = stack.enter_context(closing(FakeRobot(FastClock(speed))))
        robot.start()
        assembly = Assembly(robot, ServerOptions(), WallClock())
        threads = JobThreads(assembly.jobs)
        assembly.on_wake = threads.wake
        stack.enter_context(threads)
        for watched in assembly.watched:
            stack.callback(watched.close)
        service = stack.enter_context(serve_as_naoqi(robot, assembly, qi, faults=faults))
        typer.echo(f"ready: {service.url}")
        while True:
            time.sleep(_LOOK)


def main() -> NoReturn:
    """Run the command."""
    with loading():
        from naoserver.errors import RobotError
        from zenoh_ice.command import run
    run(app, expected=(RobotError,))


if __name__ == "__main__":
    main()
