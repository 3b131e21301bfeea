"""Cut code into words, whether it is Python 2 or 3, and find the statements and brackets among them.

Python 3 cannot parse Python 2, and its own tokenizer refuses some of it.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

__all__ = ["Word", "closing_bracket", "split_at_commas", "statements_of", "text_of", "words_of"]

_LEXEMES: Final = re.compile(
    r"""(?P<blank>[^\S\n]+|\\\r?\n)
      | (?P<comment>\#[^\n]*)
      | (?P<newline>\n)
      | (?P<string>(?:[uUbBrRfF]{0,2})(?:
            '''(?:\\.|[^\\])*?''' | \"\"\"(?:\\.|[^\\])*?\"\"\"
          | '(?:\\.|[^'\\\n])*' | "(?:\\.|[^"\\\n])*"))
      | (?P<number>0[xX][\da-fA-F_]+[lL]?|0[bBoO][\d_]+[lL]?
          |(?:\d[\d_]*\.?[\d_]*|\.\d[\d_]*)(?:[eE][+-]?\d+)?[jJlL]?)
      | (?P<name>[^\W\d]\w*)
      | (?P<operator><>|\*\*=?|//=?|>>=?|<<=?|->|:=|[-+*/%@&|^=<>!]=|[^\w\s])""",
    re.VERBOSE | re.DOTALL,
)
_COMPOUND: Final = frozenset(
    ("if", "elif", "else", "for", "while", "try", "except", "finally", "with", "def", "class")
)


@dataclass(frozen=True, slots=True)
class Word:
    """A word of the code: `kind` is name, number, string, operator, newline (of a statement) or end."""

    kind: str
    text: str
    start: int
    depth: int = 0
    """How many brackets are open around it."""

    @property
    def end(self) -> int:
        """The offset behind the word."""
        return self.start + len(self.text)


def words_of(code: str) -> list[Word]:
    """Cut code into words without blanks and comments; line ends inside brackets are no words."""
    words: list[Word] = []
    depth = 0
    for found in _LEXEMES.finditer(code):
        kind, text = str(found.lastgroup), found.group()
        if kind in ("blank", "comment") or (kind == "newline" and depth):
            continue
        if text in ("(", "[", "{"):
            words.append(Word(kind, text, found.start(), depth))
            depth += 1
            continue
        if text in (")", "]", "}"):
            depth = max(0, depth - 1)
        words.append(Word(kind, text, found.start(), depth))
    words.append(Word("end", "", len(code)))
    return words


def statements_of(words: Sequence[Word]) -> Iterator[Sequence[Word]]:
    """Yield the words of each simple statement, and those of each head of a compound one."""
    start = 0
    in_head = False
    lambdas = 0
    for index, word in enumerate(words):
        if index == start:
            in_head, lambdas = word.text in _COMPOUND, 0
        lambdas += word.text == "lambda" and word.depth == 0
        ends = word.kind in ("newline", "end") or (word.text == ";" and word.depth == 0)
        if word.text == ":" and word.depth == 0 and in_head:
            ends = ends or not lambdas
            lambdas -= bool(lambdas)
        if ends:
            if index > start:
                yield words[start:index]
            start = index + 1


def split_at_commas(words: Sequence[Word], depth: int) -> list[Sequence[Word]]:
    """Return the words between the commas at one depth."""
    parts: list[Sequence[Word]] = []
    start = 0
    for index, word in enumerate(words):
        if word.text == "," and word.depth == depth:
            parts.append(words[start:index])
            start = index + 1
    return [*parts, words[start:]]


def text_of(code: str, words: Sequence[Word]) -> str:
    """Return the code from the first of some words to the last."""
    return code[words[0].start : words[-1].end] if words else ""


def closing_bracket(words: Sequence[Word], opening: int) -> int | None:
    """Return the index of the bracket that closes the one at an index."""
    depth = words[opening].depth
    for index in range(opening + 1, len(words)):
        if words[index].text in (")", "]", "}") and words[index].depth == depth:
            return index
    return None
