"""What exceptions say, as messages: their own, or the texts of Python and of the system that are met most.

Python says in English what is wrong with code, and so does the runtime of components, in the lines that they
log. A text that is known here becomes a message that can be translated, without a change of a letter; any
other stays as it is.
"""

from __future__ import annotations

import re
from functools import cache, lru_cache
from typing import Final

from .messages import Message, Value

__all__ = ["known_text", "reason"]

_A: Final = "\N{HORIZONTAL ELLIPSIS}"
"""A value of a template that stands for any text."""
_N: Final = 0
"""A value of a template that stands for a number."""

_SYNTAX: Final = (
    Message("invalid syntax"),
    Message("invalid syntax. Perhaps you forgot a comma?"),
    Message("invalid syntax. Maybe you meant '==' or ':=' instead of '='?"),
    Message("expected ':'"),
    Message("expected 'except' or 'finally' block"),
    Message("expected an indented block after {what} on line {line}", what=_A, line=_N),
    Message("unexpected indent"),
    Message("unindent does not match any outer indentation level"),
    Message("inconsistent use of tabs and spaces in indentation"),
    Message("unexpected EOF while parsing"),
    Message("'{bracket}' was never closed", bracket=_A),
    Message("unmatched '{bracket}'", bracket=_A),
    Message("closing parenthesis '{close}' does not match opening parenthesis '{open}'", close=_A, open=_A),
    Message("unterminated string literal (detected at line {line})", line=_N),
    Message("cannot assign to {what} here. Maybe you meant '==' instead of '='?", what=_A),
    Message("cannot assign to {what}", what=_A),
    Message("'break' outside loop"),
    Message("'continue' not properly in loop"),
    Message("'return' outside function"),
    Message("invalid decimal literal"),
    Message("invalid character '{character}' ({code})", character=_A, code=_A),
    Message("invalid non-printable character {code}", code=_A),
    Message("positional argument follows keyword argument"),
    Message("Missing parentheses in call to '{name}'. Did you mean {call}?", name=_A, call=_A),
    Message("'{name}' is an illegal expression for augmented assignment", name=_A),
    Message("expected '{token}'", token=_A),
    Message("invalid hexadecimal literal"),
    Message("invalid digit '{digit}' in binary literal", digit=_A),
    Message("invalid digit '{digit}' in octal literal", digit=_A),
    Message("expected 'else' after 'if' expression"),
    Message("unterminated f-string literal (detected at line {line})", line=_N),
    Message("unterminated triple-quoted string literal (detected at line {line})", line=_N),
    Message("unexpected character after line continuation character"),
    Message("cannot delete {what}", what=_A),
    Message(
        "leading zeros in decimal integer literals are not permitted; use an 0o prefix for octal integers"
    ),
    Message("'yield' outside function"),
    Message("'await' outside function"),
    Message("'await' outside async function"),
    Message("import * only allowed at module level"),
    Message("name '{name}' is used prior to global declaration", name=_A),
    Message("name '{name}' is assigned to before global declaration", name=_A),
    Message("name '{name}' is used prior to nonlocal declaration", name=_A),
    Message("name '{name}' is assigned to before nonlocal declaration", name=_A),
    Message("name '{name}' is parameter and global", name=_A),
    Message("no binding for nonlocal '{name}' found", name=_A),
    Message("nonlocal declaration not allowed at module level"),
    Message("duplicate argument '{name}' in function definition", name=_A),
    Message("keyword argument repeated: {name}", name=_A),
    Message("non-default argument follows default argument"),
    Message("parameter without a default follows parameter with a default"),
    Message('expression cannot contain assignment, perhaps you meant "=="?'),
    Message("positional argument follows keyword argument unpacking"),
    Message("Generator expression must be parenthesized"),
    Message("multiple exception types must be parenthesized"),
    Message("default 'except:' must be last"),
    Message("trailing comma not allowed without surrounding parentheses"),
    Message("expression expected after dictionary key and ':'"),
    Message("':' expected after dictionary key"),
    Message("f-string: empty expression not allowed"),
    Message("f-string: expecting '}}'"),
    Message("f-string: single '}}' is not allowed"),
    Message("f-string: valid expression required before '}}'"),
    Message("can't use starred expression here"),
    Message("starred assignment target must be in a list or tuple"),
    Message("too many nested parentheses"),
    Message("too many statically nested blocks"),
)
"""What Python says of code that it cannot read."""

_THINGS: Final = (
    Message("function call"),
    Message("literal"),
    Message("expression"),
    Message("comparison"),
    Message("conditional expression"),
    Message("f-string expression"),
    Message("lambda"),
    Message("function definition"),
    Message("class definition"),
    Message("'{keyword}' statement", keyword=_A),
)
"""What Python calls parts of code: the values `what` of templates above."""

