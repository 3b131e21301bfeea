"""Lay out a Slice file in the canonical way: same words, same comments, one set of spaces and lines.

Two spaces a level, a member or an operation a line, an empty line around definitions with a body, `};` behind
a body, at most one empty line in a row. Comments and preprocessor directives stay where they are.
"""

from __future__ import annotations

from collections.abc import Iterable

from .format_layout import Layout
from .format_words import Word, canonical_directive, words_of
from .lexer import Kind, Source

__all__ = ["FormattingError", "format_source"]

# Punctuation that the layout adds or leaves out: `;` behind a body, the last comma of an enumeration.
_OPTIONAL = frozenset({";", ","})


class FormattingError(Exception):
    """The layout would have changed more than spaces; the file is left alone."""


def format_source(source: Source) -> str:
    """Return the text of a file in canonical layout; formatting it again changes nothing.

    The file must be free of syntax errors. Raises FormattingError when words would not survive, which a file
    whose braces stand in several branches of a condition can bring about.
    """
    words = words_of(source)
    text = Layout(words).text()
    if _essence(words) != _essence(words_of(Source(source.path, text))):
        raise FormattingError(f"{source.path}: cannot be laid out without changing it")
    return text


def _essence(words: Iterable[Word]) -> tuple[list[str], list[str]]:
    """Return what a layout must keep: words in order, and comments in order, whatever their spaces."""
    tokens: list[str] = []
    comments: list[str] = []
    for word in words:
        text = " ".join(word.text.split())
        if word.kind is Kind.COMMENT:
            comments.append(text)
        elif word.kind is Kind.DIRECTIVE:
            tokens.append(canonical_directive(text))
        elif word.text not in _OPTIONAL:
            tokens.append(word.text)
    return tokens, comments
