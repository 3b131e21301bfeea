"""Write elements as XML: indented, but for those in which indentation would become part of a text."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Final

from ..document import Comment, Extra

__all__ = [
    "INDENT",
    "UNWRITABLE",
    "DocumentNotWritableError",
    "attributes_text",
    "content_text",
    "escaped",
    "is_writable",
    "lines_of",
]

INDENT: Final = "  "
"""Indentation of one level."""

UNWRITABLE: Final = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
"""Characters that XML 1.0 cannot hold, not even as a reference."""

_TEXT_ESCAPES: Final = {"&": "&amp;", "<": "&lt;", ">": "&gt;", "\r": "&#13;"}
_ATTRIBUTE_ESCAPES: Final = {**_TEXT_ESCAPES, '"': "&quot;", "\n": "&#10;", "\t": "&#9;"}


class DocumentNotWritableError(ValueError):
    """A text of the document holds a character that XML cannot hold."""


def lines_of(extra: Extra, depth: int = 0) -> Iterator[str]:
    """Yield the lines of an element or a comment, indented by `depth` levels.

    Raises DocumentNotWritableError.
    """
    indent = INDENT * depth
    if isinstance(extra, Comment) or not extra.children or extra.text or any(c.tail for c in extra.children):
        yield indent + _inline(extra)  # indentation would become part of the text
        return
    yield f"{indent}<{extra.tag}{attributes_text(extra.attributes)}>"
    for child in extra.children:
        yield from lines_of(child, depth + 1)
    yield f"{indent}</{extra.tag}>"


def content_text(text: str, children: tuple[Extra, ...]) -> str:
    """Return what stands between the tags of an element that mixes text and elements."""
    return escaped(text) + "".join(_inline(child) + escaped(child.tail) for child in children)


def attributes_text(attributes: tuple[tuple[str, str], ...]) -> str:
    """Return the attributes of a start tag, each with a blank before it."""
    return "".join(
        f' {name}="{"".join(_ATTRIBUTE_ESCAPES.get(c, c) for c in _checked(value))}"'
        for name, value in attributes
    )


def escaped(text: str) -> str:
    """Return a text as it stands in XML."""
    return "".join(_TEXT_ESCAPES.get(character, character) for character in _checked(text))


def is_writable(text: str) -> bool:
    """Return whether XML can hold a text."""
    return not UNWRITABLE.search(text)


def _inline(extra: Extra) -> str:
    if isinstance(extra, Comment):
        if "--" in extra.text or extra.text.endswith("-"):
            raise DocumentNotWritableError("a comment cannot hold `--` or end with `-`")
        return f"<!--{_checked(extra.text)}-->"
    content = content_text(extra.text, extra.children)
    start = f"<{extra.tag}{attributes_text(extra.attributes)}"
    return f"{start}>{content}</{extra.tag}>" if content else f"{start}/>"


def _checked(text: str) -> str:
    found = UNWRITABLE.search(text)
    if found:
        raise DocumentNotWritableError(f"XML cannot hold the character {found.group()!r} in `{text[:40]!r}`")
    return text
