"""What exceptions say, as messages: their own, or the texts of Python and of the system that are met most.

Python says in English what is wrong with code, and so does the runtime of components, in the lines that they
log. A text that is known here becomes a message that can be translated, without a change of a letter; any
other stays as it is. Few of Python's are here, because each of its versions changes some.
"""

from __future__ import annotations

import re
from functools import cache, lru_cache
from typing import Final

from .messages import Message, Value, template

_SYNTAX: Final = (
    Message("invalid syntax"),
    Message("invalid syntax. Perhaps you forgot a comma?"),
    Message("expected ':'"),
    template("expected an indented block after {what} on line {line}"),
    Message("unexpected indent"),
    Message("unindent does not match any outer indentation level"),
    template("'{bracket}' was never closed"),
    template("unmatched '{bracket}'"),
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
    template("unsupported operand type(s) for {operator}: '{left}' and '{right}'"),
    template("{function} missing {count} required positional argument: {name}"),
    template("No module named '{name}'"),
)
"""Frequent texts of Python on code that fails."""

_RUNTIME: Final = (
    template("`self.{name}` is not declared; did you mean {names}?"),
    template("`self.{name}` is not declared"),
    template(
        "`self.{name}` is not declared; declare an interface, function or parameter, or assign it first"
    ),
    template("`{name}` has no value yet; give it one in the variables of {automaton}"),
    template("`{name}` has no value yet"),
    template(
        "`{name}` is a variable of {owner}, and {automaton} has its own; make it an output of "
        "{automaton}, or write `self.{name}` in both"
    ),
    template(
        "`{name}` is a variable of {owner}, and {automaton} has its own; pass it to {automaton} as an "
        "input, or write `self.{name}` in both"
    ),
    template("`{name}` is a variable of {owner}, and {automaton} has its own"),
    template("the output '{name}' of automaton {id} ('{automaton}') is {type}, not {given}: {value}"),
    template("its cycle did not end within {seconds} s and is abandoned: its code must not block"),
    template("{call} ends the component; a final state would end it without an error"),
)
"""Texts of the runtime on code that fails: `hfsm_runtime/_advice.py` and `_supervision.py` write them."""

_SYSTEM: Final = (
    Message("No such file or directory"),
    Message("Permission denied"),
    Message("No space left on device"),
    Message("Connection refused"),
    Message("not well-formed (invalid token)"),
    Message("mismatched tag"),
)
"""Frequent texts of the system on files, and of the reader of XML."""

_KNOWN: Final = (*_SYNTAX, *_ERRORS, *_RUNTIME, *_SYSTEM, *_THINGS)
_EXCEPTION: Final = re.compile(r"([A-Za-z_][\w.]*(?:Error|Exception|Warning)): (.+)", re.DOTALL)
_LONGEST_TEXT: Final = 600
"""Characters of a text that is looked for."""


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
def known_text(text: str, others: tuple[Message, ...] = ()) -> Message:
    """Return a text of Python, of the runtime or of the system as a message, with what is known of it.

    Before it the name of an exception may stand, as in `NameError: name 'x' is not defined`. `others` are
    messages of templates that are looked for, too, with any values.
    """
    if len(text) > _LONGEST_TEXT:
        return Message.verbatim(text)
    if exception := _EXCEPTION.fullmatch(text):
        kind, what = exception.groups()
        return Message("{kind}: {what}", kind=kind, what=known_text(what, others))
    for known, pattern in _patterns(others):
        if found := pattern.fullmatch(text):
            values: dict[str, Value] = found.groupdict()
            if "what" in values:
                values["what"] = known_text(found["what"])
            if (message := known.again(values)) == text:
                return message
    return Message.verbatim(text)


@cache
def _patterns(others: tuple[Message, ...]) -> tuple[tuple[Message, re.Pattern[str]], ...]:
    return tuple((each, _pattern(each)) for each in (*others, *_KNOWN))


def _pattern(message: Message) -> re.Pattern[str]:
    """Return the pattern of the texts that a template may give."""
    seen: set[str] = set()
    pattern = ""
    for literal, name, _, _ in message.pieces():
        pattern += re.escape(literal)
        if name in seen:
            pattern += f"(?P={name})"
        elif name is not None:
            seen.add(name)
            pattern += f"(?P<{name}>.+?)"
    return re.compile(pattern, re.DOTALL)
