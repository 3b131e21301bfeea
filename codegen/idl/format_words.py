"""Read a Slice file as the formatter sees it: words, comments and directives, and where lines break."""

from __future__ import annotations

import re
import textwrap
from dataclasses import dataclass

from .lexer import Kind, Source

DIRECTIVE = re.compile(r"#\s*(?P<name>[a-z]*)[ \t]*(?P<rest>.*)", re.DOTALL)
"""A preprocessor directive: its name, and what follows that."""


@dataclass(slots=True)
class Word:
    """A token, a comment or a directive, with the number of line breaks before it."""

    kind: Kind
    text: str
    newlines: int


def words_of(source: Source) -> list[Word]:
    """Return everything in a file but its spaces."""
    words: list[Word] = []
    newlines = 0
    for piece in source.pieces:
        if piece.kind is Kind.SPACE:
            newlines = piece.text.count("\n")
        else:
            words.append(Word(piece.kind, piece.text, newlines))
            newlines = 0
    return words


def is_inline(word: Word) -> bool:
    """Return whether code can follow on the line of a comment."""
    return word.text.startswith("/*") and "\n" not in word.text


def comment_lines(word: Word) -> list[str]:
    """Return the lines of a comment, the first at the margin and the others below it.

    Lines that begin with a star have it below the first; others keep their indentation among themselves.
    """
    first, *others = (line.expandtabs(4).rstrip() for line in word.text.split("\n"))
    if all(line.lstrip().startswith("*") for line in others if line):
        return [first, *(f" {line.lstrip()}" if line else "" for line in others)]
    closing = [" */"] if others[-1].strip() == "*/" else []
    inner = textwrap.dedent("\n".join(others[: len(others) - len(closing)])).split("\n")
    return [first, *(f"   {line}" if line else "" for line in inner), *closing]


def canonical_directive(text: str) -> str:
    """Return a directive with one space behind its name and none before."""
    match = DIRECTIVE.match(text)
    if match is None or not match["name"]:
        return text
    return f"#{match['name']} {match['rest']}".rstrip()
