"""Check the network: endpoints, processes, their versions, how fast they answer, and their clocks."""

from __future__ import annotations

import importlib.util
import math
import statistics
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Final

from deploy.nao.connection import ask_processes, find_servant, nobody, process_name, proxy_of, servants
from deploy.nao.doctor import Finding, fail, note, ok, warn
from deploy.nao.doctor.installation import installed_version
from deploy.nao.ports import holder_of, listens
from deploy.nao.quantities import count_text, duration_text
from zenoh_ice import Communicator, EndpointInUseException, ServantInfo, ZenohIceError, initialize
from zenoh_ice.reflection import describe_package
from zenoh_ice.settings import DEFAULT_ENDPOINT, Settings
from zenoh_ice.status import ProcessStatus

__all__ = ["check_network"]

_PINGS: Final = 20
_SLOW: Final = 0.01  # s; on one machine a ping takes a quarter of a millisecond
_CLOCK: Final = "::nao::Clock"
_GET_TIME: Final = "getTime"
_SAMPLE_LIMIT: Final = 2.0  # s
_CLOCKS_APART: Final = 0.1  # s between two machines, which makes the ages of samples wrong

_Processes = dict[str, ProcessStatus | ZenohIceError]


def check_network(settings: Settings) -> Iterator[Finding]:
    """Yield what is found about the endpoints, and about those who serve in the realm."""
    states = {endpoint: listens(endpoint) for endpoint in settings.connect}
    for endpoint, state in states.items():
        yield _endpoint(endpoint, state)
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
            yield from _check_clocks(communicator, found)
    except EndpointInUseException as error:
        yield fail(str(error), "leave --listen and VISUALHFSM_LISTEN away: only servers need a fixed port")


def _endpoint(endpoint: str, state: bool | None) -> Finding:
    if state is None:
        return note(f"{endpoint} is not looked at without a link")
    if state:
        holder = holder_of(endpoint)
        return ok(f"{endpoint} is open" + (f", held by {holder}" if holder else ""))
    start = "start a robot server, for instance: naoserver-sim"
    elsewhere = f"start a server with --listen {endpoint}, or see where it listens, and set --connect"
    return fail(f"nothing listens at {endpoint}", start if endpoint == DEFAULT_ENDPOINT else elsewhere)


def _nobody(communicator: Communicator) -> Finding:
    reason = nobody(communicator)
    if communicator.presence.linked():
        return fail(str(reason), "start a server in this realm, or name the realm of one with --realm")
    return fail(
        f"no link: {reason}",
        "if the port is open, something else has it, or certificates or passwords differ: docs/security.md",
    )


def _check_processes(found: list[ServantInfo], processes: _Processes) -> Iterator[Finding]:
    """Yield processes that hang or are of other versions than this one."""
    wrong = False
    for server, status in processes.items():
        if not isinstance(status, ProcessStatus):
            wrong = True
            served = _few([info.identity for info in found if info.server == server])
            text = f"the process that serves {served} does not answer: {status}"
            yield fail(text, "if it is stopped or hangs, end it and start it again")
            continue
        for name, theirs in (("visualhfsm", status.version), ("eclipse-zenoh", status.zenoh)):
            own = installed_version(name)
            if own not in {None, theirs}:
                wrong = True
                who = f"{process_name(status, server)} on {status.host}"
                yield warn(f"{who} has {name} {theirs}, here it is {own}", "install the same on both sides")
    if not wrong:
        yield ok("all processes answer, and have the versions of this machine")


def _check_identities(found: list[ServantInfo], processes: _Processes) -> Iterator[Finding]:
    """Yield which processes serve the same names."""
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
            f" {_few(names)}",
            "end one of them, or start it with another --realm",
        )


def _check_interfaces(found: list[ServantInfo]) -> Iterator[Finding]:
    """Yield servants whose interfaces are of another version than those that are installed here."""
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
            f"{_few(identities)}: another version of {type_id} than the one installed here",
            "install the same version on both sides; after a change of the IDL run codegen, and start again",
        )
    if not differing:
        yield ok("the interfaces are those that are installed here")


def _check_answers(
    communicator: Communicator, found: list[ServantInfo], processes: _Processes
) -> Iterator[Finding]:
    """Yield how long a ping of each process takes."""
    for server, status in processes.items():
        info = next((each for each in found if each.server == server and "=" not in each.identity), None)
        if info is None or not isinstance(status, ProcessStatus):
            continue
        proxy = proxy_of(communicator, info)
        try:
            times = [_timed(proxy.ice_ping) for _ in range(_PINGS)]
        except ZenohIceError as error:
            yield fail(f"{info.identity} does not answer: {error}", "end its process and start it again")
            continue
        usual = statistics.median(times)
        name, longest = process_name(status, server), duration_text(max(times))
        text = f"{name} answers within {duration_text(usual)}, at most {longest}"
        fix = "look at the load of the machine and at the network, WLAN above all"
        yield warn(f"{text}: slowly", fix) if usual > _SLOW else ok(text)


def _timed(call: Callable[[], object]) -> float:
    """Return how many seconds a call takes."""
    started = time.perf_counter()
    call()
    return time.perf_counter() - started


def _check_clocks(communicator: Communicator, found: list[ServantInfo]) -> Iterator[Finding]:
    """Yield whether the robot's time passes, and how far apart the clocks of the machines are."""
    info = next((each for each in found if _CLOCK in each.interfaces), None)
    if info is None:
        yield note("no robot's clock in this realm: behaviors go by the wall's time")
        return
    try:
        proxy = find_servant(communicator, info.identity)
        stream = proxy.stream(_GET_TIME)
        sample = stream.wait(stream.wait(timeout=_SAMPLE_LIMIT), timeout=_SAMPLE_LIMIT)
    except (ZenohIceError, KeyError) as error:
        yield fail(f"the robot's clock stands still: {error}", "end the robot server and start it again")
        return
    apart = time.time() - sample.wall_time
    rate = float(getattr(sample.value, "rate", math.nan))
    if not -_CLOCKS_APART < apart < _CLOCKS_APART:
        yield warn(
            f"the clocks of this machine and of the robot's server are {duration_text(abs(apart))} apart,"
            " or samples come that late",
            "let both follow a time server: sudo timedatectl set-ntp true",
        )
    elif rate == 0:
        yield note("the robot's time is paused", "resume it, if it is not meant to be")
    else:
        yield ok(f"the robot's time passes {rate:.2f} times as fast as the wall's")


def _few(names: list[str]) -> str:
    return ", ".join(names[:3]) + (" ..." if len(names) > 3 else "")
