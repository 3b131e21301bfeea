"""Tell how a robot and the processes around it are."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Mapping
from typing import Any, Final

from deploy.nao.connection import ask_processes, find_servant, nobody, servants
from deploy.nao.output import console, for_people, print_json
from deploy.nao.quantities import count_text, duration_text, span_text
from deploy.nao.values import Json, to_json
from zenoh_ice import Communicator, ServantInfo, ZenohIceError, initialize
from zenoh_ice.network.process_status import ProcessStatus, ServantStatus
from zenoh_ice.settings import Settings
from zenoh_ice.wire.text import printable

__all__ = ["status"]

_READINGS: Final[Mapping[str, str]] = {
    "::nao::Clock": "getTime",
    "::nao::Health": "getHealth",
    "::nao::Battery": "getBatteryReading",
    "::nao::Safety": "getSafetyState",
}
"""What is asked of a robot: an operation by the interface that has it."""
_MOST_EVENTS: Final = 5
_MOST_SERVANTS: Final = 8
"""Servants of a process that are told of, besides those with troubles."""


def status(settings: Settings, *, every_servant: bool, as_json: bool) -> None:
    """Print how the robot is, and what each process that serves did.

    Raises ConnectFailedException when nothing answers at the endpoints, NaoError when there is no servant.
    """
    with initialize(settings) as communicator:
        found = servants(communicator)
        if not found:
            raise nobody(communicator)
        processes = ask_processes(communicator, found)
        readings = _read_robot(communicator, found)
    if as_json:
        print_json(
            {
                "realm": settings.realm,
                "robot": readings,
                "processes": [_as_json(server, process) for server, process in processes.items()],
            }
        )
        return
    out = console()
    for line in _robot_lines(readings):
        out.print(line, soft_wrap=not for_people())
    for server, process in processes.items():
        out.print()
        _print_process(server, process, found, every_servant=every_servant)


def _read_robot(communicator: Communicator, found: list[ServantInfo]) -> dict[str, Json]:
    """Return what the robot's servants tell, by the name of their interface."""
    readings: dict[str, Json] = {}
    for type_id, operation in _READINGS.items():
        info = next((each for each in found if type_id in each.interfaces and not each.facet), None)
        if info is None:
            continue
        name = type_id.rpartition("::")[2]
        try:
            (result,) = find_servant(communicator, info.identity).invoke(operation, ()).values()
        except (ZenohIceError, KeyError, ValueError) as error:
            readings[name] = {"error": str(error)}
        else:
            readings[name] = to_json(result)
    return readings


def _robot_lines(readings: Mapping[str, Any]) -> list[str]:
    """Return what people are told of the robot, a line for each matter."""
    lines: list[tuple[str, str]] = []
    for name, tell in _TELLERS.items():
        reading = readings.get(name)
        if reading is None:
            continue
        try:
            error = reading.get("error")
            lines += tell(reading) if error is None else [(name.lower(), f"[red]{_escaped(error)}[/red]")]
        except (AttributeError, KeyError, TypeError, ValueError):
            lines.append((name.lower(), f"[red]another version of the interface nao::{name}[/red]"))
    return [f"[dim]{name:<9}[/dim] {text}" for name, text in lines]


