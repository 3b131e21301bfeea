"""What a program says, and text from other processes made fit to be shown."""

from __future__ import annotations

import re
import signal
from collections.abc import Sequence
from typing import Final

LONGEST_TEXT: Final = 4096  # characters of the text of an error


def sentence(text: str) -> str:
    """Return an English text, or a part of one, that a page may have to say in another language.

    It marks a literal for `make texts`, and costs nothing. That reads an f-string as a template: a value has
    the last name in its expression. By the template, which the catalogs of languages have, a page knows what
    it hears (`visualhfsm._base.recognition`); a value that such a text may be, too, has a name of `PARTS` in
    `codegen.reasons`, such as `reason` or `what`.
    """
    return text


def cut(text: str, longest: int = LONGEST_TEXT) -> str:
    """Return a text with at most `longest` characters."""
    return text if len(text) <= longest else f"{text[: longest - 3]}..."


def encodable(text: str) -> str:
    """Return a text that UTF-8 can encode: a lone surrogate, as in file names, becomes its escape."""
    return text.encode("utf-8", "backslashreplace").decode()


def printable(text: str, longest: int = LONGEST_TEXT) -> str:
    """Return a text on one line, cut, without characters that control a terminal or forge a log line."""
    short = cut(text, longest)
    return short if short.isprintable() else "".join(c if c.isprintable() else " " for c in short)


def text_of(error: BaseException) -> str:
    """Return the text of an exception, whose `__str__` is user code, too, and may fail."""
    try:
        return str(error)
    except BaseException as problem:  # noqa: BLE001
        return f"its text failed with {type(problem).__name__}"


def without_source(error: Exception) -> str:
    """Return the text of a Zenoh error without the places in its sources, which do not help a user."""
    return re.sub(r" at /\S+\.rs:\d+\.?", "", str(error))


def few(names: Sequence[str], most: int = 3) -> str:
    """Return the first of some names, and how many more there are."""
    return ", ".join(names[:most]) + (f" and {len(names) - most} more" if len(names) > most else "")


def signal_name(number: int) -> str:
    """Return the name of a signal, such as SIGKILL, or `signal 40` if it has none."""
    try:
        return signal.Signals(number).name
    except ValueError:  # of the real-time signals, only the first and the last have names
        return f"signal {number}"
