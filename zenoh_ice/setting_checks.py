"""What values settings may have, and how the environment writes them."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from typing import Any, Final

from .network.endpoints import check_endpoint
from .network.security import Security

__all__ = ["CHECKS", "LONGEST_TIMEOUT", "PARSERS"]

LONGEST_TIMEOUT: Final = 60.0
"""The highest limit of calls, in s: Zenoh keeps a kilobyte for each until it has passed, answered or not."""

MODES: Final = ("peer", "client", "router")
CLOCKS: Final = ("auto", "wall", "sim")
LOG_LEVELS: Final = ("debug", "info", "warning", "error", "critical")

_MAX_SIZE: Final = 1 << 30
# A chunk of a Zenoh key: no separator, no wildcard; '@' splits identity and realm in "Head@otherrealm".
_REALM: Final = re.compile(r"[A-Za-z0-9_.\-]{1,64}")
_TRUE: Final = frozenset({"1", "true", "yes", "on"})
_FALSE: Final = frozenset({"0", "false", "no", "off"})

# What a text of the environment becomes; the checks below judge the result.


def _parse_list(text: str) -> tuple[str, ...]:
    return tuple(item.strip() for item in text.split(",") if item.strip())


def _parse_boolean(text: str) -> bool:
    word = text.strip().lower()
    if word not in _TRUE | _FALSE:
        raise ValueError("write true or false")
    return word in _TRUE


def _parse_float(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise ValueError("write a number") from None


def _parse_integer(text: str) -> int:
    try:
        return int(text)
    except ValueError:
        raise ValueError("write a whole number") from None


PARSERS: Final[Mapping[str, Callable[[str], object]]] = {
    "connect": _parse_list,
    "listen": _parse_list,
    "timeout": _parse_float,
    "lease": _parse_float,
    "shared_memory": _parse_boolean,
    "max_message_size": _parse_integer,
    "max_bulk_size": _parse_integer,
    "dispatch_threads": _parse_integer,
    "security_mutual": _parse_boolean,
}


# Each check returns the value in its final form or raises ValueError with what to do.


def _check_realm(value: object) -> str:
    if not isinstance(value, str) or not _REALM.fullmatch(value):
        raise ValueError("a realm is 1 to 64 letters, digits, '_', '-' or '.', without '/', '*' or '@'")
    return value


def _check_connect(value: object) -> tuple[str, ...]:
    return tuple(check_endpoint(endpoint, any_port=False) for endpoint in _items(value))


def _check_listen(value: object) -> tuple[str, ...]:
    return tuple(check_endpoint(endpoint, any_port=True) for endpoint in _items(value))


def _items(value: object) -> list[object]:
    if not isinstance(value, (list, tuple)):
        raise ValueError("write a list of endpoints")
    return list(value)


def _one_of(words: tuple[str, ...]) -> Callable[[object], str]:
    def check(value: object) -> str:
        if not isinstance(value, str) or value.lower() not in words:
            raise ValueError(f"write one of {', '.join(words)}")
        return value.lower()

    return check


def _seconds(lowest: float, highest: float) -> Callable[[object], float]:
    def check(value: object) -> float:
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise ValueError("write a number of seconds")
        if not lowest <= value <= highest:  # nor is nan
            raise ValueError(f"write a number of seconds from {lowest:g} to {highest:g}")
        return float(value)

    return check


def _whole(lowest: int, highest: int) -> Callable[[object], int]:
    def check(value: object) -> int:
        if isinstance(value, bool) or not isinstance(value, int) or not lowest <= value <= highest:
            raise ValueError(f"write a whole number from {lowest} to {highest}")
        return value

    return check


def _check_boolean(value: object) -> bool:
    if not isinstance(value, bool):
        raise ValueError("write true or false")
    return value


def _check_security(value: object) -> Security:
    if not isinstance(value, Security):
        raise ValueError("write a table, such as [security]")
    return value


CHECKS: Final[Mapping[str, Callable[[Any], object]]] = {
    "realm": _check_realm,
    "connect": _check_connect,
    "listen": _check_listen,
    "mode": _one_of(MODES),
    "clock": _one_of(CLOCKS),
    "timeout": _seconds(0.001, LONGEST_TIMEOUT),
    "lease": _seconds(0.1, LONGEST_TIMEOUT),
    "shared_memory": _check_boolean,
    "log_level": _one_of(LOG_LEVELS),
    "max_message_size": _whole(1, _MAX_SIZE),
    "max_bulk_size": _whole(1, _MAX_SIZE),
    "dispatch_threads": _whole(1, 256),
    "security": _check_security,
}
