"""Several simulated robots, each with its own process and realm."""

from __future__ import annotations

import re
import subprocess
import sys
import threading
import time
from collections.abc import Iterable, Sequence
from typing import Final

from naoserver.errors import RobotError
from zenoh_ice.application import tether_command
from zenoh_ice.settings import Settings

_REPLACED: Final = ("--robots", "--realm", "--listen", "--connect", "--seed", "--qi")
"""Options with a value that is different for each robot."""
_PORT: Final = re.compile(r":(\d+)(?=$|[?#/])")
_POLL_PERIOD: Final = 0.1  # s
_END_LIMIT: Final = 5.0  # s for a robot's process to end on request


def team_commands(
    options: Sequence[str], robots: int, settings: Settings, *, seed: int | None = None, qi: str | None = None
) -> list[list[str]]:
    """Return the command of each robot: the given options, except those that differ between robots.

    The first has the realm and the endpoints of `settings`; the second has the realm with a 2 appended and
    the next ports, and so on. All connect to the first, so that clients connected to it find every realm.
    """
    shared = _without(options, _REPLACED)
    commands = []
    for number in range(robots):
        own = ["--realm", settings.realm + (str(number + 1) if number else "")]
        for endpoint in settings.listen:
            own += ["--listen", _later_port(endpoint, number)]
        for endpoint in (*settings.connect, *(settings.listen if number else ())):
            if not endpoint.endswith(":0"):
                own += ["--connect", endpoint]
        if seed is not None:
            own += ["--seed", str(seed + number)]
        if qi is not None:
            own += ["--qi", _later_port(qi, number)]
        commands.append([sys.executable, "-P", "-m", "naoserver_sim", *shared, *own])
    return commands


def run_team(commands: Iterable[Sequence[str]], stop: threading.Event) -> None:
    """Run commands until `stop` is set or one of them exits, which raises RobotError; then end all."""
    processes: list[subprocess.Popen[bytes]] = []
    try:
        for command in commands:
            tethered = [*tether_command(), *command]
            processes.append(subprocess.Popen(tethered, stdin=subprocess.DEVNULL, start_new_session=True))
        while not stop.wait(_POLL_PERIOD):
            for number, process in enumerate(processes):
                if process.poll() is not None:
                    raise RobotError(f"robot {number + 1} ended with exit code {process.returncode}")
    finally:
        _end(processes)


def _end(processes: Sequence[subprocess.Popen[bytes]]) -> None:
    for process in processes:
        process.terminate()
    deadline = time.monotonic() + _END_LIMIT
    for process in processes:
        try:
            process.wait(max(0.0, deadline - time.monotonic()))
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait(_END_LIMIT)


def _without(options: Sequence[str], names: Sequence[str]) -> list[str]:
    """Return options without some that have a value, written `--name value` or `--name=value`."""
    left, rest = [], iter(options)
    for option in rest:
        if option in names:
            next(rest, None)  # its value
        elif option.partition("=")[0] not in names:
            left.append(option)
    return left


def _later_port(endpoint: str, number: int) -> str:
    """Return an endpoint with its port increased by a number; port 0, which the system picks, stays."""
    return _PORT.sub(lambda found: f":{int(found[1]) + number if int(found[1]) else 0}", endpoint)
