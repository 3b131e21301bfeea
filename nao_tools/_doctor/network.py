"""Check endpoints, servers and clocks of a realm."""

from __future__ import annotations

import importlib.util
import math
import socket
import statistics
import time
import timeit
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Final

from nao_tools import NaoError
from nao_tools._connection import (
    OtherVersionError,
    ask_processes,
    find_servant,
    listens,
    loss,
    nobody,
    process_name,
    servants,
)
from nao_tools._dynamic import target_of
from nao_tools._output import count_text, duration_text
from nao_tools.findings import Finding, fail, note, ok, warn
from zenoh_ice import (
    Communicator,
    ConnectFailedException,
    EndpointInUseException,
    ServantInfo,
    TimeoutException,
    ZenohIceError,
    initialize,
)
from zenoh_ice.data.reflection import describe_package
from zenoh_ice.data.status import ProcessStatus, version_of
from zenoh_ice.data.text import few, printable
from zenoh_ice.settings import DEFAULT_ENDPOINT, LOOPBACK_6, Settings, has_only_ipv6, host_and_port

_PINGS: Final = 20
_SLOW: Final = 0.01  # s; on one machine a ping takes a quarter of a millisecond
_SAMPLE_LIMIT: Final = 2.0  # s
_CLOCKS_APART: Final = 0.1  # s between two machines, which makes the ages of samples wrong
_LISTENING: Final = "0A"  # state in /proc/net/tcp
_SET_CLOCK: Final = "sudo timedatectl set-ntp true"
_WRONG_CLOCK: Final = "your clock says "  # what is said of a certificate that is not valid yet, or any more
_LONGEST_COMMAND: Final = 60  # characters of a process's command line

_Processes = dict[str, ProcessStatus | ZenohIceError]


def check_network(settings: Settings) -> Iterator[Finding]:
    """Yield findings about the endpoints and the servers of the realm."""
    states = {endpoint: listens(endpoint) for endpoint in settings.connect}
    for endpoint, state in states.items():
        yield _check_endpoint(endpoint, state)
    if states and all(state is False for state in states.values()):
        return
    try:
        with initialize(settings) as communicator:
            found = servants(communicator)
            if not found:
                yield _nobody(communicator)
                return
            processes = ask_processes(communicator, found)
            names = ", ".join(process_name(status, server) for server, status in processes.items())
            yield ok(
                f"realm {communicator.realm}: {count_text(len(found), 'servant')} of"
                f" {count_text(len(processes), 'process', 'processes')}: {names}"
            )
            yield from _check_processes(found, processes)
            yield from _check_identities(found, processes)
            yield from _check_interfaces(found)
            yield from _check_answers(communicator, found, processes)
            yield _check_clock(communicator, found)
            if lost := loss(communicator, found):
                yield fail(
                    f"the robot is {lost}; no command reaches it, a stop neither",
                    "look at it, its power, cable and network; its server takes commands once it finds it",
                )
    except ConnectFailedException as error:
        yield _no_link(error)
    except EndpointInUseException as error:
        yield fail(str(error), "omit --listen and VISUALHFSM_LISTEN: only servers need a fixed port")


def _check_endpoint(endpoint: str, state: bool | None) -> Finding:
    if state is None:
        return note(f"{endpoint} is not checked without a link")
    if state:
        holder = holder_of(endpoint)
        return ok(f"{endpoint} is open" + (f", held by {holder}" if holder else ""))
    start = "start a robot server, for instance: naoserver-sim"
    if has_only_ipv6():
        start += f" --listen '{LOOPBACK_6}', and give this command --connect '{LOOPBACK_6}'"
    elsewhere = f"start a server with --listen {endpoint}, or see where it listens, and set --connect"
    return fail(f"nothing listens at {endpoint}", start if endpoint == DEFAULT_ENDPOINT else elsewhere)


def holder_of(endpoint: str) -> str:
    """Return the process of this machine that listens at an endpoint, `naoserver-sim 4711`, or nothing."""
    place = host_and_port(endpoint)
    inodes = set()
    for table in (Path("/proc/net/tcp"), Path("/proc/net/tcp6")) if place else ():
        for row in table.read_text().splitlines()[1:] if table.exists() else ():
            cells = row.split()
            if place and cells[3] == _LISTENING and int(cells[1].rpartition(":")[2], 16) == place[1]:
                inodes.add(f"socket:[{cells[9]}]")
    for descriptor in Path("/proc").glob("[0-9]*/fd/*") if inodes else ():
        with suppress(OSError):  # another user's, or gone
            if str(descriptor.readlink()) in inodes:
                process = descriptor.parents[1]
                command = (process / "cmdline").read_text(errors="replace").replace("\0", " ")
                return f"{printable(command, _LONGEST_COMMAND).strip()} {process.name}"
    return ""


def _nobody(communicator: Communicator) -> Finding:
    reason = nobody(communicator)
    if isinstance(reason, OtherVersionError):
        return fail(str(reason), "then start both again")
    if isinstance(reason, NaoError):
        return fail(str(reason), "start a server in this realm, or name the realm of one with --realm")
    return _no_link(reason)


def _no_link(reason: ZenohIceError) -> Finding:
    if _WRONG_CLOCK in str(reason):
        return fail(f"no link: {reason}", f"{_SET_CLOCK}; if it is right: nao security renew")
    return fail(
        f"no link: {reason}",
        "if the port is open, a server that hangs or another program holds it, or certificates or passwords "
        "differ: docs/how-to/security.md",
    )


