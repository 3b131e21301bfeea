"""What a program says, and text from other processes made fit to be shown."""

from __future__ import annotations

import re
import signal
from collections.abc import Sequence
from typing import Final

LONGEST_TEXT: Final = 4096  # characters of the text of an error


def sentence(template: str, /, **values: object) -> str:
    """Return an English text, or a part of one, that a page may show: a template with its values.

    The template is a literal, from which `make texts` makes catalogs: by its template a page knows a text
    that it hears, and says it in its own language (`visualhfsm._base.recognition`). What is a sentence or a
    part of one, too, is a value of such a name as `reason` or `what` (`codegen.reasons`).
    """
    return template.format_map(values)


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
