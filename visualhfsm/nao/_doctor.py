"""Find problems between a robot and its programs, and say how to fix them."""

from __future__ import annotations

import importlib.util
import math
import os
import platform
import re
import resource
import socket
import statistics
import subprocess
import sys
import time
import timeit
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from enum import StrEnum
from functools import partial
from importlib.metadata import PackageNotFoundError, requires, version
from pathlib import Path
from typing import Final, NamedTuple

import msgspec

from visualhfsm.nao._connection import (
    ask_processes,
    find_servant,
    listens,
    loss,
    nobody,
    process_name,
    servants,
)
from visualhfsm.nao._dynamic import target_of
from visualhfsm.nao._output import console, count_text, duration_text, print_json, wrapped
from visualhfsm.nao._values import Json
from zenoh_ice import (
    Communicator,
    EndpointInUseException,
    ServantInfo,
    TimeoutException,
    ZenohIceError,
    initialize,
)
from zenoh_ice.application import hidden_interfaces
from zenoh_ice.application.kept_stop import UNREADABLE, Kept, kept_directory, read_kept
from zenoh_ice.reflection import describe_package
from zenoh_ice.settings import DEFAULT_ENDPOINT, Settings, host_and_port
from zenoh_ice.status import ProcessStatus
from zenoh_ice.text import few, printable

__all__ = [
    "Finding",
    "Level",
    "check_installation",
    "check_machine",
    "check_network",
    "check_robots",
    "examine",
    "holder_of",
]


class Level(StrEnum):
    """Severity of a finding."""

    OK = "ok"
    NOTE = "note"
    """Something that may be intended."""
    WARNING = "warn"
    """Something that will cause trouble, sooner or later."""
    FAILURE = "FAIL"
    """Something that does not work."""


class Finding(NamedTuple):
    """The result of a check, and how to fix it; `fix` is empty when there is nothing to do."""

    level: Level
    text: str
    fix: str = ""


_ok = partial(Finding, Level.OK)
_note = partial(Finding, Level.NOTE)
_warn = partial(Finding, Level.WARNING)
_fail = partial(Finding, Level.FAILURE)

_COLORS: Final = {Level.OK: "green", Level.NOTE: "cyan", Level.WARNING: "yellow", Level.FAILURE: "bold red"}
_MARGIN: Final = 7


def examine(settings: Settings, *, as_json: bool) -> bool:
    """Print what the checks find; return whether nothing failed."""
    checks: dict[str, Callable[[], Iterator[Finding]]] = {
        "installation": check_installation,
        "machine": check_machine,
        "robots": check_robots,
        "network": partial(check_network, settings),
    }
    found: list[Json] = []
    counts: Counter[Level] = Counter()
    for name, check in checks.items():
        if not as_json:
            console().print(name, style="bold")
        for finding in _guarded(name, check):
            counts[finding.level] += 1
            found.append({"check": name, **finding._asdict()})
            if not as_json:
                _print(finding)
    if as_json:
        print_json(found)
    elif counts[Level.FAILURE]:
        console().print(f"{counts[Level.FAILURE]} failed", style="bold red")
    elif counts[Level.WARNING]:
        console().print("it works, but see the warnings", style="yellow")
    else:
        console().print("all is well", style="bold green")
    return not counts[Level.FAILURE]


def _guarded(name: str, check: Callable[[], Iterator[Finding]]) -> Iterator[Finding]:
    """Yield the findings of a check; an error that ends the check is one, too."""
    try:
        yield from check()
    except (OSError, ValueError, ZenohIceError) as error:
        yield _fail(f"the {name} could not be checked further: {error}", "fix this first")


def _print(finding: Finding) -> None:
    line = wrapped(f"  {finding.level:<4} {printable(finding.text)}", _MARGIN)
    line.stylize(_COLORS[finding.level], 0, _MARGIN)
    console().print(line)
    if finding.fix:
        style = "dim" if finding.level == Level.NOTE else "bold"
        console().print(wrapped(f"{' ' * _MARGIN}fix: {printable(finding.fix)}", _MARGIN), style=style)


# The installation.

