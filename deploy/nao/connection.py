"""Find what a command is about: a servant by its name, an operation of it by `Servant.operation`."""

from __future__ import annotations

import difflib
import time
from typing import Final

from deploy.nao.definitions import OperationSignature
from deploy.nao.dynamic import DynamicProxy
from deploy.nao.errors import UsageError
from deploy.nao.ports import listens
from zenoh_ice import Communicator, ObjectPrx, ServantInfo
from zenoh_ice.identity import Target

__all__ = ["find_operation", "find_servant", "operation_of", "operations_of", "proxy_of", "servants", "split"]

_QUIET: Final = 0.1
"""Seconds without news after which all are known that a link tells of; they come within milliseconds."""
_LONGEST_QUIET: Final = 0.5
"""Seconds after which a link that tells of nobody has nobody to tell of."""
_LONGEST: Final = 1.0
"""Seconds after which a link is not waited for any longer."""
_LOOK: Final = 0.02


def proxy_of(communicator: Communicator, identity: str, facet: str = "") -> ObjectPrx:
    """Return an untyped proxy; raises ConfigurationException for a text that is no identity."""
    return communicator.stringToProxy(f"{identity} -f {facet}" if facet else identity)


def find_servant(communicator: Communicator, identity: str, facet: str = "") -> DynamicProxy:
    """Return a proxy of a servant that is there; raises what a call raises."""
    proxy = proxy_of(communicator, identity, facet)
    target = _target(proxy)
    if not _is_there(communicator, target):
        raise communicator.presence.explain_absence(target)
    return DynamicProxy(proxy, facet)


def servants(communicator: Communicator) -> list[ServantInfo]:
    """Return the servants of the realm once all are known; none when nobody answers."""
    known: list[ServantInfo] = []
    started = changed = time.monotonic()
    longest = _LONGEST if _may_be_linked(communicator) else 0.0
    while (now := time.monotonic()) < started + longest:
        found = communicator.servants()
        if found != known:
            known, changed = found, now
        elif communicator.presence.linked() and now - changed >= (_QUIET if known else _LONGEST_QUIET):
            break
        time.sleep(_LOOK)
    return known


def _is_there(communicator: Communicator, target: Target) -> bool:
    """Wait for a servant, not longer than somebody may tell of it; return whether it is there."""
    timeout = communicator.settings.timeout if _may_be_linked(communicator) else 0.0
    return communicator.presence.wait_for(target, None, timeout)


def _may_be_linked(communicator: Communicator) -> bool:
    """Return whether there is a link, or one may come: soon it is looked whether anything listens at all."""
    deadline = time.monotonic() + _QUIET
    while not communicator.presence.linked():
        if time.monotonic() >= deadline:
            connect = communicator.settings.connect
            return not connect or any(listens(endpoint) is not False for endpoint in connect)
        time.sleep(_LOOK)
    return True


def find_operation(
    communicator: Communicator, text: str, facet: str = "", *, streamed: bool = False
) -> tuple[DynamicProxy, str]:
    """Return the servant and the operation that `Servant.operation` names.

    Where a stream is wanted, the servant alone will do if it has only one. Raises UsageError, with what there
    is, when the servant has no such operation, and what a call raises when it is not there.
    """
    identity, name = split(communicator, text, facet)
    proxy = find_servant(communicator, identity, facet)
    choices = [each for each in proxy.interface_operations.values() if each.streamed or not streamed]
    if not name:
        if streamed and len(choices) == 1:
            return proxy, choices[0].name
        raise UsageError(
            f"{identity} has no streams, it can only be called"
            if streamed and not choices
            else f"name an operation of {identity}, such as {_examples(identity, choices)}"
        )
    known = operation_of(proxy, identity, name, choices)
    if streamed and not known.streamed:
        raise UsageError(
            f"{identity}.{name} is no stream, it can only be called; "
            + (f"there is {_examples(identity, choices)}" if choices else f"{identity} has no streams")
        )
    return proxy, name


def operation_of(
    proxy: DynamicProxy, identity: str, name: str, choices: list[OperationSignature]
) -> OperationSignature:
    """Return an operation of a servant; raises UsageError, with what it could be, when it has none."""
    known = proxy.definitions.operations.get(name)
    if known is None:
        near = difflib.get_close_matches(name, [each.name for each in choices], 1, 0.5)
        hint = f"did you mean {identity}.{near[0]}?" if near else f"there is {_examples(identity, choices)}"
        raise UsageError(f"{identity} has no operation {name!r}; {hint}")
    return known


def operations_of(proxy: DynamicProxy) -> list[OperationSignature]:
    """Return the operations of a servant's own interface and of those that it extends, sorted."""
    return sorted(proxy.interface_operations.values(), key=lambda each: (each.interface, each.name))


def split(communicator: Communicator, text: str, facet: str = "") -> tuple[str, str]:
    """Return servant and operation of `Servant.operation`, where the servant's name may have dots, too.

    The operation is empty when the text names a servant alone. Raises what a call raises when there is
    neither.
    """
    identity, dot, name = text.rpartition(".")
    if not dot:
        return text, ""
    # Only the servants that are there tell whether `Hfsm.follow_ball` is one, or one with its operation.
    wanted, whole = (_target(proxy_of(communicator, each, facet)) for each in (identity, text))
    if _is_there(communicator, wanted):
        return identity, name
    if communicator.presence.interfaces(whole):
        return text, ""
    raise communicator.presence.explain_absence(wanted)


def _target(proxy: ObjectPrx) -> Target:
    return Target(proxy.ice_getRealm(), proxy.ice_getIdentity(), proxy.ice_getFacet())


def _examples(identity: str, operations: list[OperationSignature]) -> str:
    if not operations:
        return "ice_ping and its kin alone"
    names = [f"{identity}.{each.name}" for each in operations]
    return ", ".join(names[:8]) + (f" and {len(names) - 8} more" if len(names) > 8 else "")
