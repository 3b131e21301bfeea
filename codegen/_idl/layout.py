"""Format Python source like `ruff format` with the project's line length."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterable, Sequence

LINE_LENGTH = 110
INDENT = "    "

_ENDS_WITH_QUOTE = re.compile(r'(?<!\\)(?:\\\\)*"$')  # one that no backslash escapes


def bracketed(before: str, items: Sequence[str], after: str, indent: str = "") -> list[str]:
    """Return `before items after` on one line, or with one item per line if that is too long."""
    line = f"{indent}{before}{', '.join(items)}{after}"
    if not items or len(line) <= LINE_LENGTH:
        return [line]
    return [f"{indent}{before}", *(f"{indent}{INDENT}{item}," for item in items), f"{indent}{after}"]


def docstring(text: str, indent: str = "") -> list[str]:
    """Return a docstring; each line of the text keeps its indent and is wrapped if it is too long."""
    text = text.replace("\\", "\\\\").replace('"""', '\\"\\"\\"')
    width = LINE_LENGTH - len(indent)
    lines: list[str] = []
    for number, paragraph in enumerate(text.split("\n\n")):
        if number:
            lines.append("")
        for line in paragraph.split("\n"):
            hanging = len(line) - len(line.lstrip())
            if line and len(line) <= width - (3 if not lines else 0):
                lines.append(line.rstrip())
                continue
            lines += textwrap.wrap(
                line.strip(),
                width - (3 if not lines else 0),
                initial_indent=" " * hanging,
                subsequent_indent=" " * (hanging * 2 if hanging else 0),
                break_long_words=False,
                break_on_hyphens=False,
            )
    if lines[0].startswith('"'):
        lines[0] = " " + lines[0]
    if len(lines) == 1:
        closing = ' """' if _ENDS_WITH_QUOTE.search(lines[0]) else '"""'
        if len(indent) + 3 + len(lines[0]) + len(closing) <= LINE_LENGTH:
            return [f'{indent}"""{lines[0]}{closing}']
        # `ruff format` puts the closing quotes on the same line if there is only one.
        lines = textwrap.wrap(
            lines[0], width - 3 - len(closing), break_long_words=False, break_on_hyphens=False
        )
    return [f'{indent}"""{lines[0]}', *(indent + line if line else "" for line in lines[1:]), f'{indent}"""']


def string(value: str) -> str:
    """Return a string literal in double quotes, or in single ones if that saves backslashes."""
    quote = "'" if value.count('"') > value.count("'") else '"'
    body = value.replace("\\", "\\\\").replace(quote, "\\" + quote)
    characters = (each if each.isprintable() else repr(each)[1:-1] for each in body)
    return quote + "".join(characters) + quote


def stacked(chunks: Iterable[Sequence[str]]) -> list[str]:
    """Return the lines of a module: two empty lines around a class, one between other statements."""
    lines: list[str] = []
    class_before = False
    for chunk in chunks:
        is_class = any(line.startswith("class ") for line in chunk)
        if lines:
            lines += ["", ""] if is_class or class_before else [""]
        lines += chunk
        class_before = is_class
    return lines


def source_order(names: Iterable[str]) -> list[str]:
    """Return names in the order of isort: constants, then classes, then the rest."""

    def key(name: str) -> tuple[int, str]:
        if name.isupper() and len(name) > 1:
            return 0, name
        return (1 if name.lstrip("_")[:1].isupper() else 2), name

    return sorted(set(names), key=key)