_DISTRIBUTION: Final = "visualhfsm"
_EXTRAS: Final[Mapping[str, str]] = {
    "": "needed by every command",
    "sim": "the simulated robot, naoserver-sim",
    "vision": "behaviors that see",
    "web": "the editor, visualhfsm edit",
    "naoqi": "the real robot, naoserver-naoqi",
    "ros2": "ROS 2, naoserver-ros2",
}
# A line such as `mujoco>=4.0; extra == 'sim'`: name, oldest version, and extra.
_REQUIREMENT: Final = re.compile(r"([\w.-]+)[^;>]*(?:>=([\d.]+))?[^;]*(?:;.*extra *== *['\"]([\w-]+))?")


def check_installation() -> Iterator[Finding]:
    """Yield findings about the installation: versions, extras, and a module that hides our interfaces."""
    try:
        lines = requires(_DISTRIBUTION) or []
    except PackageNotFoundError:
        lines = []
        yield _note(f"{_DISTRIBUTION} is not installed; running from a source tree")
    lacking: dict[str, list[str]] = {extra: [] for extra in _EXTRAS}
    for match in filter(None, map(_REQUIREMENT.match, lines)):
        name, oldest, extra = match.groups("")
        if extra not in lacking:
            continue
        installed = installed_version(name)
        if installed is None:
            lacking[extra].append(f"{name} is not installed")
        elif _numbers(installed) < _numbers(oldest):
            lacking[extra].append(f"{name} {installed} is older than {oldest}")
    if lacking[""]:
        yield _fail("; ".join(lacking.pop("")), f"pip install --upgrade {_DISTRIBUTION}")
    versions = ", ".join(f"{name} {installed_version(name)}" for name in (_DISTRIBUTION, "eclipse-zenoh"))
    yield _ok(f"Python {platform.python_version()}, {versions}")
    for extra, problems in lacking.items():
        if problems:
            install = f"optional: pip install --upgrade '{_DISTRIBUTION}[{extra}]'"
            if extra == "naoqi" and sys.version_info >= (3, 13):
                install = "optional: use Python 3.11 or 3.12, as qi is not built for newer ones"
            yield _note(f"{_EXTRAS[extra]}: {'; '.join(problems)}", install)
    if ready := [_EXTRAS[extra] for extra, problems in lacking.items() if not problems]:
        yield _ok(f"installed: {'; '.join(ready)}")
    # The folders that Python searches before those of installed packages.
    listed = (".", *os.environ.get("PYTHONPATH", "").split(os.pathsep))
    hidden = hidden_interfaces(str(Path(each).resolve()) for each in listed if each)
    yield _fail(*hidden.rsplit(": ", 1)) if hidden else _ok("no module hides our interfaces")


def installed_version(name: str) -> str | None:
    """Return the version of a distribution, or None when it is not installed."""
    try:
        return version(name)
    except PackageNotFoundError:
        return None


def _numbers(text: str) -> tuple[int, ...]:
    return tuple(int(part) for part in re.findall(r"\d+", text)[:3])


# The machine.

_GL_LIMIT: Final = 30.0  # s; software rendering takes some to start
_GL_PROGRAM: Final = """\
import sys
try:
    import mujoco
    from naoserver_sim.cameras import create_context
except ModuleNotFoundError as error:
    sys.exit(f"missing {error.name}")
import os
import numpy as np
ball = "<mujoco><worldbody><geom size='1' rgba='1 1 1 1'/></worldbody></mujoco>"
model = mujoco.MjModel.from_xml_string(ball)
data = mujoco.MjData(model)
mujoco.mj_forward(model, data)
with create_context(64, 64).as_current():
    context = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_50)
    mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, context)
    scene, camera, everything = mujoco.MjvScene(model, 10), mujoco.MjvCamera(), mujoco.mjtCatBit.mjCAT_ALL
    mujoco.mjv_updateScene(model, data, mujoco.MjvOption(), None, camera, everything, scene)
    viewport, picture = mujoco.MjrRect(0, 0, 64, 64), np.zeros((64, 64, 3), np.uint8)
    mujoco.mjr_render(viewport, scene, context)
    mujoco.mjr_readPixels(picture, None, viewport, context)
    context.free()
if not picture.any():
    sys.exit("the picture of a white ball is black")
print(f"a picture of 64x64 with {os.environ['MUJOCO_GL']}")
"""
"""Takes a picture in a separate process: a broken driver may crash the process that loads it."""
_GL_PACKAGES: Final = "sudo apt-get install libegl1 libegl-mesa0 libgl1 libgl1-mesa-dri libopengl0"
_SOFTWARE_GL: Final = "render in software: MUJOCO_GL=osmesa, after sudo apt-get install libosmesa6"
_FEW_FILES: Final = 1024
_OLDEST_TIME: Final = 1_704_067_200.0  # 2024-01-01: a clock before that was never set


