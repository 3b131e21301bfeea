"""The statements of Python 2 that are calls in Python 3, or are written in another way."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

from .matches import Edit, Match
from .words import Word, closing_bracket, split_at_commas, statements_of, text_of

__all__ = ["excepts", "execs", "prints", "raises"]

# What `print (x)` may be followed by only in Python 2, where the parentheses belong to the value.
_GOES_ON: Final = frozenset(("%", "+", "*", ".", ",", "["))


def prints(code: str, words: Sequence[Word]) -> Iterator[Match]:
    """Find `print` as a statement."""
    for statement in statements_of(words):
        head = statement[0]
        if (head.kind, head.text) != ("name", "print") or not _is_print_statement(statement):
            continue
        yield Match(head.start, "`print` is a function in Python 3", _print_edits(code, statement))


def _is_print_statement(statement: Sequence[Word]) -> bool:
    if len(statement) == 1:
        return True
    follower = statement[1]
    if follower.text == "(":
        closing = closing_bracket(statement, 1)
        return (
            closing is not None and closing + 1 < len(statement) and statement[closing + 1].text in _GOES_ON
        )
    if follower.text == "not":
        return len(statement) > 2 and statement[2].text != "in"
    if follower.kind in ("name", "number", "string"):
        return follower.text not in ("in", "is", "and", "or", "if")
    return follower.text in (">>", "[", "{", "-", "+", "~", "`")


def _print_edits(code: str, statement: Sequence[Word]) -> tuple[Edit, ...]:
    head, values = statement[0], list(statement[1:])
    if not values:
        return (Edit(head.end, head.end, "()"),)
    options: list[str] = []
    if values[0].text == ">>":
        target = split_at_commas(values[1:], 0)[0]
        if not target:
            return ()
        options.append(f"file={text_of(code, target)}")
        values = values[len(target) + 2 :]
    if values and values[-1].text == ",":
        options.append('end=" "')
        values.pop()
    inner = text_of(code, values)
    separator = ", " if values and options else ""
    return (Edit(head.end, statement[-1].end, f"({inner}{separator}{', '.join(options)})"),)


def excepts(_code: str, words: Sequence[Word]) -> Iterator[Match]:
    """Find `except X, e`."""
    for statement in statements_of(words):
        parts = split_at_commas(statement[1:], 0)
        if statement[0].text == "except" and len(parts) == 2 and all(parts):
            comma = parts[0][-1].end
            message = "`except X, e` is `except X as e` in Python 3"
            yield Match(statement[0].start, message, (Edit(comma, parts[1][0].start, " as "),))


def raises(code: str, words: Sequence[Word]) -> Iterator[Match]:
    """Find `raise X, value` and `raise X, value, traceback`."""
    for statement in statements_of(words):
        parts = split_at_commas(statement[1:], 0)
        if statement[0].text != "raise" or len(parts) not in (2, 3) or not all(parts):
            continue
        kind, value, *trace = (text_of(code, part) for part in parts)
        is_group = parts[1][0].text == "(" and closing_bracket(parts[1], 0) == len(parts[1]) - 1
        call = kind + (value if is_group else f"({value})")
        if trace:
            call += f".with_traceback({trace[0]})"
        edit = Edit(parts[0][0].start, statement[-1].end, call)
        yield Match(statement[0].start, "`raise X, value` is `raise X(value)` in Python 3", (edit,))


def execs(code: str, words: Sequence[Word]) -> Iterator[Match]:
    """Find `exec` as a statement."""
    for statement in statements_of(words):
        head, values = statement[0], statement[1:]
        if head.text != "exec" or not values:
            continue
        split = next((i for i, word in enumerate(values) if word.text == "in" and word.depth == 0), None)
        if values[0].kind != "string" and (values[0].kind != "name" or split == 0):
            closing = closing_bracket(values, 0) if values[0].text == "(" else None
            if closing is None or split != closing + 1:
                continue
        source = text_of(code, values[:split])
        scopes = "" if split is None else f", {text_of(code, values[split + 1 :])}"
        edits = (Edit(head.end, statement[-1].end, f"({source}{scopes})"),)
        yield Match(head.start, "`exec` is a function in Python 3", edits)
