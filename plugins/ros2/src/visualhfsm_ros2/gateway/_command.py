"""The command `naoserver-ros2`."""

from __future__ import annotations

import logging
import math
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager
from typing import Annotated, Any, Final

import typer

from interfaces.nao import ClockPrx
from visualhfsm_ros2.gateway._commands import Commands, declare_parameters
from visualhfsm_ros2.gateway._description import DescribedRobot, GatewayError
from visualhfsm_ros2.gateway._messages import Stamps
from visualhfsm_ros2.gateway._telemetry import Telemetry
from zenoh_ice import Communicator, ConnectFailedException, Settings, initialize
from zenoh_ice.application.cli import report_ready, stop_on_signals, with_settings
from zenoh_ros2 import DEFAULT_SETTINGS, Node, RosError, RosoutHandler, Service

EXPECTED: Final = (RosError, GatewayError)
"""Errors that are reported in one line."""

_CHECK_PERIOD: Final = 0.1
"""Seconds between two checks for listeners."""

_RETRY_DELAY: Final = 1.0
"""Seconds between two attempts to reach ROS."""
_REMINDER: Final = 60.0
"""Seconds between two reports that it is waited for."""
_END_LIMIT: Final = 2.0
"""Seconds within which the look at the router ends."""

_logger = logging.getLogger(__name__)


class AbsentError(GatewayError):
    """Nothing of ROS answers, or it does not let the gateway in."""


app = typer.Typer(add_completion=False, rich_markup_mode="rich")

_EXAMPLES = """
[bold]Examples[/bold]

  naoserver-ros2                                     beside a robot server on this machine
  naoserver-ros2 --ros tcp/127.0.0.1:7448            ROS by another router: rmw_zenohd, or nao router
  naoserver-ros2 --namespace /red --domain 3
  naoserver-ros2 --remap cmd_vel:=cmd_vel_safe

plugins/ros2/docs/ros2.md lists topics, actions and services.
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
    frame_prefix: Annotated[
        str | None,
        typer.Option(
            metavar="TEXT", help="Beginning of the names of frames; default: the namespace, as in red/odom."
        ),
    ] = None,
) -> None:
    """Connect a robot server, simulated or real, to ROS 2 over Zenoh (rmw_zenoh).

    Waits until something of ROS answers, and prints a line that begins with 'ready' once it is in the graph.
    Ctrl-C ends it, and what it drove stops.
    """
    names = dict(_pair(each) for each in remap or ())
    with stop_on_signals() as stop, ExitStack() as opened:
        communicator = opened.enter_context(initialize(_as_client(settings)))
        own = settings.override(connect=ros or settings.connect)
        options: dict[str, Any] = {
            "namespace": namespace, "domain": domain, "remap": names, "frame_prefix": frame_prefix,
        }  # fmt: skip
        reported = -math.inf
        while not stop.is_set():
            try:
                telemetry = opened.enter_context(serve(communicator, name, settings=own, **options))
            except AbsentError as error:
                if time.monotonic() > reported + _REMINDER:
                    reported = time.monotonic()
                    _logger.warning("waiting for ROS: %s", error)
                stop.wait(_RETRY_DELAY)
                continue
            report_ready(f"ready: {namespace.rstrip('/')}/{name}, {', '.join(own.connect)}")
            while not stop.wait(_CHECK_PERIOD):
                telemetry.poll()


@contextmanager
def serve(
    communicator: Communicator,
    name: str,
    *,
    settings: Settings = DEFAULT_SETTINGS,
    namespace: str = "/",
    frame_prefix: str | None = None,
    reach_limit: float = 5.0,
    **options: Any,  # noqa: ANN401
) -> Iterator[Telemetry]:
    """Show the robot of a communicator's realm as a ROS node within a `with` block.

    `settings.connect` has the endpoint of the router of ROS, or of another node, by which others should reach
    it within `reach_limit` s; `options` are those of `ros2.Node`. The names of frames begin with
    `frame_prefix`, by default with the namespace. Yields the telemetry, whose `poll` is due
    several times a second. Raises AbsentError when nothing answers there, GatewayError for a robot whose
    description has a fault.
    """
    described = DescribedRobot(communicator)
    reading = described.require(ClockPrx, "Clock").getTime()
    if frame_prefix is None:
        frame_prefix = f"{namespace.strip('/')}/".lstrip("/")
    stamps = Stamps(simulated=reading.simulated, frame_prefix=frame_prefix)
    stamps.adjust(reading.time, time.time())
    robot = communicator.clock
    now = (lambda: stamps.ns(robot.now())) if robot.simulated else time.time_ns
    own = _as_client(settings)
    try:
        made = Node(name, namespace=namespace, clock=now, settings=own, separate_discovery=True, **options)
    except ConnectFailedException as error:
        raise AbsentError(
            f"start `nao router` or rmw_zenohd, or name its place with --ros; {error}"
        ) from error
    with made as node, ExitStack() as steps:
        handler = RosoutHandler(node, logging.WARNING)
        for package in (__package__, "zenoh_ros2"):
            logging.getLogger(package).addHandler(handler)
            steps.callback(logging.getLogger(package).removeHandler, handler)
        telemetry = steps.enter_context(closing(Telemetry(node, described, stamps)))
        speeds = declare_parameters(node, described, stamps)
        commands = Commands(node, described, stamps, speeds)
        if own.connect:
            where = ", ".join(own.connect)
            steps.enter_context(_reported_if_shut_out(commands.emergency_stop, where, reach_limit))
        yield telemetry


@contextmanager
def _reported_if_shut_out(service: Service, where: str, limit: float) -> Iterator[None]:
    """Log a warning, within a `with` block, if others do not reach a service through the router."""
    end = threading.Event()

    def look() -> None:
        deadline = time.monotonic() + limit
        with service.seen_from_outside() as is_seen:
            while not is_seen():
                if end.wait(_CHECK_PERIOD):
                    return
                if time.monotonic() > deadline:
                    _logger.warning(
                        "%s lets nobody in ROS reach %s: the router's role of this user needs ros_serve"
                        " (docs/how-to/security.md, ROS)", where, service.name,
                    )  # fmt: skip
                    return

    thread = threading.Thread(target=look, name="reach of the gateway", daemon=True)
    thread.start()
    try:
        yield
    finally:
        end.set()
        thread.join(_END_LIMIT)


def _as_client(settings: Settings) -> Settings:
    """Return settings with which a session gets only what it asks for.

    Peers send each other all their tokens, and handling thousands takes Zenoh seconds.
    """
    return settings.override(mode="client", listen=()) if settings.connect else settings


def _pair(text: str) -> tuple[str, str]:
    old, found, new = text.partition(":=")
    if not found:
        raise typer.BadParameter(f"{text!r}: write OLD:=NEW", param_hint="--remap")
    return old, new