def check_machine() -> Iterator[Finding]:
    """Yield findings about the machine: rendering, the limit of open files, and its clock."""
    yield _check_rendering()
    files, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    if 0 <= files < _FEW_FILES:
        text = f"a process may open only {files} files; each link takes one"
        yield _warn(text, "ulimit -n 4096, before you start it")
    if time.time() < _OLDEST_TIME:
        date = time.strftime("%Y-%m-%d")
        yield _fail(f"the machine's clock says {date}", "set it: sudo timedatectl set-ntp true")


def _check_rendering() -> Finding:
    """Check whether the simulated cameras can render."""
    try:
        done = subprocess.run(
            [sys.executable, "-P", "-c", _GL_PROGRAM], capture_output=True, timeout=_GL_LIMIT, check=False
        )
    except subprocess.TimeoutExpired:
        return _fail(f"GL: no picture within {_GL_LIMIT:g} s", _SOFTWARE_GL)
    output = (done.stderr.strip() if done.returncode else b"") or done.stdout
    last = output.decode(errors="replace").strip().rpartition("\n")[2][:300]
    if done.returncode == 0:
        return _ok(f"GL renders {last}")
    if last.startswith("missing "):
        return _note(f"GL: not checked, {last.removeprefix('missing ')} is not installed")
    if done.returncode < 0:
        return _fail(f"GL: the driver ended the process by signal {-done.returncode}", _SOFTWARE_GL)
    return _fail(f"GL: the simulated cameras have no pictures: {last}", _GL_PACKAGES)


# The robots that were served on this machine.

_MOST_KEPT: Final = 20  # whose kept stops are listed


def check_robots() -> Iterator[Finding]:
    """Yield a note for each robot whose next server on this machine starts stopped, or may do so."""
    try:
        files = sorted(kept_directory().glob("*.json"))
    except OSError as error:
        yield _fail(f"no emergency stop can be kept: {error}", "set XDG_STATE_HOME to a folder")
        return
    for path in files[:_MOST_KEPT]:
        realm = printable(path.stem.rpartition("-")[0])
        try:
            kept = read_kept(path)
        except (OSError, msgspec.MsgspecError):
            kept = Kept(stop=UNREADABLE)
        look = f"look at it, then: nao stop --reset --realm {realm}"
        if kept.stop:
            yield _note(f"a robot of realm {realm} is stopped: {printable(kept.stop)}", look)
        elif kept.running:
            text = f"a server of realm {realm} runs, or was killed: then the next one starts stopped"
            yield _note(text, "look at the robot before you start its server again")
    if len(files) > _MOST_KEPT:
        yield _note(f"{len(files) - _MOST_KEPT} more in {files[0].parent}", "delete those of former robots")
    if not files:
        yield _ok("none is stopped")


# The network.

_PINGS: Final = 20
_SLOW: Final = 0.01  # s; on one machine a ping takes a quarter of a millisecond
_SAMPLE_LIMIT: Final = 2.0  # s
_CLOCKS_APART: Final = 0.1  # s between two machines, which makes the ages of samples wrong
_LISTENING: Final = "0A"  # state in /proc/net/tcp
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
            yield _ok(
                f"realm {communicator.realm}: {count_text(len(found), 'servant')} of"
                f" {count_text(len(processes), 'process', 'processes')}: {names}"
            )
            yield from _check_processes(found, processes)
            yield from _check_identities(found, processes)
            yield from _check_interfaces(found)
            yield from _check_answers(communicator, found, processes)
            yield _check_clock(communicator, found)
            if lost := loss(communicator, found):
                yield _fail(
                    f"the robot is {lost}; no command reaches it, a stop neither",
                    "look at it, its power, cable and network; its server takes commands once it finds it",
                )
    except EndpointInUseException as error:
        yield _fail(str(error), "omit --listen and VISUALHFSM_LISTEN: only servers need a fixed port")


