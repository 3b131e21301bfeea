"""Docstrings as plain sentences: without signatures, lists of parameters, examples and markup."""

from __future__ import annotations

import inspect
import re
from typing import Final

_CALL: Final = re.compile(r"[\w.]+\((?P<parameters>.*?)\)(?: ?-+> ?(?P<result>.*))?\.?", re.DOTALL)
"""The first line of the docstrings of compiled functions, such as `array(object, dtype=None)`."""
_STRUCTURE: Final = re.compile(
    r"""
    >>> | \.\.\s | :\w+.*?: | [-*+•]\s | \d+[.)]\s  # an example, a directive, a field, items of a list
    | \s  # what is indented
    | [^\n]*\n\s+\S  # a term above its indented definition
    | [^\n]*\n[ ]*[-=~*^]{3,}[ ]*(?:\n|$)  # a heading
    | [A-Z][\w ]*:[ ]*(?:\n|$)  # such as "Args:"
    """,
    re.VERBOSE,
)
_MARKUP: Final = (
    (re.compile(r"``(.+?)``"), r"\1"),
    (re.compile(r":[\w:+-]+:`~?([^`<]+?)(?: <[^`>]*>)?`"), r"\1"),
    (re.compile(r"`([^`<]+?)(?: <[^`>]*>)?`_{0,2}"), r"\1"),
    (re.compile(r"(?<![\w*])(\*{1,2})(\w(?:[^*\n]*\w)?)\1(?![\w*])"), r"\2"),
    (re.compile(r"\s+"), " "),
)


def plain(docstring: str) -> str:
    """Return the sentences with which a docstring begins, each paragraph in one line.

    They end at the first list of parameters, heading, example or list. Without any, the first paragraph is
    returned as it is, or what a call returns when the docstring says nothing else.
    """
    first, *others = re.split(r"\n[ \t]*\n", inspect.cleandoc(docstring))
    beginning, result = _without_calls(first)
    paragraphs = [each for each in (beginning, *others) if each]
    sentences: list[str] = []
    for paragraph in paragraphs:
        if _STRUCTURE.match(paragraph):
            break
        # A list may follow its introduction without an empty line.
        lines = paragraph.split("\n")
        end = next((at for at, line in enumerate(lines) if at and _STRUCTURE.match(line)), len(lines))
        sentences.append(_unmarked(" ".join(lines[:end])))
        if end < len(lines):
            break
    return "\n".join(sentences) or result or next(iter(paragraphs), "")


def _without_calls(paragraph: str) -> tuple[str, str]:
    """Return a paragraph without the signatures at its beginning, and what the first of them returns.

    A sentence that stands in place of the result belongs to the paragraph.
    """
    # Further lines of a signature are indented.
    lines = [line.replace("\n", " ") for line in re.split(r"\n(?!\s)", paragraph)]
    results: list[str] = []
    while lines and (call := _CALL.fullmatch(re.sub(r"\s+", " ", lines[0]))):
        result = call["result"] or ""
        results.append(result)
        del lines[0]
        if " " in result and call.string.endswith("."):
            lines.insert(0, f"{result.rstrip('.')}.")
            break
    return ("\n".join(lines), results[0]) if results else (paragraph, "")


def _unmarked(text: str) -> str:
    for pattern, replacement in _MARKUP:
        text = pattern.sub(replacement, text)
    return text.strip()