def _clock_lines(clock: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    kind = "simulated" if clock["simulated"] else "real"
    yield "robot", f"{kind}, robot time {clock['time']:.1f} s, {clock['rate']:.2f} times real time"


def _battery_lines(battery: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    yield "battery", f"{100 * battery['charge']:.0f} %" + (", charging" if battery["plugged"] else "")


def _safety_lines(safety: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    if safety["stopped"]:
        yield "safety", f"[bold red]emergency stop: {_escaped(safety['reason'])}[/bold red]"
    elif safety["holder"]:
        yield "safety", f"{_escaped(safety['holder'])} alone may command, for {safety['remaining']:.0f} s"
    else:
        yield "safety", "everybody may command"


def _health_lines(health: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    posture = "[bold red]fallen[/bold red]" if health["fallen"] else "upright"
    tilt = math.degrees(health["torsoTilt"])
    yield "posture", f"{posture}, torso {tilt:.0f} degrees from the vertical"
    commands = count_text(health["limitedCommands"], "command")
    timeouts = count_text(health["velocityTimeouts"], "velocity", "velocities")
    yield "limits", f"{commands} limited, {timeouts} not renewed in time"
    for event in health["events"][-_MOST_EVENTS:]:
        color = {"Error": "red", "Warning": "yellow"}.get(event["level"], "dim")
        text = _escaped(f"{event['time']:.1f} s {event['source']}: {event['message']}")
        yield "", f"[{color}]{text}[/{color}]"


_TELLERS: Final[Mapping[str, Callable[[Mapping[str, Any]], Iterator[tuple[str, str]]]]] = {
    "Clock": _clock_lines,
    "Battery": _battery_lines,
    "Safety": _safety_lines,
    "Health": _health_lines,
}


def _print_process(
    server: str, process: ProcessStatus | ZenohIceError, found: list[ServantInfo], *, every_servant: bool
) -> None:
    from rich.table import Table
    from rich.text import Text

    out = console()
    if not isinstance(process, ProcessStatus):
        names = [info.identity for info in found if info.server == server]
        out.print(Text.assemble((f"process {server[:8]}", "bold"), ("  does not answer", "bold red")))
        out.print(Text(f"  it serves {', '.join(names[:6])}" + (" ..." if len(names) > 6 else "")))
        return
    head = f"  pid {process.pid} on {printable(process.host)}, for {span_text(time.time() - process.since)}"
    out.print(Text.assemble((printable(process.program), "bold"), head))
    memory = "shared memory" if process.shared_memory else "no shared memory"
    versions = f"visualhfsm {process.version}, zenoh {process.zenoh}, Python {process.python}, {memory}"
    out.print(Text(f"  {printable(versions)}", style="dim"))
    rows = sorted(process.servants.items(), key=lambda item: (-_trouble(item[1]), -item[1].calls, item[0]))
    shown = [
        row
        for index, row in enumerate(rows)
        if every_servant or _trouble(row[1]) or (row[1].calls and index < _MOST_SERVANTS)
    ]
    table = Table(box=None, padding=(0, 0, 0, 2), header_style="dim")
    table.add_column("SERVANT", no_wrap=True, overflow="ellipsis", min_width=24)
    for title in ("CALLS", "FAILED", "REFUSED", "RUNNING", "BUSY"):
        table.add_column(title, justify="right", no_wrap=True)
    for name, each in shown:
        table.add_row(
            Text(printable(name.rpartition("@")[0] or name)),
            str(each.calls),
            _counted(each.failed),
            _counted(each.refused),
            str(each.running or "-"),
            duration_text(each.busy_for) if each.busy_for else "-",
        )
    if shown:
        out.print(table)
    if len(rows) > len(shown):
        rest = f"{len(rows) - len(shown)} more" if shown else count_text(len(rows), "servant")
        calls = sum(each.calls for each in process.servants.values()) - sum(each.calls for _, each in shown)
        out.print(Text(f"  {rest}, with {count_text(calls, 'call')}", style="dim"))


def _trouble(servant: ServantStatus) -> int:
    return servant.failed + servant.refused + (servant.busy_for > 0)


def _counted(number: int) -> str:
    return f"[yellow]{number}[/yellow]" if number else "-"


def _escaped(text: str) -> str:
    from rich.markup import escape

    return escape(printable(text))


def _as_json(server: str, process: ProcessStatus | ZenohIceError) -> Json:
    if not isinstance(process, ProcessStatus):
        return {"id": server, "error": str(process)}
    told = to_json(process)
    return {"id": server, **told} if isinstance(told, dict) else told
