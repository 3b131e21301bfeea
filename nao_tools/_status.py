"""Show the state of a robot and of the processes around it."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Mapping
from typing import Annotated, Any, Final

import msgspec
from rich.markup import escape
from rich.table import Table

from nao_tools._connection import ask_processes, find_servant, nobody, servants
from nao_tools._output import console, count_text, lost_text, print_json, span_text
from nao_tools._values import Json, to_json
from zenoh_ice import Communicator, ServantInfo, ZenohIceError, initialize
from zenoh_ice.data import typed
from zenoh_ice.data.status import ProcessStatus, ServantStatus
from zenoh_ice.data.text import few, printable
from zenoh_ice.settings import Settings

_MOST_EVENTS: Final = 5
_MOST_SERVANTS: Final = 8  # of a process that are shown, besides those with troubles


class _Named(msgspec.Struct):
    """The beginning of a body's description."""

    name: Annotated[str, msgspec.Meta(max_length=64)]
    title: Annotated[str, msgspec.Meta(max_length=64)] = ""


def status(settings: Settings, *, every_servant: bool, as_json: bool) -> None:
    """Print the state of the robot, and the activity of each serving process.

    Raises ConnectFailedException when nothing answers at the endpoints, NaoError when there is no servant.
    """
    with initialize(settings) as communicator:
        found = servants(communicator)
        if not found:
            raise nobody(communicator)
        processes = ask_processes(communicator, found)
        readings = _read_robot(communicator, found)
    if as_json:
        shown = [
            {"id": server}
            | ({"error": str(each)} if isinstance(each, ZenohIceError) else msgspec.to_builtins(each))
            for server, each in processes.items()
        ]
        print_json({"realm": settings.realm, "robot": readings, "processes": [*shown]})
        return
    out = console()
    for name, text in _robot_lines(readings):
        out.print(f"[dim]{name:<9}[/dim] {text}")
    for server, process in processes.items():
        out.print()
        if isinstance(process, ProcessStatus):
            _print_process(process, every_servant=every_servant)
        else:
            names = [info.identity for info in found if info.server == server]
            out.print(f"[bold]process {_escaped(server[:8])}[/bold]  [bold red]does not answer[/bold red]")
            out.print(f"  it serves {_escaped(few(names, 6))}")


# The robot: the question to each of its interfaces, and the lines that people are shown of the answer.


def _clock(clock: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    kind = "simulated" if clock["simulated"] else "real"
    yield "robot", f"{kind}, robot time {clock['time']:.1f} s, {clock['rate']:.2f} times real time"


def _body(body: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    yield "body", _escaped(body["title"])


def _battery(battery: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    yield "battery", f"{100 * battery['charge']:.0f} %" + (", charging" if battery["plugged"] else "")


def _safety(safety: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    if safety.get("lost"):
        lost = _escaped(lost_text(safety["lost"], safety["lostFor"]))
        yield "", f"[bold red]{lost}; no command reaches the robot[/bold red]"
    if safety["stopped"]:
        yield "safety", f"[bold red]emergency stop: {_escaped(safety['reason'])}[/bold red]"
    elif safety["holder"]:
        yield "safety", f"{_escaped(safety['holder'])} may command alone, for {safety['remaining']:.0f} s"
    else:
        yield "safety", "everybody may command"


def _health(health: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
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


_READINGS: Final[dict[str, tuple[str, Callable[[Mapping[str, Any]], Iterator[tuple[str, str]]]]]] = {
    "Clock": ("getTime", _clock),
    "Description": ("getBody", _body),
    "Battery": ("getBatteryReading", _battery),
    "Safety": ("getSafetyState", _safety),
    "Health": ("getHealth", _health),
}


def _read_robot(communicator: Communicator, found: list[ServantInfo]) -> dict[str, Json]:
    """Return what the robot's servants answer, by the name of their interface."""
    readings: dict[str, Json] = {}
    for name, (operation, _) in _READINGS.items():
        info = next((each for each in found if f"::nao::{name}" in each.interfaces), None)
        if info is None:
            continue
        try:
            (result,) = find_servant(communicator, info.identity).invoke(operation, ()).values()
        except (ZenohIceError, KeyError, ValueError) as error:
            readings[name] = {"error": str(error)}
        else:
            readings[name] = _named(result) if name == "Description" else to_json(result)
    return readings


def _named(body: object) -> dict[str, Json]:
    """Return what a description calls the robot; the rest of it is long."""
    try:
        found = typed.from_json(str(body), _Named)
    except (msgspec.MsgspecError, RecursionError) as error:
        return {"error": f"the description of the body cannot be read: {error}"}
    return {"name": found.name, "title": found.title or found.name}


def _robot_lines(readings: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """Yield the lines that people are shown of the robot: a title and a text with rich's markup for each."""
    for name, reading in readings.items():
        try:
            if "error" in reading:
                yield name.lower(), f"[red]{_escaped(reading['error'])}[/red]"
            else:
                yield from list(_READINGS[name][1](reading))
        except (AttributeError, KeyError, TypeError, ValueError):
            yield name.lower(), f"[red]another version of the interface nao::{name}[/red]"


def _escaped(text: str) -> str:
    return escape(printable(text))


def _print_process(process: ProcessStatus, *, every_servant: bool) -> None:
    out = console()
    where = f"pid {process.pid} on {_escaped(process.host)}, for {span_text(time.time() - process.since)}"
    out.print(f"[bold]{_escaped(process.program)}[/bold]  {where}")
    way = "local socket" if process.local_sockets else "no local socket"
    versions = f"visualhfsm {process.version}, zenoh {process.zenoh}, Python {process.python}, {way}"
    out.print(f"  [dim]{_escaped(versions)}[/dim]")
    rows = sorted(process.servants.items(), key=lambda item: (-_trouble(item[1]), -item[1].calls, item[0]))
    shown = [
        (name, each)
        for index, (name, each) in enumerate(rows)
        if every_servant or _trouble(each) or (each.calls and index < _MOST_SERVANTS)
    ]
    table = Table(box=None, padding=(0, 0, 0, 2), header_style="dim")
    table.add_column("SERVANT", no_wrap=True, overflow="ellipsis", min_width=24)
    for title in ("CALLS", "FAILED", "REFUSED", "RUNNING", "WAITING"):
        table.add_column(title, justify="right", no_wrap=True)
    for name, each in shown:
        failed, refused = (
            f"[yellow]{count}[/yellow]" if count else "-" for count in (each.failed, each.refused)
        )
        identity = _escaped(name.rpartition("@")[0] or name)
        table.add_row(
            identity, str(each.calls), failed, refused, str(each.running or "-"), str(each.waiting or "-")
        )
    if shown:
        out.print(table)
    if len(rows) > len(shown):
        rest = f"{len(rows) - len(shown)} more" if shown else count_text(len(rows), "servant")
        calls = sum(each.calls for _, each in rows) - sum(each.calls for _, each in shown)
        out.print(f"  [dim]{rest}, with {count_text(calls, 'call')}[/dim]")


def _trouble(servant: ServantStatus) -> int:
    return servant.failed + servant.refused + servant.waiting
