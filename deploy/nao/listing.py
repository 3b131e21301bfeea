"""List the servants of a realm."""

from __future__ import annotations

import time
from contextlib import suppress
from fnmatch import fnmatchcase

from deploy.nao import NaoError
from deploy.nao.connection import ask_processes, by_kind, nobody, process_name, proxy_of, servants
from deploy.nao.output import console, for_people, print_json
from deploy.nao.quantities import count_text, span_text
from deploy.nao.values import Json
from zenoh_ice import Communicator, ServantInfo, ZenohIceError, initialize
from zenoh_ice.settings import Settings
from zenoh_ice.status import ProcessStatus

__all__ = ["list_servants"]

_HEAD = ("SERVANT", "INTERFACE", "SERVED BY", "FOR")


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
        own = {
            id(info): interface
            for kind in by_kind(found)
            for interface in [_own_interface(communicator, kind)]
            for info in kind
        }
    if as_json:
        print_json([_as_json(info, own[id(info)], processes[info.server]) for info in found])
        return
    _print_table([_row(info, own[id(info)], processes[info.server]) for info in found])
    if for_people():
        counted = f"{count_text(len(found), 'servant')} in realm {settings.realm}"
        console().print(f"{counted}, {count_text(len(processes), 'process', 'processes')}", style="dim")


def _fits(info: ServantInfo, pattern: str) -> bool:
    """Return whether a name or a type fits `*Motors`, or has `motors` in it."""
    texts = (info.identity, *info.interfaces)
    if any(sign in pattern for sign in "*?["):
        return any(fnmatchcase(text, pattern) for text in texts)
    return any(pattern.lower() in text.lower() for text in texts)


def _own_interface(communicator: Communicator, kind: list[ServantInfo]) -> str:
    """Return which interface is the own one of servants that have the same; one of them is asked."""
    if len(kind[0].interfaces) > 1:
        with suppress(ZenohIceError):  # it hangs, or is gone: its token has to do
            return proxy_of(communicator, kind[0]).ice_id()
    return ", ".join(kind[0].interfaces)


def _row(info: ServantInfo, own: str, process: ProcessStatus | ZenohIceError) -> tuple[str, str, str, str]:
    who = process_name(process, info.server)
    return info.identity, own.removeprefix("::"), who, span_text(time.time() - info.since)


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


def _print_table(rows: list[tuple[str, str, str, str]]) -> None:
    from rich.text import Text

    widths = [max(map(len, column)) for column in zip(_HEAD, *rows, strict=True)]
    for row in (_HEAD, *rows):
        styles = ("dim",) * len(row) if row is _HEAD else ("bold", "cyan", "", "")
        line = Text("  ").join(map(Text, map(str.ljust, row, widths), styles))
        line.rstrip()
        # On a narrow terminal the names stay whole: they are what is typed next.
        console().print(line, no_wrap=True, overflow="ellipsis", soft_wrap=not for_people())
