"""Find the targets of a command: servants, their processes, and an operation by `Servant.operation`."""

from __future__ import annotations

import difflib
import socket
import time
from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Final

from nao_tools import NaoError
from nao_tools._dynamic import DynamicProxy, target_of
from nao_tools._output import lost_text
from zenoh_ice import Communicator, ServantInfo, ZenohIceError
from zenoh_ice.application.emergency_stop import SAFETY
from zenoh_ice.data.keys import Target
from zenoh_ice.data.reflection import OperationDescription
from zenoh_ice.data.status import ProcessStatus
from zenoh_ice.data.text import few, printable
from zenoh_ice.settings import host_and_port

_NEWS_LIMIT: Final = 0.1  # s without news after which all servants of a link are known; it arrives within ms
_FIRST_NEWS_LIMIT: Final = 0.5  # s after which a link without any news has no servants
_CONNECTION_LIMIT: Final = 1.0  # s to wait for a connection
_ANSWER_LIMIT: Final = 1.0  # s within which a process reports its status, unless it hangs
# The same for who lets calls take longer, as over a slow network: parts of their limit.
_NEWS_SHARE, _FIRST_NEWS_SHARE, _CONNECTION_SHARE, _ANSWER_SHARE = 0.01, 0.1, 0.5, 0.1
_LONGEST_FIRST_NEWS: Final = 2.0  # s
_CHECK_PERIOD: Final = 0.02  # s
_AT_ONCE: Final = 16
_CONNECTION: Final = 1.0  # s until a connection is made


def servants(communicator: Communicator) -> list[ServantInfo]:
    """Return the servants of the realm once all are known; none when nobody answers."""
    known: list[ServantInfo] = []
    patience = communicator.settings.timeout
    news = max(_NEWS_LIMIT, _NEWS_SHARE * patience)
    first = max(_FIRST_NEWS_LIMIT, min(_FIRST_NEWS_SHARE * patience, _LONGEST_FIRST_NEWS))
    started = changed = time.monotonic()
    longest = max(_CONNECTION_LIMIT, _CONNECTION_SHARE * patience) if _may_be_linked(communicator) else 0.0
    while (now := time.monotonic()) < started + longest:
        found = communicator.servants()
        if found != known or not communicator.presence.linked():  # news of a link come once it is made
            known, changed = found, now
        elif now - changed >= (news if known else first):
            break
        time.sleep(_CHECK_PERIOD)
    return known


def by_kind(found: Iterable[ServantInfo]) -> list[list[ServantInfo]]:
    """Return servants grouped by their interfaces: of each group only one needs to be asked for more."""
    kinds: dict[frozenset[tuple[str, str]], list[ServantInfo]] = {}
    for info in found:
        kinds.setdefault(frozenset(info.interfaces.items()), []).append(info)
    return list(kinds.values())


class OtherVersionError(NaoError):
    """The servants of the realm are of another version."""


def nobody(communicator: Communicator) -> ZenohIceError:
    """Return the error for a realm without servants; it names the realms that have some."""
    if not communicator.presence.linked():
        return communicator.presence.explain_absence(Target(communicator.realm, "Nobody"))
    if other := communicator.presence.other_version_in(communicator.realm):
        return OtherVersionError(f"realm {communicator.realm!r} has {other}")
    tokens: list[str] = []
    watch = communicator.transport.watch("@servant/**", lambda token, _: tokens.append(token))
    time.sleep(_FIRST_NEWS_LIMIT)
    watch.close()
    others = sorted({token.split("/")[1] for token in tokens} - {communicator.realm})
    there_is = f"there is --realm {', '.join(others)}" if others else "and no other realm is known here"
    return NaoError(f"realm {communicator.realm!r} has no servants; {there_is}")


def find_servant(communicator: Communicator, identity: str) -> DynamicProxy:
    """Return a proxy of a servant that is online; raises the exceptions of a call."""
    wait_for_servant(communicator, identity)
    return DynamicProxy(communicator.stringToProxy(identity))


def wait_for_servant(communicator: Communicator, identity: str) -> None:
    """Wait until a servant is online; raises the exceptions of a call when it is not soon."""
    target = target_of(communicator.stringToProxy(identity))
    if not _is_there(communicator, target):
        raise communicator.presence.explain_absence(target)


def split(communicator: Communicator, text: str) -> tuple[DynamicProxy, str]:
    """Split `Servant.operation` into servant and operation; the servant's name may have dots, too.

    The operation is empty when the text names a servant alone. Raises the exceptions of a call when neither
    reading names a servant that is online.
    """
    identity, dot, name = text.rpartition(".")
    if not dot:
        return find_servant(communicator, text), ""
    # Only the servants that are online show whether `Hfsm.follow_ball` names one, or one and its operation.
    wanted, whole = (communicator.stringToProxy(each) for each in (identity, text))
    if _is_there(communicator, target_of(wanted)):
        return DynamicProxy(wanted), name
    if communicator.presence.interfaces(target_of(whole)):
        return DynamicProxy(whole), ""
    raise communicator.presence.explain_absence(target_of(wanted))


