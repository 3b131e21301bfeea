"""Lay out one statement of Slice: on one line when it fits, else broken at its clauses and parameters."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from .lexer import Kind, Source

WIDTH = 110
"""Characters of a line, comments left aside."""

_CLAUSES = frozenset({"throws", "extends", "implements"})
_INNER = "  "
_DEEPER = "    "


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
    for lexeme in source.lexemes:
        if lexeme.kind is Kind.SPACE:
            newlines = lexeme.text.count("\n")
        else:
            words.append(Word(lexeme.kind, lexeme.text, newlines))
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


def _one_line(words: Sequence[Word]) -> str:
    """Return words with one set of spaces between them."""
    text = ""
    for index, word in enumerate(words):
        text += (_gap(words[index - 1], word) if index else "") + word.text
    return text


def statement_lines(words: Sequence[Word], ending: str, indent: int) -> list[str]:
    """Return the lines of a statement with its `ending`, without the `indent` characters before each."""
    plain = all(word.kind is not Kind.COMMENT or is_inline(word) for word in words)
    if plain:
        line = _one_line(words) + ending
        if indent + len(line) <= WIDTH:
            return [line]
    lines: list[str] = []
    for breaks in _ways_to_break(words, plain=plain):
        lines = _flow(words, breaks)
        lines[-1] += ending
        if all(indent + _code_length(line) <= WIDTH for line in lines):
            break
    return lines


def _gap(before: Word, after: Word) -> str:
    """Return the space between two words."""
    if before.kind is Kind.PUNCTUATION and before.text in {"(", "[", "[[", "<", "::"}:
        return ""
    if after.kind is Kind.PUNCTUATION:
        if after.text in {",", ";", ")", "]", "]]", ">", "(", "<", "*"}:
            return ""
        if after.text == "::":
            return "" if before.kind is Kind.NAME else " "
    return " "


def _ways_to_break(words: Sequence[Word], *, plain: bool) -> Iterator[dict[int, str]]:
    """Yield, from the mildest on, where lines may begin and with what indentation."""
    depths = list(_depths(words))
    clauses = {
        index: _INNER for index, word in enumerate(words) if index and _begins_clause(word, depths[index])
    }
    commas = {
        index + 1: _DEEPER
        for index, word in enumerate(words)
        if word.text == "," and depths[index] == 0 and clauses and index > min(clauses)
    }
    parameters = _parameter_breaks(words, depths)
    if plain or not parameters:
        yield clauses
        yield {**clauses, **commas}
    if parameters:
        yield parameters
        yield {**parameters, **clauses, **commas}


def _depths(words: Sequence[Word]) -> Iterator[int]:
    """Yield for each word how many parentheses are open around it."""
    depth = 0
    for word in words:
        if word.kind is Kind.PUNCTUATION and word.text == ")":
            depth -= 1
        yield depth
        if word.kind is Kind.PUNCTUATION and word.text == "(":
            depth += 1


def _begins_clause(word: Word, depth: int) -> bool:
    named = word.kind is Kind.KEYWORD and word.text in _CLAUSES
    return depth == 0 and (named or (word.kind is Kind.PUNCTUATION and word.text == ":"))


def _parameter_breaks(words: Sequence[Word], depths: Sequence[int]) -> dict[int, str]:
    """Return the breaks that put each parameter of an operation on its own line."""
    opening = max(
        (
            i
            for i, word in enumerate(words)
            if word.text == "(" and depths[i] == 0 and _names_operation(words, i)
        ),
        default=None,
    )
    if opening is None:
        return {}
    closing = next((i for i in range(opening + 1, len(words)) if depths[i] == 0), len(words))
    if closing == opening + 1:
        return {}
    breaks = {opening + 1: _INNER}
    breaks.update((i + 1, _INNER) for i in range(opening, closing) if words[i].text == "," and depths[i] == 1)
    breaks[closing] = ""
    for index in [index for index in breaks if index < closing and _stays_behind(words, index)]:
        breaks.setdefault(index + 1, breaks.pop(index))
    return breaks


def _names_operation(words: Sequence[Word], opening: int) -> bool:
    before = next((word for word in reversed(words[:opening]) if word.kind is not Kind.COMMENT), None)
    return before is not None and before.text not in {"optional", "tag"}


def _stays_behind(words: Sequence[Word], index: int) -> bool:
    """Return whether a comment that follows a comma belongs to the parameter before it."""
    word = words[index]
    if word.kind is not Kind.COMMENT or word.newlines:
        return False
    ends_line = index + 1 < len(words) and words[index + 1].newlines > 0
    return ends_line or not is_inline(word) or word.text.startswith("/**<")


def _flow(words: Sequence[Word], breaks: dict[int, str]) -> list[str]:
    """Return the words in lines that begin at `breaks` and behind comments that end a line."""
    lines = [""]
    prefix: str | None = None
    inner = _INNER
    for index, word in enumerate(words):
        inner = breaks.get(index) or inner
        if index in breaks:
            prefix = breaks[index]
        lines_of_word = comment_lines(word) if word.kind is Kind.COMMENT else [word.text]
        ends_line = word.kind is Kind.COMMENT and not is_inline(word)
        if ends_line and word.newlines and index:
            prefix = inner
        if prefix is not None and lines[-1].strip():
            lines.append(prefix)
        elif index and lines[-1].strip():
            lines[-1] += _gap(words[index - 1], word)
        prefix = inner if ends_line else None
        lines[-1] += lines_of_word[0]
        lines += [inner + line if line else "" for line in lines_of_word[1:]]
    return lines


def _code_length(line: str) -> int:
    """Return the length of a line without the comment at its end."""
    for mark in ("//", "/*"):
        line = line.partition(mark)[0]
    return len(line.rstrip())
