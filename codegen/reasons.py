"""What exceptions say, as messages: their own, or the texts of Python and of the system that are met most.

Python says in English what is wrong with code. A text that is known here becomes a message that can be
translated, without a change of a letter; any other stays as it is. Few of Python's are here, because each of
its versions changes some.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import cache, lru_cache
from typing import Final, NamedTuple

from .messages import Message, Value, joined, number, template

_SYNTAX: Final = (
    Message("invalid syntax"),
    Message("invalid syntax. Perhaps you forgot a comma?"),
    Message("expected ':'"),
    template("expected an indented block after {what} on line {line}"),
    Message("unexpected indent"),
    Message("unindent does not match any outer indentation level"),
    template("'{bracket}' was never closed"),
    template("unmatched '{bracket}'"),
    template("closing parenthesis '{close}' does not match opening parenthesis '{open}'"),
    Message("invalid decimal literal"),
    template("invalid character '{character}' ({name})"),
    template("unterminated string literal (detected at line {line})"),
    template("cannot assign to {what} here. Maybe you meant '==' instead of '='?"),
)
"""Frequent texts of Python on code that it cannot read."""

_THINGS: Final = (
    Message("function call"),
    Message("literal"),
    Message("expression"),
    Message("function definition"),
    template("'{keyword}' statement"),
)
"""Python's names for parts of code: the values `what` of templates above."""

_ERRORS: Final = (
    Message("division by zero"),
    Message("float division by zero"),
    template("name '{name}' is not defined. Did you mean: '{other}'?"),
    template("name '{name}' is not defined"),
    template("'{type}' object has no attribute '{name}'. Did you mean: '{other}'?"),
    template("'{type}' object has no attribute '{name}'"),
    template("'{type}' object is not callable"),
    Message("list index out of range"),
    template("list indices must be integers or slices, not {type}"),
    template("unsupported operand type(s) for {operator}: '{left}' and '{right}'"),
    template("{function} missing {count} required positional argument: {name}"),
    template("No module named '{name}'"),
)
"""Frequent texts of Python on code that fails."""

_SYSTEM: Final = (
    Message("No such file or directory"),
    Message("Permission denied"),
    Message("No space left on device"),
    Message("Connection refused"),
    Message("not well-formed (invalid token)"),
    Message("mismatched tag"),
)
"""Frequent texts of the system on files, and of the reader of XML."""

_KNOWN: Final = (*_SYNTAX, *_ERRORS, *_SYSTEM, *_THINGS)
_EXCEPTION: Final = re.compile(r"([A-Za-z_][\w.]*(?:Error|Exception|Warning)): (.+)", re.DOTALL)
_LONGEST_TEXT: Final = 600
"""Characters of a text that is looked for."""
PARTS: Final = frozenset(
    (
        *("ended", "error", "failure", "guard", "message", "needed", "present", "reason", "stance", "stop"),
        *("stop_reason", "strerror", "waits", "what", "why"),
    )
)
"""The names of values that may be known themselves, or lists of what is."""


def reason(error: BaseException) -> Message:
    """Return what an exception says: errors of syntax and of the system without their places and numbers."""
    message = getattr(error, "message", None)
    if isinstance(message, Message):
        return message
    match error:
        case SyntaxError(msg=str(text)) | OSError(strerror=str(text)):
            return known_text(text)
    return known_text(str(error))


@lru_cache(maxsize=1024)
def known_text(text: str, others: tuple[Message, ...] = (), fewest: int = 0) -> Message:
    """Return a text of Python or of the system as a message, with what is known of it.

    `others` are messages of templates that are looked for, too. The `fewest` letters of a text that are of
    templates keep those as `{automaton} is in {state}` from fitting too much; of several that fit, the one
    with most letters counts. Before a text the name of an exception may stand, as in `NameError: name 'x' is
    not defined`; a semicolon divides what is known.
    """
    if len(text) > _LONGEST_TEXT:
        return Message.verbatim(text)
    if exception := _EXCEPTION.fullmatch(text):
        kind, what = exception.groups()
        return Message("{kind}: {what}", kind=kind, what=known_text(what, others, fewest))
    found = _find(text, others, "; ")
    return found if _letters(found) >= fewest else Message.verbatim(text)


@lru_cache(maxsize=4096)  # without it, nested texts would take a time that is exponential in their depth
def _find(text: str, others: tuple[Message, ...], separator: str) -> Message:
    """Return a text, or a list of texts, as the message with most letters of templates."""
    found = [Message.verbatim(text), *_fitting(text, others)]
    if exception := _EXCEPTION.fullmatch(text):
        kind, what = exception.groups()
        found.insert(0, Message("{kind}: {what}", kind=kind, what=_find(what, others, "; ")))
    before, is_list, last = text.rpartition(separator)
    if is_list:
        found.append(joined(separator, [_find(before, others, separator), _find(last, others, "; ")]))
    return max(found, key=_letters)


def _fitting(text: str, others: tuple[Message, ...]) -> Iterator[Message]:
    """Yield a text as the messages of the templates that fit it."""
    for known in _patterns(others):
        if known.longest in text and (found := known.pattern.fullmatch(text)):
            values: dict[str, Value] = {
                name: _find(each, others, ", ") if name in PARTS else number(each)
                for name, each in found.groupdict().items()
            }
            yield known.message.again(values)


class _Known(NamedTuple):
    """A template that is looked for."""

    message: Message
    pattern: re.Pattern[str]
    """That of the texts that it may give."""
    longest: str
    """Its longest text between values, which is in all of these."""


@cache
def _patterns(others: tuple[Message, ...]) -> tuple[_Known, ...]:
    return tuple(map(_known, (*others, *_KNOWN)))


def _known(message: Message) -> _Known:
    seen: set[str] = set()
    longest = pattern = ""
    for literal, name, _, _ in message.pieces():
        longest = max(longest, literal, key=len)
        pattern += re.escape(literal)
        if name in seen:
            pattern += f"(?P={name})"
        elif name is not None:
            seen.add(name)
            pattern += f"(?P<{name}>.+?)"
    return _Known(message, re.compile(pattern, re.DOTALL), longest)


def _letters(message: Message) -> int:
    """Return the number of letters of templates in a message."""
    own = sum(each.isalpha() for literal, *_ in message.pieces() for each in literal)
    return own + sum(_letters(each) for each in message.values.values() if isinstance(each, Message))
