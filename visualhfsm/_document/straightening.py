"""Straighten code that comes from a word processor or a PDF: its quotes, hyphens and spaces."""

from __future__ import annotations

import re
import textwrap
from typing import Final

from codegen.parsing import parse_python

_DOUBLE: Final = '"“”„‟«»″'
_SINGLE: Final = "'‘’‚‛‹›′´`"
_QUOTES: Final = ((_DOUBLE, "“„«", "”»", '"', "'"), (_SINGLE, "‘‚‹", "’›", "'", '"'))
"""For each kind: all quotes, those that begin and that end a string, the straight one, and the other's."""
_PLAIN: Final = str.maketrans(
    {
        **dict.fromkeys("‐‑‒–—―−", "-"),
        **dict.fromkeys(map(chr, (0xA0, *range(0x2000, 0x200B), 0x202F, 0x205F, 0x3000)), " "),
        **dict.fromkeys(map(chr, (0xAD, *range(0x200B, 0x2010), 0x2060, 0xFEFF)), ""),
        **dict.fromkeys("\u2028\u2029", "\n"),
        "…": "...",
    }
)
_COMMENT_OR_STRING: Final = re.compile(
    r"#.*|(?P<prefix>\b(?i:rb|br|rf|fr|[rbuf]))?"
    rf"(?P<quote>[{_DOUBLE}]{{3}}|[{_SINGLE}]{{3}}|[{_DOUBLE}{_SINGLE}])"
)
_IN_BRACES: Final = re.compile(r"(?<!\{)\{(?!\{)[^{}:!]+")


def straightened(code: str) -> str:
    """Return code with straight quotes, hyphens and spaces; contents of strings and comments stay.

    Any quote may end a string that a straight one begins, if the code is only valid then.
    """
    written = _straightened(code, keeps_strings=True)
    other = written if _is_python(written) else _straightened(code, keeps_strings=False)
    return other if _is_python(other) else written


def _straightened(code: str, *, keeps_strings: bool) -> str:
    done, at = "", 0
    while found := _COMMENT_OR_STRING.search(code, at):
        done += code[at : found.start()].translate(_PLAIN)
        at = found.end()
        prefix, quote = found["prefix"] or "", found["quote"]
        if quote is None:
            done += found[0]
            continue
        family, begin, end, plain, other = _QUOTES[quote[0] in _SINGLE]
        count, line = f"{{{len(quote)}}}", "" if len(quote) > 1 else "\n"
        braces = r"|\{[^{}\n]*\}" if "f" in prefix.lower() else ""
        ends = [
            (quote, line)
            if keeps_strings and quote[0] == plain
            else (f"[{end}]{count}(?!\\w)", line + begin),
            (rf"[{family}]{count}(?![\w{plain}{end}])", line),
            (f"[{family}]{count}", line),
        ]
        patterns = (rf"((?:\\.{braces}|[^\\{outside}])*?){closing}" for closing, outside in ends)
        matches = (re.compile(each).match(code, at) for each in patterns)
        match = next(filter(None, matches), None)
        if match is None:
            done += prefix + plain * len(quote)
            continue
        at, content = match.end(), match[1]
        if braces:
            content = _in_braces(content, plain, other)
        elif len(quote) == 1 and re.search(unescaped := rf"(?<!\\){plain}", content):
            if other in content:
                content = re.sub(unescaped, rf"\\{plain}", content)
            else:
                plain = other
        done += f"{prefix}{plain * len(quote)}{content}{plain * len(quote)}"
    return done + code[at:].translate(_PLAIN)


def _in_braces(content: str, plain: str, other: str) -> str:
    """Straighten the expressions in an f-string; until Python 3.12 they have the other quotes."""
    return _IN_BRACES.sub(
        lambda each: _straightened(each[0], keeps_strings=True).replace(plain, other), content
    )


def _is_python(code: str) -> bool:
    try:
        parse_python(textwrap.dedent(code).strip())
    except (SyntaxError, ValueError, MemoryError, RecursionError):
        return False
    return True
