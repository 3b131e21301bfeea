"""Read and write the literals of Slice."""

from __future__ import annotations

import math
import re

_MOST_DIGITS = 400

_ESCAPE = re.compile(
    r"\\(?:([0-7]{1,3})|x([0-9a-fA-F]{1,2})|u([0-9a-fA-F]{4})|U([0-9a-fA-F]{8})|(.))", re.DOTALL
)
_SIMPLE_ESCAPES = {
    "n": "\n",
    "t": "\t",
    "v": "\v",
    "b": "\b",
    "r": "\r",
    "f": "\f",
    "a": "\a",
    "?": "?",
    "\\": "\\",
    "'": "'",
    '"': '"',
}


class LiteralError(Exception):
    """A literal has no value; the message says why."""


def parse_integer(text: str) -> int:
    """Return the value of a decimal, octal (`017`) or hexadecimal (`0x1f`) literal. Raises LiteralError."""
    digits = text.lstrip("+-")
    sign = -1 if text.startswith("-") else 1
    if len(digits) > _MOST_DIGITS:
        raise LiteralError(f"the integer has {len(digits)} digits")
    try:
        if digits.startswith("0x"):
            return sign * int(digits, 16)
        return sign * int(digits, 8 if len(digits) > 1 and digits[0] == "0" else 10)
    except ValueError:
        raise LiteralError(f"`{text}` is not an octal number") from None


def parse_float(text: str) -> float:
    """Return the value of a floating-point literal. Raises LiteralError when it is too large or small."""
    digits = text.rstrip("fF")
    value = float(digits)
    if value == 0 and any(digit in "123456789" for digit in re.split("[eE]", digits)[0]):
        raise LiteralError(f"`{text[:20]}` is too small for a floating-point number")
    if math.isinf(value):
        raise LiteralError(f"`{text[:20]}` is too large for a floating-point number")
    return value


def parse_string(text: str) -> tuple[str, list[str]]:
    r"""Return the value of a quoted string literal, and the escapes in it that Slice does not have.

    Escapes of single bytes above 127 (`\xe9`, `\303`) stand for the bytes of UTF-8; bytes that are none
    become U+FFFD. An unknown escape stands for itself. Raises LiteralError for one that is no byte or no
    character.
    """
    body = text[1:-1].replace("\\\n", "")  # a line goes on behind a backslash
    if "\\" not in body:
        return body, []
    unknown: list[str] = []
    parts: list[bytes] = []
    position = 0
    for match in _ESCAPE.finditer(body):
        parts.append(body[position : match.start()].encode("utf-8", "surrogatepass"))
        parts.append(_escaped(match, unknown))
        position = match.end()
    parts.append(body[position:].encode("utf-8", "surrogatepass"))
    return b"".join(parts).decode(errors="replace"), unknown


def _escaped(match: re.Match[str], unknown: list[str]) -> bytes:
    octal, hexadecimal, short, long, simple = match.groups()
    if octal is not None or hexadecimal is not None:
        value = int(octal, 8) if octal is not None else int(hexadecimal, 16)
        if value > 255:
            raise LiteralError(f"the escape `{match.group()}` is larger than a byte")
        return bytes([value])
    if short is not None or long is not None:
        code_point = int(short or long, 16)
        if code_point > 0x10FFFF or 0xD800 <= code_point <= 0xDFFF:
            raise LiteralError(f"the escape `{match.group()}` is no character")
        return chr(code_point).encode()
    if simple in {"x", "u", "U"}:
        raise LiteralError(f"the escape `{match.group()}` needs hexadecimal digits behind it")
    if simple not in _SIMPLE_ESCAPES:
        unknown.append(match.group())
        return match.group().encode("utf-8", "surrogatepass")
    return _SIMPLE_ESCAPES[simple].encode()
