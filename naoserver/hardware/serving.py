"""Serve a robot of real hardware until a signal ends the command."""

from __future__ import annotations

from contextlib import closing
from functools import partial
from typing import Any, Final

from naoserver.hardware.lifecycle import Lifecycle
from naoserver.options import ServerOptions
from naoserver.protocol.robot import Robot
from naoserver.safety.latch import latch_of
from naoserver.serving.server import problem_of, serve
from zenoh_ice import initialize
from zenoh_ice.application.cli import report_ready, stop_on_signals
from zenoh_ice.settings import DEFAULT_ENDPOINT, Settings

SERVER_DEFAULTS: Final = {"listen": (DEFAULT_ENDPOINT,), "connect": (), "clock": "wall"}
"""The defaults of a robot server's settings, for `with_settings`."""


def serve_hardware(
    robot: Robot,
    settings: Settings,
    options: ServerOptions | None = None,
    *,
    lifecycle: Lifecycle[Any] | None = None,
    where: str = "",
) -> None:
    """Serve a robot until SIGINT, SIGTERM or SIGHUP, and close it; on the main thread.

    Its `lifecycle`, for one that may be lost, knows of emergency stops, and notifies clients of the loss. It
    stays stopped if the former server was, or ended without warning. A line that begins with `ready` says
    where it can be called, and `where` the hardware is; under systemd, its watchdog is fed. Raises RobotError
    when the hardware is not reached, SystemExit after a signal.
    """
    with (
        stop_on_signals() as stop,
        initialize(settings) as communicator,
        latch_of(settings) as latch,
        closing(robot),
    ):
        if lifecycle is not None:
            lifecycle.is_stopped = lambda: latch is not None and bool(latch.found.stop)
        if robot.faults is not None:
            robot.faults.restart = stop.begin_again
        robot.start()
        adapter = communicator.createObjectAdapter("RobotServer")
        with serve(robot, adapter, options, latch=latch) as assembly:
            if lifecycle is not None:
                lifecycle.report_to(assembly)
            adapter.activate()
            reached = f"ready: realm {settings.realm}, {', '.join(settings.reached_at)}"
            watchdog = report_ready(f"{reached}, {where}" if where else reached)
            watchdog.wait(stop, partial(problem_of, communicator, assembly))
