"""Where browsers find the page: below a path, under the names of a machine, perhaps behind a reverse proxy.

A proxy may pass on the path below which it serves the page, or take it off: both are understood, as the page
itself names everything relative to its own address.
"""

from __future__ import annotations

import ipaddress
import re
from collections.abc import Iterable
from typing import Final
from urllib.parse import unquote

from starlette.datastructures import Headers
from starlette.types import Scope

from codegen.messages import Message
from visualhfsm._base.errors import VisualHfsmError

_HOST: Final = re.compile(r"(?P<name>[a-z0-9._-]{1,253}|\[[0-9a-f:.]{2,45}\])(?::[0-9]{1,5})?", re.IGNORECASE)
"""The only allowed content of `Host`, which is also part of the policy of the page."""

_PATH: Final = re.compile(r"/(?:(?:[A-Za-z0-9._~@+-]|%[0-9A-Fa-f]{2})+/)*")
_LONGEST_PATH: Final = 1000  # characters; browsers refuse cookies with a longer one
_OWN: Final = frozenset({"camera", "plugins", "poses", "resume", "static", "stop", "view", "ws"})
"""The names at the top of the page: a path that begins so could be one with the prefix, or without it."""

_FORWARDED_HOST: Final = "x-forwarded-host"
_FORWARDED_SCHEME: Final = "x-forwarded-proto"


class BasePathError(VisualHfsmError):
    """The page cannot be served below a path."""

    def __init__(self, path: str, reason: str) -> None:
        super().__init__(
            Message("the page cannot be served below {path!r}: {reason}", path=path[:80], reason=reason)
        )


def base_path(path: str) -> str:
    """Return a path with a slash at both ends, in the form of an address. Raises BasePathError."""
    wanted = f"/{path.strip('/')}/" if path.strip("/") else "/"
    segments = unquote(wanted).split("/")
    if not _PATH.fullmatch(wanted) or len(wanted) > _LONGEST_PATH:
        raise BasePathError(
            path, "write it as in an address, such as /user/ana/visualhfsm/, with %20 for a space"
        )
    if {".", ".."} & {*segments}:
        raise BasePathError(path, "browsers take . and .. out of an address")
    if segments[1] in _OWN:
        raise BasePathError(path, f"the page itself has /{segments[1]}; put another folder before it")
    return wanted


class Site:
    """Where the page is served: below `path`, and under `hosts` besides the names of loopback.

    With None for `hosts` the page has any name. `trusts_proxy` believes the headers `X-Forwarded-Host` and
    `X-Forwarded-Proto`: of several values that of the nearest proxy, the last one. Raises BasePathError.
    """

    def __init__(
        self, path: str = "/", hosts: Iterable[str] | None = (), *, trusts_proxy: bool = False
    ) -> None:
        self.path: Final = base_path(path)
        self._decoded: Final = unquote(self.path)
        self._hosts: Final = None if hosts is None else frozenset(host.lower() for host in hosts)
        self._trusts_proxy: Final = trusts_proxy

    def as_asked(self, scope: Scope) -> Scope:
        """Return a request with host and scheme as the browser wrote them, and with the path below the page.

        The path is empty where only the slash at the end of the page's own is missing.
        """
        path: str = scope["path"]
        if path == self._decoded[:-1]:
            path = ""
        elif path.startswith(self._decoded):
            path = path[len(self._decoded) - 1 :]
        return {**scope, "path": path, **(self._forwarded(scope) if self._trusts_proxy else {})}

    def is_ours(self, host: str) -> bool:
        """Whether a header `Host` may name the machine that serves the page."""
        match = _HOST.fullmatch(host)
        if match is None:
            return False
        name = match["name"].lower().strip("[]")
        if name == "localhost" or self._hosts is None or name in self._hosts:
            return True
        try:
            return ipaddress.ip_address(name).is_loopback
        except ValueError:
            return False

    def _forwarded(self, scope: Scope) -> Scope:
        headers = Headers(scope=scope)
        changes: Scope = {}
        if host := _last(headers, _FORWARDED_HOST):
            others = [(name, value) for name, value in scope["headers"] if name != b"host"]
            changes["headers"] = [(b"host", host.encode("latin-1")), *others]
        if (scheme := _last(headers, _FORWARDED_SCHEME)) in {"http", "https"}:
            changes["scheme"] = scheme if scope["type"] == "http" else scheme.replace("http", "ws")
        return changes


def _last(headers: Headers, name: str) -> str:
    return ",".join(headers.getlist(name)).rpartition(",")[2].strip()