def _check_processes(found: list[ServantInfo], processes: _Processes) -> Iterator[Finding]:
    """Yield processes that hang, or are of other versions than this one."""
    wrong = False
    for server, status in processes.items():
        if not isinstance(status, ProcessStatus):
            wrong = True
            served = few([info.identity for info in found if info.server == server])
            text = f"the process that serves {served} does not answer: {status}"
            yield fail(text, "if it is stopped or hangs, end it and start it again")
            continue
        who = f"{process_name(status, server)} on {status.host}"
        for name, theirs in (("visualhfsm", status.version), ("eclipse-zenoh", status.zenoh)):
            own = version_of(name, "")
            if own not in {"", theirs}:
                wrong = True
                yield warn(f"{who} has {name} {theirs}, here it is {own}", "install the same on both sides")
    if not wrong:
        yield ok("all processes answer, and have the versions of this machine")


def _check_identities(found: list[ServantInfo], processes: _Processes) -> Iterator[Finding]:
    """Yield the names that several processes serve."""
    servers: dict[str, set[str]] = {}
    for info in found:
        servers.setdefault(info.identity, set()).add(info.server)
    shared: dict[tuple[str, ...], list[str]] = {}
    for name, who in servers.items():
        if len(who) > 1:
            shared.setdefault(tuple(sorted(who)), []).append(name)
    for together, names in shared.items():
        whose = " and ".join(process_name(processes[server], server) for server in together)
        yield fail(
            f"{whose} serve the same {count_text(len(names), 'name')}, so calls reach one of them:"
            f" {few(names)}",
            "end one of them, or start it with another --realm",
        )


def _check_interfaces(found: list[ServantInfo]) -> Iterator[Finding]:
    """Yield servants whose interfaces have another version than the installed ones."""
    installed: dict[str, str] = {}
    spec = importlib.util.find_spec("interfaces")
    for place in (spec.submodule_search_locations or ()) if spec else ():
        for schema in Path(place).glob("*/schema.json"):
            for type_id, definition in describe_package(f"interfaces.{schema.parent.name}").items():
                installed[type_id] = definition.fingerprint
    differing: dict[str, list[str]] = {}
    for info in found:
        for type_id, fingerprint in info.interfaces.items():
            if fingerprint and installed.get(type_id, fingerprint) != fingerprint:
                differing.setdefault(type_id, []).append(info.identity)
    for type_id, identities in differing.items():
        yield fail(
            f"{few(identities)}: another version of {type_id} than the one installed here",
            "install the same version on both sides; after a change of the IDL run codegen, and start again",
        )
    if not differing:
        yield ok("the interfaces match the installed ones")


def _check_answers(
    communicator: Communicator, found: list[ServantInfo], processes: _Processes
) -> Iterator[Finding]:
    """Yield the duration of a ping of each process, and the way that it takes."""
    for server, status in processes.items():
        info = next((each for each in found if each.server == server), None)
        if info is None or not isinstance(status, ProcessStatus):
            continue
        servant = communicator.stringToProxy(info.identity)
        try:
            times = timeit.repeat(servant.ice_ping, number=1, repeat=_PINGS)
        except ZenohIceError as error:
            yield fail(f"{info.identity} does not answer: {error}", "end its process and start it again")
            continue
        usual = statistics.median(times)
        name, longest = process_name(status, server), duration_text(max(times))
        near = communicator.transport.is_near(target_of(servant))
        way = "through its local socket" if near else "over the network"
        text = f"{name} answers {way} within {duration_text(usual)}, at most {longest}"
        fix = "check the load of the machine and the network, Wi-Fi first"
        yield warn(f"{text}: slowly", fix) if usual > _SLOW else ok(text)
        if not near and status.host == socket.gethostname():
            lack = "is not reached through its" if status.local_sockets else "has no"
            text = f"{name} {lack} local socket: calls and images of this machine go over the network"
            yield note(text, "docs/explanation/calls.md says what a local socket needs")


def _check_clock(communicator: Communicator, found: list[ServantInfo]) -> Finding:
    """Check whether the robot's time passes, and how far apart the clocks of the machines are."""
    info = next((each for each in found if "::nao::Clock" in each.interfaces), None)
    if info is None:
        return note("no robot clock in this realm: behaviors use wall time")
    try:
        stream = find_servant(communicator, info.identity).stream("getTime")
    except (ZenohIceError, KeyError) as error:
        return fail(f"the robot's clock cannot be read: {error}", "install the same version on both sides")
    try:
        sample = stream.wait(stream.wait(timeout=_SAMPLE_LIMIT), timeout=_SAMPLE_LIMIT)
    except TimeoutException as error:
        return fail(f"the robot's clock does not advance: {error}", "restart the robot server")
    except ZenohIceError as error:
        return fail(f"the robot's clock cannot be read: {error}", "check the findings above")
    apart = time.time() - sample.wall_time
    rate = float(getattr(sample.value, "rate", math.nan))
    if not -_CLOCKS_APART < apart < _CLOCKS_APART:
        return warn(
            f"the clocks of this machine and of the robot's server are {duration_text(abs(apart))} apart,"
            " or samples arrive that late",
            f"let both follow a time server: {_SET_CLOCK}",
        )
    if rate == 0:
        return note("the robot's time is paused", "resume it, unless this is intended")
    return ok(f"robot time passes {rate:.2f} times as fast as wall time")
