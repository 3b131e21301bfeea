"""The command `naoserver-ros2`."""

from __future__ import annotations

import logging
import time
from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager
from typing import Annotated, Any, Final

import typer

from hfsm_command.cli import report_ready, stop_on_signals, with_settings
from interfaces.nao import ClockPrx
from ros2 import Node, RosError, RosoutHandler
from zenoh_ice import Communicator, Settings, initialize

from .commands import Commands
from .messages import Stamps
from .telemetry import GatewayError, Telemetry, require

__all__ = ["EXPECTED", "app", "serve"]

EXPECTED: Final = (RosError, GatewayError)
"""Errors that are reported in one line."""

_ANY_PORT: Final = "tcp/127.0.0.1:0"
_LOOK: Final = 0.1
"""Seconds between two checks for listeners."""

app = typer.Typer(add_completion=False, rich_markup_mode="rich")

_EXAMPLES = """
[bold]Examples[/bold]

  naoserver-ros2                                     beside a robot server on this machine
  naoserver-ros2 --ros tcp/127.0.0.1:7448            ROS by another router: rmw_zenohd, or nao router
  naoserver-ros2 --namespace /red --domain 3
  naoserver-ros2 --remap cmd_vel:=cmd_vel_safe

docs/how-to/ros2.md lists topics, actions and services.
"""


@app.command(epilog=_EXAMPLES)
@with_settings()
def gateway(
    *,
    settings: Settings,
    ros: Annotated[
        list[str] | None,
        typer.Option(
            metavar="ENDPOINT", help="ROS router or node to connect to; default: that of --connect."
        ),
    ] = None,
    name: Annotated[str, typer.Option(help="Name of the node.")] = "nao",
    namespace: Annotated[str, typer.Option(help="Namespace of the node and its topics.")] = "/",
    domain: Annotated[
        int | None, typer.Option(metavar="NUMBER", help="ROS domain; default: ROS_DOMAIN_ID, or 0.")
    ] = None,
    remap: Annotated[
        list[str] | None, typer.Option(metavar="OLD:=NEW", help="Rename a topic; may be repeated.")
    ] = None,
) -> None:
    """Connect a robot server, simulated or real, to ROS 2 over Zenoh (rmw_zenoh).

    Prints a line that begins with 'ready' once it is in the graph. Ctrl-C ends it, and what it drove stops.
    """
    names = dict(_pair(each) for each in remap or ())
    with stop_on_signals() as stop, initialize(settings) as communicator:
        own = settings.override(connect=ros or settings.connect, listen=[_ANY_PORT], mode="peer")
        with serve(
            communicator, name, namespace=namespace, domain=domain, remap=names, settings=own
        ) as telemetry:
            report_ready(f"ready: {namespace.rstrip('/')}/{name}, {', '.join(own.connect)}")
            while not stop.wait(_LOOK):
                telemetry.look()


@contextmanager
def serve(communicator: Communicator, name: str, **options: Any) -> Iterator[Telemetry]:  # noqa: ANN401
    """Show the robot of a communicator's realm as a ROS node within a `with` block.

    `options` are those of `ros2.Node`. Yields the telemetry, whose `look` is due several times a second.
    """
    clock = require(communicator, ClockPrx, "Clock")
    reading = clock.getTime()
    stamps = Stamps(simulated=reading.simulated)
    stamps.adjust(reading.time, time.time())
    robot = communicator.clock
    now = (lambda: stamps.ns(robot.now())) if robot.simulated else time.time_ns
    with Node(name, clock=now, **options) as node, ExitStack() as steps:
        logger, handler = logging.getLogger(__package__), RosoutHandler(node, logging.WARNING)
        logger.addHandler(handler)
        steps.callback(logger.removeHandler, handler)
        telemetry = steps.enter_context(closing(Telemetry(node, communicator, stamps)))
        Commands(node, communicator, stamps)
        yield telemetry


def _pair(text: str) -> tuple[str, str]:
    old, found, new = text.partition(":=")
    if not found:
        raise typer.BadParameter(f"{text!r}: write OLD:=NEW", param_hint="--remap")
    return old, new