def _check_endpoint(endpoint: str, state: bool | None) -> Finding:
    if state is None:
        return _note(f"{endpoint} is not checked without a link")
    if state:
        holder = holder_of(endpoint)
        return _ok(f"{endpoint} is open" + (f", held by {holder}" if holder else ""))
    start = "start a robot server, for instance: naoserver-sim"
    elsewhere = f"start a server with --listen {endpoint}, or see where it listens, and set --connect"
    return _fail(f"nothing listens at {endpoint}", start if endpoint == DEFAULT_ENDPOINT else elsewhere)


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
    if communicator.presence.linked():
        return _fail(str(reason), "start a server in this realm, or name the realm of one with --realm")
    return _fail(
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
            yield _fail(text, "if it is stopped or hangs, end it and start it again")
            continue
        who = f"{process_name(status, server)} on {status.host}"
        for name, theirs in (("visualhfsm", status.version), ("eclipse-zenoh", status.zenoh)):
            own = installed_version(name)
            if own not in {None, theirs}:
                wrong = True
                yield _warn(f"{who} has {name} {theirs}, here it is {own}", "install the same on both sides")
    if not wrong:
        yield _ok("all processes answer, and have the versions of this machine")


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
        yield _fail(
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
        yield _fail(
            f"{few(identities)}: another version of {type_id} than the one installed here",
            "install the same version on both sides; after a change of the IDL run codegen, and start again",
        )
    if not differing:
        yield _ok("the interfaces match the installed ones")


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
            yield _fail(f"{info.identity} does not answer: {error}", "end its process and start it again")
            continue
        usual = statistics.median(times)
        name, longest = process_name(status, server), duration_text(max(times))
        near = communicator.transport.is_near(target_of(servant))
        way = "through its local socket" if near else "over the network"
        text = f"{name} answers {way} within {duration_text(usual)}, at most {longest}"
        fix = "check the load of the machine and the network, Wi-Fi first"
        yield _warn(f"{text}: slowly", fix) if usual > _SLOW else _ok(text)
        if not near and status.host == socket.gethostname():
            lack = "is not reached through its" if status.local_sockets else "has no"
            text = f"{name} {lack} local socket: calls and images of this machine go over the network"
            yield _note(text, "docs/explanation/calls.md says what a local socket needs")


def _check_clock(communicator: Communicator, found: list[ServantInfo]) -> Finding:
    """Check whether the robot's time passes, and how far apart the clocks of the machines are."""
    info = next((each for each in found if "::nao::Clock" in each.interfaces), None)
    if info is None:
        return _note("no robot clock in this realm: behaviors use wall time")
    try:
        stream = find_servant(communicator, info.identity).stream("getTime")
    except (ZenohIceError, KeyError) as error:
        return _fail(f"the robot's clock cannot be read: {error}", "install the same version on both sides")
    try:
        sample = stream.wait(stream.wait(timeout=_SAMPLE_LIMIT), timeout=_SAMPLE_LIMIT)
    except TimeoutException as error:
        return _fail(f"the robot's clock does not advance: {error}", "restart the robot server")
    except ZenohIceError as error:
        return _fail(f"the robot's clock cannot be read: {error}", "check the findings above")
    apart = time.time() - sample.wall_time
    rate = float(getattr(sample.value, "rate", math.nan))
    if not -_CLOCKS_APART < apart < _CLOCKS_APART:
        return _warn(
            f"the clocks of this machine and of the robot's server are {duration_text(abs(apart))} apart,"
            " or samples arrive that late",
            "let both follow a time server: sudo timedatectl set-ntp true",
        )
    if rate == 0:
        return _note("the robot's time is paused", "resume it, unless this is intended")
    return _ok(f"robot time passes {rate:.2f} times as fast as wall time")
