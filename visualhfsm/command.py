"""The command `visualhfsm`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from visualhfsm.check import EPILOG as CHECK_EPILOG
from visualhfsm.check import check
from visualhfsm.convert import EPILOG as CONVERT_EPILOG
from visualhfsm.convert import convert
from visualhfsm.replay import EPILOG as REPLAY_EPILOG
from visualhfsm.replay import replay
from visualhfsm.steer.commands import register as register_steering
from visualhfsm.web.command import register as register_editor
from zenoh_ice.command import finite, with_settings
from zenoh_ice.settings import Settings

__all__ = ["app"]

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False, no_args_is_help=True)

_WATCH_EPILOG = """Examples:

visualhfsm watch

visualhfsm watch dance_and_follow --seconds 60 --report report.html

visualhfsm watch follow_ball --plain > log.txt"""


register_editor(app)
register_steering(app)
app.command(epilog=CHECK_EPILOG)(check)


app.command(epilog=CONVERT_EPILOG)(convert)
app.command(epilog=REPLAY_EPILOG)(replay)


@app.callback()
def visualhfsm() -> None:
    """Draw, check and convert automata, and watch, steer and replay the components that are made of them."""


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
            metavar="S", min=0.0, callback=finite, help="End by itself after so many seconds; 0 is never."
        ),
    ] = 0.0,
    report: Annotated[
        Path | None,
        typer.Option(metavar="HTML", dir_okay=False, help="Write a report with pictures at the end."),
    ] = None,
    plain: Annotated[
        bool, typer.Option("--plain", help="One line a second, as when the output is no terminal.")
    ] = False,
    wait: Annotated[
        float,
        typer.Option(
            metavar="S", min=0.0, callback=finite, help="How long the component may take to appear."
        ),
    ] = 3.0,
) -> None:
    """Show a component and its robot in the terminal.

    Automata stand as a tree of states with their timers, beside what the
    component marks on the camera's picture, the angles of head and arms, and
    how well the robot's server keeps up. Ctrl-C ends with a summary. A component or a robot that
    goes away is waited for.
    """
    from rich.console import Console

    from visualhfsm.monitoring.realm import find_component
    from visualhfsm.watch.watcher import WatchOptions
    from visualhfsm.watch.watcher import watch as watch_component
    from zenoh_ice import initialize

    with initialize(settings) as communicator:
        component = component or find_component(communicator, wait)
        options = WatchOptions(component, seconds, wait, report, plain)
        watch_component(communicator, options, Console())