_DOUBTS: Final = (
    Message("assertion is always true, perhaps remove parentheses?"),
    Message("'if tuple literal' is always true, perhaps remove accidental comma?"),
    Message("use of >> is invalid with print function"),
    Message("use ==/!= to compare constant literals (str, bytes, int, float, tuple)"),
    Message("dictionary key {key} repeated with different values", key=_A),
    Message("'raise NotImplemented' should be 'raise NotImplementedError'"),
    Message("'...'.format(...) has unused arguments at position(s): {names}", names=_A),
    Message("'...'.format(...) has unused named argument(s): {names}", names=_A),
    Message("'...'.format(...) is missing argument(s) for placeholder(s): {names}", names=_A),
    Message("'...'.format(...) mixes automatic and manual numbering"),
    Message("'...'.format(...) has invalid format string: {reason}", reason=_A),
    Message("'...' % ... has invalid format string: {reason}", reason=_A),
    Message("'...' % ... has mixed positional and named placeholders"),
    Message("'...' % ... has unsupported format character {character}", character=_A),
    Message("'...' % ... has {count} placeholder(s) but {given} substitution(s)", count=_N, given=_N),
    Message("'...' % ... has unused named argument(s): {names}", names=_A),
    Message("'...' % ... is missing argument(s) for placeholder(s): {names}", names=_A),
    Message("'...' % ... expected mapping but got sequence"),
    Message("'...' % ... expected sequence but got mapping"),
    Message("'...' % ... `*` specifier requires sequence"),
)
"""What pyflakes says of code that Python takes, but that is probably wrong."""

_ERRORS: Final = (
    Message("division by zero"),
    Message("float division by zero"),
    Message("integer division or modulo by zero"),
    Message("integer modulo by zero"),
    Message("float modulo"),
    Message("math domain error"),
    Message("maximum recursion depth exceeded"),
    Message("name '{name}' is not defined. Did you mean: '{other}'?", name=_A, other=_A),
    Message("name '{name}' is not defined", name=_A),
    Message("cannot access local variable '{name}' where it is not associated with a value", name=_A),
    Message(
        "'{type}' object has no attribute '{name}'. Did you mean: '{other}'?", type=_A, name=_A, other=_A
    ),
    Message("'{type}' object has no attribute '{name}'", type=_A, name=_A),
    Message("module '{module}' has no attribute '{name}'", module=_A, name=_A),
    Message("'{type}' object is not callable", type=_A),
    Message("'{type}' object is not iterable", type=_A),
    Message("'{type}' object is not subscriptable", type=_A),
    Message("list index out of range"),
    Message("string index out of range"),
    Message("tuple index out of range"),
    Message(
        "unsupported operand type(s) for {operator}: '{left}' and '{right}'", operator=_A, left=_A, right=_A
    ),
    Message(
        "'{operator}' not supported between instances of '{left}' and '{right}'",
        operator=_A,
        left=_A,
        right=_A,
    ),
    Message('can only concatenate str (not "{type}") to str', type=_A),
    Message("must be real number, not {type}", type=_A),
    Message("could not convert string to float: {text}", text=_A),
    Message("invalid literal for int() with base {base}: {text}", base=_N, text=_A),
    Message("too many values to unpack (expected {count})", count=_N),
    Message("not enough values to unpack (expected {expected}, got {given})", expected=_A, given=_N),
    Message(
        "{function} missing {count} required positional argument: {name}", function=_A, count=_N, name=_A
    ),
    Message(
        "{function} missing {count} required positional arguments: {names}", function=_A, count=_N, names=_A
    ),
    Message(
        "{function} takes {expected} positional arguments but {given} were given",
        function=_A,
        expected=_A,
        given=_N,
    ),
    Message("{function} got an unexpected keyword argument '{name}'", function=_A, name=_A),
    Message("No module named '{name}'", name=_A),
)
"""What Python says when code fails."""

_RUNTIME: Final = (
    Message("`self.{name}` is not declared; did you mean {names}?", name=_A, names=_A),
    Message("`self.{name}` is not declared", name=_A),
    Message(
        "`self.{name}` is not declared; declare an interface, function or parameter, or assign it first",
        name=_A,
    ),
    Message("`{name}` has no value yet; give it one in the variables of {automaton}", name=_A, automaton=_A),
    Message("`{name}` has no value yet", name=_A),
    Message(
        "`{name}` is a variable of {owner}, and {automaton} has its own; make it an output of {automaton}, "
        "or write `self.{name}` in both",
        name=_A,
        owner=_A,
        automaton=_A,
    ),
    Message(
        "`{name}` is a variable of {owner}, and {automaton} has its own; pass it to {automaton} as an input, "
        "or write `self.{name}` in both",
        name=_A,
        owner=_A,
        automaton=_A,
    ),
    Message(
        "`{name}` is a variable of {owner}, and {automaton} has its own", name=_A, owner=_A, automaton=_A
    ),
    Message(
        "the output '{name}' of automaton {id} ('{automaton}') is {type}, not {given}: {value}",
        name=_A,
        id=_N,
        automaton=_A,
        type=_A,
        given=_A,
        value=_A,
    ),
    Message("its cycle did not end within {seconds} s and is abandoned: its code must not block", seconds=_N),
    Message("{call} ends the component; a final state would end it without an error", call=_A),
)
"""What the runtime says of code that fails: `hfsm_runtime/_advice.py` and `_supervision.py` write it."""

_SYSTEM: Final = (
    Message("No such file or directory"),
    Message("Permission denied"),
    Message("Is a directory"),
    Message("Not a directory"),
    Message("File exists"),
    Message("File name too long"),
    Message("No space left on device"),
    Message("Read-only file system"),
    Message("Too many open files"),
    Message("Connection refused"),
    Message("not well-formed (invalid token)"),
    Message("mismatched tag"),
    Message("junk after document element"),
    Message("duplicate attribute"),
    Message("undefined entity"),
    Message("unclosed token"),
)
"""What the system says of files, and the reader of XML."""

_KNOWN: Final = (*_SYNTAX, *_DOUBTS, *_ERRORS, *_RUNTIME, *_SYSTEM, *_THINGS)
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
