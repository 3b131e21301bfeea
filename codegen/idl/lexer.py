"""Split the text of a Slice file into tokens, each with its place and its doc comment."""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Iterator
from enum import Enum
from pathlib import Path
from typing import NamedTuple

from codegen.diagnostics import Location

KEYWORDS = frozenset(
    """
    bool byte class const dictionary double enum exception extends false float idempotent implements int
    interface local LocalObject long module Object optional out sequence short string struct throws true Value
    void
    """.split()  # noqa: SIM905 - a list of words is easier to read than of literals
)


class Kind(Enum):
    """What a token is."""

    NAME = "a name"
    KEYWORD = "a keyword"
    INTEGER = "an integer"
    FLOAT = "a number"
    STRING = "a string"
    PUNCTUATION = "punctuation"
    DIRECTIVE = "a preprocessor directive"
    INVALID = "an unexpected character"
    UNTERMINATED = "an unterminated literal or comment"
    END = "the end of the file"
    SPACE = "space"
    COMMENT = "a comment"


class Piece(NamedTuple):
    """A stretch of a file; a token, or the space or comment between tokens."""

    kind: Kind
    text: str
    offset: int


class Source:
    """A source file: its path as people know it and its text."""

    __slots__ = ("_line_starts", "_tokens", "path", "text")

    def __init__(self, path: Path, text: str) -> None:
        self.path = path
        self.text = text
        self._line_starts: list[int] | None = None
        self._tokens: list[Token] | None = None

    @property
    def tokens(self) -> list[Token]:
        """The tokens of the file, directives unresolved, with one of kind END last."""
        if self._tokens is None:
            self._tokens = _tokenize(self)
        return self._tokens

    @property
    def pieces(self) -> Iterator[Piece]:
        """The whole file without a gap, comments, spaces and directives as they stand in it."""
        for match in _TOKEN.finditer(self.text):
            yield Piece(_kind(match.lastgroup, match.group()), match.group(), match.start())

    def position(self, offset: int) -> tuple[int, int]:
        """Return line and column, both from 1, of the character at `offset`."""
        if self._line_starts is None:
            self._line_starts = [0, *(match.end() for match in re.finditer("\n", self.text))]
        line = bisect_right(self._line_starts, offset)
        return line, offset - self._line_starts[line - 1] + 1


class Token:
    r"""A word of a Slice file.

    `doc` is the doc comment before the token, `trailing_doc` one of the form `/**< */` behind it; both are
    raw text without the marks of the comment. `escaped` tells a name written with a backslash: `\module`.
    """

    __slots__ = ("doc", "escaped", "kind", "offset", "source", "text", "trailing_doc")

    def __init__(self, kind: Kind, text: str, source: Source, offset: int, doc: str | None = None) -> None:
        self.kind = kind
        self.text = text
        self.source = source
        self.offset = offset
        self.doc = doc
        self.trailing_doc: str | None = None
        self.escaped = False

    @property
    def location(self) -> Location:
        """Where the token stands."""
        line, column = self.source.position(self.offset)
        first_line = self.text.partition("\n")[0]
        return Location(self.source.path, line, column, max(1, len(first_line) + self.escaped))

    def moved_to(self, place: Token) -> Token:
        """Return this token as if it stood where `place` stands, for what a macro expands to."""
        moved = Token(self.kind, self.text, place.source, place.offset, self.doc)
        moved.escaped = self.escaped
        return moved


_TOKEN = re.compile(
    r"""
      (?P<space>   (?: \s | \\\n )+ )
    | (?P<comment> //(?: \\\n | [^\n] )* | /\*.*?\*/ )
    | (?P<word>    \\?[A-Za-z_][A-Za-z_0-9]* )
    | (?P<mark>    :: | \[\[ | \]\] | [{}()\[\]<>,;:=*] )
    | (?P<float>   [+-]? (?: (?:\d+\.\d*|\.\d+)(?:[eE][+-]?\d+)? | \d+[eE][+-]?\d+ )[fF]?(?!\w) )
    | (?P<integer> [+-]? (?: 0x[0-9a-fA-F]+ | \d+ ) (?!\w) )
    | (?P<string>  "(?:[^"\\\x00-\x1f\x7f]|\\(?:[^\x00-\x1f\x7f]|\n))*" )
    | (?P<hash>    \#(?: /\*.*?(?:\*/|\Z) | \\\n | [^\n] )* )
    | (?P<open>    " [^\n]* | /\*.* )
    | (?P<junk>    [+-]?\d\w* | [^\s\w"#/{}()\[\]<>,;:=*]+ | . )
    """,
    re.VERBOSE | re.DOTALL | re.ASCII,
)
_DOC_COMMENT = re.compile(r"/\*\*(?!/|\*\*)|//[/!](?!/)")


def _tokenize(source: Source) -> list[Token]:
    tokens: list[Token] = []
    text = source.text
    doc: str | None = None
    for match in _TOKEN.finditer(text):
        group = match.lastgroup
        if group == "space":
            continue
        word = match.group()
        if group == "comment":
            if _DOC_COMMENT.match(word):
                doc = _note_doc_comment(word, doc, tokens)
            continue
        token = Token(_kind(group, word), word, source, match.start(), doc)
        doc = None
        if word[0] == "\\" and group == "word":
            token.text = word[1:]
            token.escaped = True
        elif group == "hash" and tokens and tokens[-1].offset > text.rfind("\n", 0, match.start()):
            token.kind = Kind.INVALID
            token.text = "#"
        tokens.append(token)
    tokens.append(Token(Kind.END, "", source, len(text)))
    return tokens


def _kind(group: str | None, word: str) -> Kind:
    if group == "word":
        return Kind.KEYWORD if word in KEYWORDS else Kind.NAME
    return _KINDS[group or "junk"]


_KINDS = {
    "space": Kind.SPACE,
    "comment": Kind.COMMENT,
    "mark": Kind.PUNCTUATION,
    "float": Kind.FLOAT,
    "integer": Kind.INTEGER,
    "string": Kind.STRING,
    "hash": Kind.DIRECTIVE,
    "open": Kind.UNTERMINATED,
    "junk": Kind.INVALID,
}


def _note_doc_comment(comment: str, pending: str | None, tokens: list[Token]) -> str | None:
    """Add a doc comment to the token before it, or return what the token after it is to get."""
    block = comment.startswith("/*")
    body = comment[3:-2] if block else comment[3:]
    if body.startswith("<"):
        if tokens:
            before = tokens[-1].trailing_doc
            tokens[-1].trailing_doc = body[1:] if before is None else f"{before}\n{body[1:]}"
        return pending
    return body if block or pending is None else f"{pending}\n{body}"
