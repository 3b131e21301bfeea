"""Complete names in the shell from what is alive."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, MutableMapping
from typing import TYPE_CHECKING, Final

import typer

if TYPE_CHECKING:
    from deploy.nao.definitions import OperationSignature
    from deploy.nao.dynamic import DynamicProxy
    from zenoh_ice import Communicator

__all__ = ["complete_call", "complete_camera", "complete_servant", "complete_stream", "join_words"]

_CALL_LIMIT: Final = 0.5
"""Seconds for which one servant may let a person wait who pressed the tab key."""

_BREAK: Final = re.compile("[:=]+")


def join_words(environment: MutableMapping[str, str]) -> None:
    """Make one word again of what bash, asking for completions, takes for several: `tcp/127.0.0.1:7447`."""
    words = environment.get("COMP_WORDS", "").split("\n")
    try:
        at = current = int(environment.get("COMP_CWORD", ""))
    except ValueError:
        return
    joined: list[str] = []
    for index, word in enumerate(words):
        if index and (_BREAK.fullmatch(word) or _BREAK.fullmatch(words[index - 1])):
            joined[-1] += word
            current -= index <= at
        else:
            joined.append(word)
    environment.update(COMP_WORDS="\n".join(joined), COMP_CWORD=str(current))


def complete_servant(context: typer.Context, incomplete: str) -> list[str]:
    """Return the servants whose names begin like this."""
    return _ask(context, lambda communicator: _identities(communicator, incomplete))


def complete_call(context: typer.Context, incomplete: str) -> list[str]:
    """Return what can be called: servants, and of a single one its operations."""

    def names(communicator: Communicator) -> list[str]:
        found = _identities(communicator, incomplete)
        exact = [each for each in _identities(communicator) if incomplete.startswith(f"{each}.")]
        if len(found) > 1:
            return [f"{each}." for each in found]
        return [name for each in found or exact for name in _operations(communicator, each)]

    return [name for name in _ask(context, names) if name.startswith(incomplete)]


def complete_stream(context: typer.Context, incomplete: str) -> list[str]:
    """Return what can be watched."""

    def names(communicator: Communicator) -> list[str]:
        return _of_kinds(
            communicator,
            lambda identity, proxy: _named(identity, proxy.interface_operations.values(), streamed=True),
        )

    return [name for name in _ask(context, names) if name.startswith(incomplete)]


def complete_camera(context: typer.Context, incomplete: str) -> list[str]:
    """Return what gives images."""
    from deploy.nao.images import image_operation

    def names(communicator: Communicator) -> list[str]:
        return _of_kinds(communicator, lambda identity, proxy: [identity] if image_operation(proxy) else [])

    return [name for name in _ask(context, names) if name.startswith(incomplete)]


def _ask(context: typer.Context, names: Callable[[Communicator], list[str]]) -> list[str]:
    """Return names that a function finds out; none when nothing can be found out."""
    import logging

    from deploy.nao.errors import NaoError
    from zenoh_ice import ZenohIceError, initialize, load_settings

    logging.disable()  # what goes wrong would be written into the line that is being typed
    options = context.params
    flags = {name: options.get(name) or None for name in ("realm", "connect", "listen")}
    try:
        settings = load_settings(options.get("config"), flags, defaults={"clock": "wall"})
        with initialize(settings, timeout=min(settings.timeout, _CALL_LIMIT)) as communicator:
            return sorted(names(communicator))
    except (ZenohIceError, NaoError):
        return []


def _identities(communicator: Communicator, beginning: str = "") -> list[str]:
    from deploy.nao.connection import servants

    found = {info.identity for info in servants(communicator) if not info.facet}
    return [each for each in found if each.startswith(beginning)]


def _operations(communicator: Communicator, identity: str) -> list[str]:
    from deploy.nao.connection import find_servant

    return _named(identity, find_servant(communicator, identity).interface_operations.values())


def _of_kinds(communicator: Communicator, names: Callable[[str, DynamicProxy], list[str]]) -> list[str]:
    """Return names of all servants; of those that have the same interfaces only one is asked for them."""
    from deploy.nao.connection import find_servant, servants

    kinds: dict[tuple[str, ...], list[str]] = {}
    for info in servants(communicator):
        if not info.facet:
            kinds.setdefault((*info.interfaces, *info.interfaces.values()), []).append(info.identity)
    found: set[str] = set()
    for identities in kinds.values():
        proxy = find_servant(communicator, identities[0])
        found.update(name for identity in identities for name in names(identity, proxy))
    return list(found)


def _named(identity: str, operations: Iterable[OperationSignature], *, streamed: bool = False) -> list[str]:
    return [f"{identity}.{each.name}" for each in operations if each.streamed or not streamed]
