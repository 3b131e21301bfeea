"""What has another name in Python 3: functions, methods and modules."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from itertools import pairwise, takewhile
from typing import Final

from .matches import Edit, Match
from .words import Word, closing_bracket, statements_of

__all__ = ["bound_names", "has_keys", "modules", "names"]

_RENAMED: Final = {
    "xrange": "range",
    "unicode": "str",
    "basestring": "str",
    "unichr": "chr",
    "raw_input": "input",
    "long": "int",
}
_RENAMED_METHODS: Final = {"iteritems": "items", "itervalues": "values", "iterkeys": "keys"}
_RENAMED_MODULES: Final = {
    "ConfigParser": "configparser",
    "Queue": "queue",
    "StringIO": "io",
    "Tkinter": "tkinter",
    "cPickle": "pickle",
    "cStringIO": "io",
    "commands": "subprocess",
    "thread": "_thread",
    "urllib2": "urllib.request",
}


_LONGEST: Final = 200
"""Words in which targets of a loop and parameters of a function are looked for."""


def names(_code: str, words: Sequence[Word], *, bound: frozenset[str]) -> Iterator[Match]:
    """Find functions and methods that have another name, where the name has no meaning of its own.

    `bound` are the names to which other code gives one.
    """
    bound |= bound_names(words)
    for before, word, after in zip([Word("end", "", 0), *words], words, words[1:], strict=False):
        if word.kind != "name" or after.text == "=":
            continue
        if before.text == ".":
            new = _RENAMED_METHODS.get(word.text) if after.text == "(" else None
        else:
            new = None if word.text in bound else _RENAMED.get(word.text)
        if new:
            message = f"`{word.text}` is `{new}` in Python 3"
            yield Match(word.start, message, (Edit(word.start, word.end, new),))


def modules(_code: str, words: Sequence[Word]) -> Iterator[Match]:
    """Find imports of modules that have another name."""
    for statement in statements_of(words):
        if statement[0].text not in ("import", "from") or len(statement) < 2:
            continue
        module = statement[1]
        new = _RENAMED_MODULES.get(module.text)
        if new is None or (len(statement) > 2 and statement[2].text == "."):
            continue
        plain = statement[0].text == "import" and (len(statement) == 2 or statement[2].text != "as")
        edit = Edit(module.start, module.end, f"{new} as {module.text}" if plain else new)
        yield Match(module.start, f"the module `{module.text}` is `{new}` in Python 3", (edit,))


def bound_names(words: Sequence[Word]) -> frozenset[str]:
    """Return the names to which code seems to give a meaning of its own."""
    return frozenset(_bound_names(words))


def _bound_names(words: Sequence[Word]) -> Iterator[str]:
    introducing = ("def", "class", "as", "import", "global", "lambda")
    for index, (word, after) in enumerate(pairwise(words)):
        if word.kind == "name" and (after.text == "=" or (index and words[index - 1].text in introducing)):
            yield word.text
        if word.text == "for":
            targets = words[index + 1 : index + 1 + _LONGEST]
            yield from (each.text for each in takewhile(lambda each: each.text != "in", targets))
        if word.text == "def":
            parameters = words[index + 2 : index + 2 + _LONGEST]
            inside = partial(_is_inside, depth=word.depth)
            yield from (each.text for each in takewhile(inside, parameters))
    for statement in statements_of(words):
        assigns = [index for index, word in enumerate(statement) if word.text == "=" and word.depth == 0]
        yield from (word.text for word in statement[: max(assigns, default=0)] if word.kind == "name")


def _is_inside(word: Word, depth: int) -> bool:
    """Return whether a word stands before the colon that ends a head at some depth."""
    return word.text != ":" or word.depth > depth


def has_keys(code: str, words: Sequence[Word]) -> Iterator[Match]:
    """Find `d.has_key(k)`, which is `k in d`."""
    for index, word in enumerate(words[:-1]):
        if word.text != "has_key" or words[index + 1].text != "(" or words[index - 1].text != ".":
            continue
        closing = closing_bracket(words, index + 1)
        start = _start_of_primary(words, index - 1)
        message = "`d.has_key(k)` is `k in d` in Python 3"
        if closing is None or start is None:
            yield Match(word.start, message)
            continue
        key = code[words[index + 1].end : words[closing].start].strip()
        owner = code[words[start].start : words[index - 1].start]
        edit = Edit(words[start].start, words[closing].end, f"({key} in {owner})")
        yield Match(word.start, message, (edit,))


def _start_of_primary(words: Sequence[Word], dot: int) -> int | None:
    """Return the index of the first word of what stands before a dot: `a.b(c)[d]`."""
    index = dot - 1
    while index >= 0:
        word = words[index]
        if word.text in (")", "]"):
            opening = (i for i in range(index - 1, -1, -1) if words[i].depth == word.depth)
            index = next((i for i in opening if words[i].text in ("(", "[")), -1)
            before = words[index - 1] if index > 0 else None
            if before is None or (before.kind != "name" and before.text not in (")", "]")):
                return index if index >= 0 else None
            index -= 1
        elif word.kind not in ("name", "string"):
            return None
        elif index > 1 and words[index - 1].text == ".":
            index -= 2
        else:
            return index
    return None
