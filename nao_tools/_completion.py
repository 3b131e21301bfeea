"""Complete names of running servants in the shell."""

from __future__ import annotations

import re
from collections.abc import Callable, MutableMapping
from typing import TYPE_CHECKING, Final

import typer

if TYPE_CHECKING:
    from nao_tools._dynamic import DynamicProxy
    from zenoh_ice import Communicator

_CALL_LIMIT: Final = 0.5  # s that one servant may delay a completion
_BREAK: Final = re.compile("[:=]+")


def join_words(environment: MutableMapping[str, str]) -> None:
    """Join the parts into which bash splits a word such as `tcp/127.0.0.1:7447` when it completes."""
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
    return _ask(context, incomplete, _identities)


def complete_call(context: typer.Context, incomplete: str) -> list[str]:
    """Return the servants that can be called, or the operations of a single one."""

    def names(communicator: Communicator) -> list[str]:
        from nao_tools._connection import find_servant

        identities = _identities(communicator)
        found = [each for each in identities if each.startswith(incomplete)]
        if len(found) > 1:
            return [f"{each}." for each in found]
        return [
            f"{each}.{name}"
            for each in found or [each for each in identities if incomplete.startswith(f"{each}.")]
            for name in find_servant(communicator, each).interface_operations
        ]

    return _ask(context, incomplete, names)


def complete_stream(context: typer.Context, incomplete: str) -> list[str]:
    """Return the streams that can be watched."""

    def streams(identity: str, proxy: DynamicProxy) -> list[str]:
        return [f"{identity}.{each.name}" for each in proxy.interface_operations.values() if each.streamed]

    return _ask(context, incomplete, lambda communicator: _by_kind(communicator, streams))


def complete_camera(context: typer.Context, incomplete: str) -> list[str]:
    """Return the servants that provide images."""
    from nao_tools._images import image_operation

    def cameras(identity: str, proxy: DynamicProxy) -> list[str]:
        return [identity] if image_operation(proxy) else []

    return _ask(context, incomplete, lambda communicator: _by_kind(communicator, cameras))


def _ask(context: typer.Context, incomplete: str, names: Callable[[Communicator], list[str]]) -> list[str]:
    """Return the names that begin like this; none if the realm cannot be asked."""
    import logging

    from zenoh_ice import ZenohIceError, initialize, load_settings

    logging.disable()  # messages would appear in the line that is being typed
    options = context.params
    flags = {name: options.get(name) or None for name in ("realm", "connect", "listen")}
    try:
        settings = load_settings(options.get("config"), flags, defaults={"clock": "wall"})
        with initialize(settings, timeout=min(settings.timeout, _CALL_LIMIT)) as communicator:
            return sorted({name for name in names(communicator) if name.startswith(incomplete)})
    except ZenohIceError:
        return []


def _identities(communicator: Communicator) -> list[str]:
    from nao_tools._connection import servants

    return sorted({info.identity for info in servants(communicator)})


def _by_kind(communicator: Communicator, names: Callable[[str, DynamicProxy], list[str]]) -> list[str]:
    """Return names of all servants; only one per set of interfaces is asked."""
    from nao_tools._connection import by_kind, find_servant, servants

    found: list[str] = []
    for kind in by_kind(servants(communicator)):
        proxy = find_servant(communicator, kind[0].identity)
        found += [name for info in kind for name in names(info.identity, proxy)]
    return found