def find_operation(
    communicator: Communicator, text: str, *, streamed: bool = False
) -> tuple[DynamicProxy, str]:
    """Return the servant and the operation that `Servant.operation` names.

    Where a stream is wanted, the servant's name is enough if it has only one. Raises NaoError, with the known
    operations, when the servant has no such operation, and the exceptions of a call when it is offline.
    """
    proxy, name = split(communicator, text)
    choices = [each for each in proxy.interface_operations.values() if each.streamed or not streamed]
    there_is = _examples(proxy, choices)
    if name and (operation_of(proxy, name, choices).streamed or not streamed):
        return proxy, name
    if streamed and not choices:
        raise NaoError(f"{proxy.identity} has no streams, it can only be called")
    if name:
        raise NaoError(f"{proxy.identity}.{name} is not a stream, it can only be called; there is {there_is}")
    if streamed and len(choices) == 1:
        return proxy, choices[0].name
    raise NaoError(f"name an operation of {proxy.identity}, such as {there_is}")


def operation_of(
    proxy: DynamicProxy, name: str, choices: Sequence[OperationDescription]
) -> OperationDescription:
    """Return an operation of a servant; raises NaoError, with the candidates, when it has none."""
    known = proxy.operations.get(name)
    if known is None:
        near = difflib.get_close_matches(name, [each.name for each in choices], 1, 0.5)
        hint = (
            f"did you mean {proxy.identity}.{near[0]}?" if near else f"there is {_examples(proxy, choices)}"
        )
        raise NaoError(f"{proxy.identity} has no operation {name!r}; {hint}")
    return known


def _is_there(communicator: Communicator, target: Target) -> bool:
    """Wait for a servant, no longer than it may take to be known; return whether it is online."""
    timeout = communicator.settings.timeout if _may_be_linked(communicator) else 0.0
    return communicator.presence.wait_for(target, None, timeout)


def _may_be_linked(communicator: Communicator) -> bool:
    """Return whether there is a link, or may soon be one because an endpoint accepts connections."""
    deadline = time.monotonic() + _NEWS_LIMIT
    while not communicator.presence.linked():
        if time.monotonic() >= deadline:
            connect = communicator.settings.connect
            return not connect or any(listens(endpoint) is not False for endpoint in connect)
        time.sleep(_CHECK_PERIOD)
    return True


def listens(endpoint: str) -> bool | None:
    """Return whether an endpoint accepts connections; None when only a link could show it."""
    place = host_and_port(endpoint)
    if place is None:
        return Path(endpoint.partition("/")[2]).exists()
    if not endpoint.startswith(("tcp/", "tls/", "ws/")):
        return None
    try:
        with socket.create_connection(place, timeout=_CONNECTION):
            return True
    except OSError:
        return False


def _examples(proxy: DynamicProxy, operations: Sequence[OperationDescription]) -> str:
    if not operations:
        return "only ice_ping, ice_isA and ice_ids"
    return few([f"{proxy.identity}.{each.name}" for each in operations], 8)


def loss(communicator: Communicator, found: Iterable[ServantInfo]) -> str:
    """Return since when no command reaches the robot, and why; empty while they do, or it does not say."""
    if not any(info.identity == SAFETY for info in found):
        return ""
    try:
        (state,) = find_servant(communicator, SAFETY).invoke("getSafetyState", ()).values()
    except (ZenohIceError, KeyError, ValueError):
        return ""  # another release, or not for us: a command that comes next says so
    lost, seconds = getattr(state, "lost", ""), getattr(state, "lostFor", 0.0)
    return lost_text(lost, seconds) if lost else ""


def ask_processes(
    communicator: Communicator, found: Iterable[ServantInfo]
) -> dict[str, ProcessStatus | ZenohIceError]:
    """Return the status of each serving process, or the reason of the failure, by the id of its session."""
    ids = sorted({info.server for info in found})
    patience = communicator.settings.timeout
    limit = min(max(_ANSWER_LIMIT, _ANSWER_SHARE * patience), patience)

    def ask(server: str) -> ProcessStatus | ZenohIceError:
        try:
            return communicator.processStatus(server, timeout=limit)
        except ZenohIceError as error:
            return error

    with ThreadPoolExecutor(max_workers=_AT_ONCE) as pool:
        return dict(zip(ids, pool.map(ask, ids), strict=True))


def process_name(status: ProcessStatus | ZenohIceError | None, server: str) -> str:
    """Return program and number of a process, or the beginning of its session's id."""
    if isinstance(status, ProcessStatus):
        return printable(f"{status.program} {status.pid}")
    return f"? ({server[:8]})"
