"""The words that the writer and the reader of SCXML share: namespaces, names, times, data."""

from __future__ import annotations

import ast
import keyword
import re
import warnings
from decimal import Decimal
from typing import Final

from ..code.text import parse_python
from ..formats.writer import is_writable

__all__ = [
    "NEVER",
    "OWN_NAMESPACE",
    "OWN_PREFIX",
    "SCXML_NAMESPACE",
    "decode_event",
    "delay_text",
    "encode_event",
    "expression_of",
    "identifier",
    "is_name",
    "milliseconds_text",
]

SCXML_NAMESPACE: Final = "http://www.w3.org/2005/07/scxml"
"""The namespace of the W3C's recommendation."""

OWN_NAMESPACE: Final = "urn:visualhfsm:document"
"""The namespace of the native document in a file that was written here, and of what refers to it."""

OWN_PREFIX: Final = "hfsm"
"""The prefix of that namespace in written files."""

NEVER: Final = "False"
"""The condition in SCXML of a transition whose own condition SCXML cannot hold."""

_START: Final = (
    "A-Z_a-z\u00c0-\u00d6\u00d8-\u00f6\u00f8-\u02ff\u0370-\u037d\u037f-\u1fff\u200c\u200d\u2070-\u218f"
    "\u2c00-\u2fef\u3001-\ud7ff\uf900-\ufdcf\ufdf0-\ufffd\U00010000-\U000effff"
)
_NOT_IN_IDENTIFIERS: Final = re.compile(f"[^{_START}0-9\u00b7-]+")
_NOT_AT_START: Final = re.compile(f"[^{_START}]")
_NOT_IN_EVENTS: Final = re.compile(rf"[^{_START}0-9.-]|\A\.|\.\Z|(?<=\.)\.|_(?=x[0-9A-F]{{4,6}}_)")
_ENCODED: Final = re.compile(r"_x([0-9A-F]{4,6})_")
_RESERVED: Final = re.compile(r"(?=(?:done|error|timeout)(?:\.|\Z))[det]")
_TIME: Final = re.compile(r"(\d{0,12}(?:\.\d{1,9})?)(ms|s|m|h|d)?")
_NUMBER: Final = re.compile(r"\d{1,12}(?:\.\d{1,9})?")
_MILLISECONDS: Final = {"ms": 1, "s": 1000, "m": 60_000, "h": 3_600_000, "d": 86_400_000}


def identifier(text: str, default: str) -> str:
    """Return an id made from a text; it has no full stop, so that no event matches another's."""
    found = _NOT_IN_IDENTIFIERS.sub("_", text.strip()).strip("_") if text.strip() else default
    found = found or default
    return f"_{found}" if _NOT_AT_START.match(found) else found


def encode_event(name: str, *, dots: bool = False) -> str:
    """Return the name of an event as SCXML allows it: a blank is `_x0020_`.

    With `dots` full stops are encoded, too. No event gets a name that SCXML reserves, as `done` and `error`.
    """
    encoded = _RESERVED.sub(_encoded_first, _NOT_IN_EVENTS.sub(_encoded_first, name), count=1)
    return encoded.replace(".", "_x002E_") if dots else encoded


def decode_event(name: str) -> str:
    """Return the name of an event that was encoded."""
    return _ENCODED.sub(_decoded, name)


def delay_text(milliseconds: str) -> str | None:
    """Return a number of milliseconds as the delay of an event, or None when the text is no such number."""
    text = milliseconds.strip()
    if not _NUMBER.fullmatch(text) or not text.isascii():
        return None
    number = Decimal(text)
    if number and number % 1000 == 0:
        return f"{_plain(number / 1000)}s"
    return f"{_plain(number)}ms"


def milliseconds_text(delay: str) -> tuple[str, bool] | None:
    """Return the milliseconds of a delay, and whether it has a unit; None when it is no time."""
    match = _TIME.fullmatch(delay.strip())
    if match is None or not match[1] or not delay.isascii():
        return None
    return _plain(Decimal(match[1]) * _MILLISECONDS[match[2] or "ms"]), match[2] is not None


def is_name(text: str) -> bool:
    """Return whether a text can be the name of a variable and an id of SCXML."""
    return text.isascii() and text.isidentifier() and not keyword.iskeyword(text)


def expression_of(code: str) -> ast.Expression | None:
    """Return the tree of an expression of Python, or None when the text is none."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return parse_python(code.strip(), mode="eval")
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return None


def _plain(number: Decimal) -> str:
    text = f"{number:f}"
    return text.rstrip("0").rstrip(".") if "." in text else text


def _encoded_first(match: re.Match[str]) -> str:
    return f"_x{ord(match[0][0]):04X}_{match[0][1:]}"


def _decoded(match: re.Match[str]) -> str:
    code = int(match[1], 16)
    return chr(code) if code <= 0x10FFFF and is_writable(chr(code)) else match[0]
