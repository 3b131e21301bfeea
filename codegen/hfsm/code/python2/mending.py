"""Find the Python 2 in a piece of code, and mend it where nothing else is wrong."""

from __future__ import annotations

import textwrap
import warnings
from bisect import bisect_right
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Final

from ..trees import parse_python
from .matches import Match, Rule
from .name_rules import bound_names, has_keys, modules, names
from .statement_rules import excepts, execs, prints, raises
from .word_rules import backquotes, numbers, operators, strings, tabs
from .words import words_of

__all__ = ["Finding", "find_divisions", "find_python2", "is_python", "mend", "names_in"]

_MAX_ROUNDS: Final = 50
"""How deep what a rule finds may be nested in what it finds."""


_RULES: Final[tuple[Rule, ...]] = (
    *(operators, numbers, strings, backquotes),
    *(excepts, raises, execs, prints),
    *(has_keys, modules, tabs),
)


@dataclass(frozen=True, slots=True, order=True)
class Finding:
    """Something of Python 2; `line` and `column` count from 1 in the code."""

    line: int
    column: int
    message: str


def find_python2(code: str, bound: frozenset[str] = frozenset()) -> tuple[Finding, ...]:
    """Return what in a piece of code is Python 2, in the order of its lines.

    `bound` are names to which other code gives a meaning, such as `long`.

    Code that is no Python of any age, such as C++, has nothing of the kind: an empty result does not mean
    that the code is valid.
    """
    words = words_of(code)
    found = [match for rule in _rules(bound) for match in rule(code, words)]
    return _findings(code, ((match.start, match.message) for match in found))


def find_divisions(code: str) -> tuple[Finding, ...]:
    """Return where code divides with `/`, which in Python 2 rounds whole numbers down."""
    message = "`/` rounds whole numbers down in Python 2, and does not in Python 3"
    return _findings(code, ((word.start, message) for word in words_of(code) if word.text in ("/", "/=")))


def mend(code: str, bound: frozenset[str] = frozenset()) -> str | None:
    """Return a piece of code as Python 3, or None when that takes more than the mending of Python 2.

    What has nothing of Python 2 in it comes back as it is. `bound` is that of `find_python2`.
    """
    mended = code
    words = words_of(code)
    for rule in _rules(bound):
        for _ in range(_MAX_ROUNDS):
            matches = list(rule(mended, words))
            if any(not match.edits for match in matches):
                return None
            if not matches:
                break
            mended = _edited(mended, matches)
            words = words_of(mended)
        else:
            return None
    return mended if is_python(mended) else None


def is_python(code: str) -> bool:
    """Return whether a piece of code is valid Python 3: statements, or an expression that may span lines."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for source in (textwrap.dedent(code).strip("\r\n"), f"(\n{code}\n)"):
            try:
                parse_python(source)
            except (SyntaxError, ValueError, RecursionError, MemoryError):
                continue
            return True
    return False


def _rules(bound: frozenset[str]) -> tuple[Rule, ...]:
    return (*_RULES, partial(names, bound=bound))


def names_in(code: str) -> frozenset[str]:
    """Return the names to which a piece of code gives a meaning of its own."""
    return bound_names(words_of(code))


def _edited(code: str, matches: Sequence[Match]) -> str:
    """Return the code with all edits that are not inside one another, so that those come next."""
    pieces: list[str] = []
    start = len(code)
    for match in sorted(matches, key=lambda match: match.start, reverse=True):
        edits = sorted(match.edits, key=lambda edit: edit.start, reverse=True)
        if edits[0].end > start:
            continue
        for edit in edits:
            pieces += (code[edit.end : start], edit.text)
            start = edit.start
    pieces.append(code[:start])
    return "".join(reversed(pieces))


def _findings(code: str, found: Iterable[tuple[int, str]]) -> tuple[Finding, ...]:
    """Return what was found at some offsets with lines and columns, each thing once."""
    starts = [0, *(index + 1 for index, character in enumerate(code) if character == "\n")]
    findings = set()
    for offset, message in found:
        line = bisect_right(starts, offset)
        findings.add(Finding(line, offset - starts[line - 1] + 1, message))
    return tuple(sorted(findings))
