"""List the servants of a realm, and describe one: its operations and the types that they use."""

from __future__ import annotations

import time
from contextlib import suppress
from fnmatch import fnmatchcase

import msgspec
from rich.table import Table
from rich.text import Text

from nao_tools import NaoError
from nao_tools._connection import (
    ask_processes,
    by_kind,
    loss,
    nobody,
    operation_of,
    process_name,
    servants,
    split,
)
from nao_tools._dynamic import DynamicProxy
from nao_tools._output import console, count_text, for_people, print_json, span_text, wrapped
from nao_tools._values import Json
from zenoh_ice import Communicator, ServantInfo, ZenohIceError, initialize
from zenoh_ice.data.reflection import OperationDescription, unscoped
from zenoh_ice.data.status import ProcessStatus
from zenoh_ice.settings import Settings


def list_servants(settings: Settings, pattern: str, *, as_json: bool) -> None:
    """Print the servants whose name or interface fits a pattern.

    Raises ConnectFailedException when nothing answers at the endpoints, NaoError when there is no servant.
    """
    with initialize(settings) as communicator:
        everything = servants(communicator)
        if not everything:
            raise nobody(communicator)
        found = [info for info in everything if _fits(info, pattern)]
        if not found and not as_json:
            raise NaoError(f"none of {count_text(len(everything), 'servant')} fits {pattern!r}")
        processes = ask_processes(communicator, found)
        own: dict[int, str] = {}
        for kind in by_kind(found):
            own |= dict.fromkeys(map(id, kind), _own_interface(communicator, kind[0]))
        lost = "" if as_json else loss(communicator, everything)
    if as_json:
        print_json([_as_json(info, own[id(info)], processes[info.server]) for info in found])
        return
    table = Table(box=None, pad_edge=False, header_style="dim")
    # On a narrow terminal names stay whole: they are typed next.
    longest = max(len(info.identity) for info in found)
    table.add_column("SERVANT", style="bold", no_wrap=True, min_width=longest)
    table.add_column("INTERFACE", style="cyan", no_wrap=True)
    table.add_column("SERVED BY", no_wrap=True)
    table.add_column("FOR", justify="right", no_wrap=True)
    for info in found:
        process = process_name(processes[info.server], info.server)
        interface, duration = own[id(info)].removeprefix("::"), span_text(time.time() - info.since)
        table.add_row(*map(Text, (info.identity, interface, process, duration)))
    console().print(table)
    if lost:
        console().print(f"the robot is {lost}; no command reaches it", style="bold red", markup=False)
    if for_people():
        counted = f"{count_text(len(found), 'servant')} in realm {settings.realm}"
        console().print(f"{counted}, {count_text(len(processes), 'process', 'processes')}", style="dim")


def _fits(info: ServantInfo, pattern: str) -> bool:
    """Return whether a name or a type matches a pattern like `*Motors`, or contains a word like `motors`."""
    texts = (info.identity, *info.interfaces)
    if any(sign in pattern for sign in "*?["):
        return any(fnmatchcase(text, pattern) for text in texts)
    return any(pattern.lower() in text.lower() for text in texts)


def _own_interface(communicator: Communicator, info: ServantInfo) -> str:
    """Return the servant's own interface, not one that this extends."""
    if len(info.interfaces) > 1:
        with suppress(ZenohIceError):  # it hangs, or is offline: its token has to suffice
            return communicator.stringToProxy(info.identity).ice_id()
    return ", ".join(info.interfaces)


def _as_json(info: ServantInfo, own: str, process: ProcessStatus | ZenohIceError) -> Json:
    server: dict[str, Json] = {"id": info.server}
    if isinstance(process, ProcessStatus):
        server |= {"program": process.program, "pid": process.pid, "host": process.host}
    return {
        "servant": info.identity,
        "interface": own,
        "interfaces": dict[str, Json](info.interfaces),
        "server": server,
        "since": info.since,
    }


def describe(settings: Settings, address: str, *, as_json: bool) -> None:
    """Print the operations of a servant, or one of them, with the types that they use.

    Raises NaoError for an unknown operation, and the exceptions of a call.
    """
    with initialize(settings) as communicator:
        proxy, name = split(communicator, address)
    shown = list(proxy.interface_operations.values())
    if name:
        shown = [operation_of(proxy, name, shown)]
    if as_json:
        print_json(
            {
                "servant": proxy.identity,
                "interface": proxy.type_id,
                "fingerprint": proxy.fingerprint,
                "operations": msgspec.to_builtins(shown),
            }
        )
        return
    out = console()
    out.print(f"{proxy.identity} is a {proxy.type_id.removeprefix('::')}  (fingerprint {proxy.fingerprint})")
    for operation in shown:
        marks = ["stream"] * operation.streamed + ["idempotent"] * operation.idempotent
        marked = f"  [{', '.join(marks)}]" if marks else ""
        out.print(wrapped(f"  {proxy.signature(operation.name)}{marked}", 6))
        if operation.exceptions:
            out.print(wrapped(f"    throws {', '.join(sorted(map(unscoped, operation.exceptions)))}", 8))
    for line in _types(proxy, shown):
        out.print(wrapped(line, 4))


def _types(proxy: DynamicProxy, shown: list[OperationDescription]) -> list[str]:
    """Return the structs with their members and the enumerations with their names that operations use."""
    waiting = [each.type for operation in shown for each in (*operation.parameters, *operation.results)]
    described: dict[str, str] = {}
    while waiting:
        type_id = waiting.pop(0)
        definition = proxy.schema.definitions.get(type_id)
        if definition is None or type_id in described:
            continue
        described[type_id] = ""
        match definition.kind:
            case "enumeration":
                names = ", ".join(each.name for each in definition.enumerators)
                described[type_id] = f"enum {unscoped(type_id)}: {names}"
            case "struct" | "class":
                members = proxy.schema.members(type_id)
                listed = ", ".join(f"{proxy.type_text(each)} {each.name}" for each in members)
                described[type_id] = f"{definition.kind} {unscoped(type_id)}: {listed}"
                waiting += [member.type for member in members]
            case _:
                waiting[:0] = [definition.element, definition.key, definition.value]
    return list(filter(None, described.values()))
