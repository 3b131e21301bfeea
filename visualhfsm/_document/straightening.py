"""Straighten code that comes from a word processor or a PDF: its quotes, hyphens and spaces."""

from __future__ import annotations

import re
import textwrap
from contextlib import suppress
from functools import cache
from typing import Final

from codegen.parsing import parse_python

_DOUBLE: Final = '"“”„‟«»″'
_SINGLE: Final = "'‘’‚‛‹›′´`"
_PLAIN: Final = str.maketrans(
    {
        **dict.fromkeys(_DOUBLE, '"'),
        **dict.fromkeys(_SINGLE, "'"),
        **dict.fromkeys("‐‑‒–—―−", "-"),
        **dict.fromkeys(map(chr, (0xA0, *range(0x2000, 0x200B), 0x202F, 0x205F, 0x3000)), " "),
        **dict.fromkeys(map(chr, (0xAD, *range(0x200B, 0x2010), 0x2060, 0xFEFF)), ""),
        **dict.fromkeys("\u2028\u2029", "\n"),
        "…": "...",
    }
)
_KINDS: Final = (('"', _DOUBLE, "“„«", "”»"), ("'", _SINGLE, "‘‚‹", "’›"))  # straight, all, first, last
_IN_BRACES: Final = re.compile(r"(?<!\{)\{(?!\{)[^{}:!]+")


def straightened(code: str) -> str:
    """Return code with straight quotes, hyphens and spaces; contents of strings and comments stay.

    Any quote may end a string that a straight one begins, if the code is only valid then.
    """
    first, other = (_pieces(keeps_straight=keeps).sub(_straight, code) for keeps in (True, False))
    for written in (first, other):
        with suppress(SyntaxError, ValueError, MemoryError, RecursionError):
            parse_python(textwrap.dedent(written).strip())
            return written
    return first


@cache
def _pieces(*, keeps_straight: bool) -> re.Pattern[str]:
    """Return a pattern for comments, strings and what is between them; surer ends of strings come first."""
    several, inside, found = r"(?:\\.|[^\\])*?", r"(?:\\.|\{[^{}\n]*\}|[^\\\n%s])*?", list[str]()
    for plain, quotes, begin, end in _KINDS:
        if keeps_straight:
            found += [rf"{plain}{{3}}{several}{plain}{{3}}", rf"{plain}(?:\\.|[^\\\n{plain}])*{plain}"]
        some = f"[{quotes}]{inside % ''}[{quotes}]"
        found += [f"[{quotes}]{{3}}{several}[{quotes}]{{3}}", rf"[{begin}]{inside % begin}[{end}](?!\w)"]
        found += [rf"{some}(?![\w{plain}{end}])", some]
    strings = rf"(?P<prefix>\b(?i:rb|br|rf|fr|[rbuf]))?(?P<string>{'|'.join(found)})"
    return re.compile(rf"#[^\n]*|{strings}|\w+|.", re.DOTALL)


def _straight(found: re.Match[str]) -> str:
    prefix, string = found["prefix"] or "", found["string"]
    if not string:
        return found[0] if found[0].startswith("#") else found[0].translate(_PLAIN)
    plain, other = ('"', "'") if string[0] in _DOUBLE else ("'", '"')
    count = 3 if len(string) > 5 and string[:3].translate(_PLAIN) == plain * 3 else 1
    content = string[count:-count]
    if "f" in prefix.lower():  # until Python 3.12 its expressions have the other quotes
        content = _IN_BRACES.sub(lambda each: straightened(each[0]).replace(plain, other), content)
    if count == 1:
        content = re.sub(rf"(?<!\\){plain}", rf"\\{plain}", content)
    return f"{prefix}{plain * count}{content}{plain * count}"
