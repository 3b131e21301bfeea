"""Split the text of a Slice file into tokens with their place and doc comment, and evaluate literals."""

from __future__ import annotations

import math
import re
from bisect import bisect_right
from enum import Enum
from functools import cached_property
from pathlib import Path

from codegen.diagnostics import Location

KEYWORDS = frozenset(
    """
    bool byte class const dictionary double enum exception extends false float idempotent implements int
    interface local LocalObject long module Object optional out sequence short string struct throws true Value
    void
    """.split()  # noqa: SIM905 - a list of words is easier to read than of literals
)


class TokenKind(Enum):
    """The kind of a token; the values are names of groups in the regular expression."""

    NAME = "name"
    KEYWORD = "keyword"
    INTEGER = "integer"
    FLOAT = "float"
    STRING = "string"
    PUNCTUATION = "punctuation"
    DIRECTIVE = "directive"
    INVALID = "invalid"
    UNTERMINATED = "unterminated"
    """A string or a comment without an end."""
    END = "end"
    """The end of the file."""


class Source:
    """A source file: its path as given, and its text."""

    def __init__(self, path: Path, text: str) -> None:
        self.path = path
        self.text = text

    @cached_property
    def tokens(self) -> list[Token]:
        """The tokens of the file with unresolved directives; the last one is of kind END."""
        return _tokenize(self)

    @cached_property
    def _line_starts(self) -> list[int]:
        return [0, *(match.end() for match in re.finditer("\n", self.text))]

    def position(self, offset: int) -> tuple[int, int]:
        """Return the line and column of the character at `offset`, counted from 1."""
        line = bisect_right(self._line_starts, offset)
        return line, offset - self._line_starts[line - 1] + 1


class Token:
    r"""A token of a Slice file.

    `doc` is the doc comment before the token, `trailing_doc` one of the form `/**< */` after it; both are
    raw text without the marks of the comment. `escaped` marks a name written with a backslash: `\module`.
    """

    __slots__ = ("doc", "escaped", "kind", "offset", "source", "text", "trailing_doc")

    def __init__(
        self, kind: TokenKind, text: str, source: Source, offset: int, doc: str | None = None
    ) -> None:
        self.kind = kind
        self.text = text
        self.source = source
        self.offset = offset
        self.doc = doc
        self.trailing_doc: str | None = None
        self.escaped = False

    @property
    def location(self) -> Location:
        """Its place in the file."""
        line, column = self.source.position(self.offset)
        first_line = self.text.partition("\n")[0]
        return Location(self.source.path, line, column, max(1, len(first_line) + self.escaped))


_TOKEN = re.compile(
    r"""
      (?P<space>        (?: \s | \\\n )+ )
    | (?P<comment>      //(?: \\\n | [^\n] )* | /\*.*?\*/ )
    | (?P<name>         \\?[A-Za-z_][A-Za-z_0-9]* )
    | (?P<punctuation>  :: | \[\[ | \]\] | [{}()\[\]<>,;:=*] )
    | (?P<float>        [+-]? (?: (?:\d+\.\d*|\.\d+)(?:[eE][+-]?\d+)? | \d+[eE][+-]?\d+ )[fF]?(?!\w) )
    | (?P<integer>      [+-]? (?: 0x[0-9a-fA-F]+ | \d+ ) (?!\w) )
    | (?P<string>       "(?:[^"\\\x00-\x1f\x7f]|\\(?:[^\x00-\x1f\x7f]|\n))*" )
    | (?P<directive>    \#(?: /\*.*?(?:\*/|\Z) | \\\n | [^\n] )* )
    | (?P<unterminated> " [^\n]* | /\*.* )
    | (?P<invalid>      [+-]?\d\w* | [^\s\w"#/{}()\[\]<>,;:=*]+ | . )
    """,
    re.VERBOSE | re.DOTALL | re.ASCII,
)
_DOC_COMMENT = re.compile(r"/\*\*(?!/|\*\*)|//[/!](?!/)")


def _tokenize(source: Source) -> list[Token]:
    tokens: list[Token] = []
    text = source.text
    doc: list[str] = []
    trailing: list[str] = []
    for match in _TOKEN.finditer(text):
        group, word = match.lastgroup, match.group()
        if group == "space":
            continue
        if group == "comment":
            if _DOC_COMMENT.match(word):
                _note_doc_comment(word, doc, trailing)
            continue
        if tokens:
            tokens[-1].trailing_doc = _joined(trailing)
        kind = TokenKind.KEYWORD if word in KEYWORDS else TokenKind(group)
        token = Token(kind, word, source, match.start(), _joined(doc))
        doc, trailing = [], []
        if kind is TokenKind.NAME and word[0] == "\\":
            token.text = word[1:]
            token.escaped = True
        elif (
            kind is TokenKind.DIRECTIVE and tokens and tokens[-1].offset > text.rfind("\n", 0, match.start())
        ):
            token.kind = TokenKind.INVALID
            token.text = "#"
        tokens.append(token)
    if tokens:
        tokens[-1].trailing_doc = _joined(trailing)
    tokens.append(Token(TokenKind.END, "", source, len(text)))
    return tokens


def _note_doc_comment(comment: str, doc: list[str], trailing: list[str]) -> None:
    """Add a doc comment to those of the previous token, or to those for the next one."""
    block = comment.startswith("/*")
    body = comment[3:-2] if block else comment[3:]
    if body.startswith("<"):
        trailing.append(body[1:])
        return
    if block:
        doc.clear()
    doc.append(body)


def _joined(comments: list[str]) -> str | None:
    return "\n".join(comments) if comments else None


# Literals

_MOST_DIGITS = 400

_ESCAPE = re.compile(
    r"\\(?:([0-7]{1,3})|x([0-9a-fA-F]{1,2})|u([0-9a-fA-F]{4})|U([0-9a-fA-F]{8})|(.))", re.DOTALL
)
_SIMPLE_ESCAPES = {
    "n": "\n",
    "t": "\t",
    "v": "\v",
    "b": "\b",
    "r": "\r",
    "f": "\f",
    "a": "\a",
    "?": "?",
    "\\": "\\",
    "'": "'",
    '"': '"',
}


class LiteralError(Exception):
    """A literal is invalid."""


def parse_integer(text: str) -> int:
    """Return the value of a decimal, octal (`017`) or hexadecimal (`0x1f`) literal. Raises LiteralError."""
    digits = text.lstrip("+-")
    sign = -1 if text.startswith("-") else 1
    if len(digits) > _MOST_DIGITS:
        raise LiteralError(f"the integer has {len(digits)} digits")
    try:
        if digits.startswith("0x"):
            return sign * int(digits, 16)
        return sign * int(digits, 8 if len(digits) > 1 and digits[0] == "0" else 10)
    except ValueError:
        raise LiteralError(f"`{text}` is not an octal number") from None


def parse_float(text: str) -> float:
    """Return the value of a floating-point literal. Raises LiteralError if it is too large or too small."""
    digits = text.rstrip("fF")
    value = float(digits)
    if value == 0 and any(digit in "123456789" for digit in re.split("[eE]", digits)[0]):
        raise LiteralError(f"`{text[:20]}` is too small for a floating-point number")
    if math.isinf(value):
        raise LiteralError(f"`{text[:20]}` is too large for a floating-point number")
    return value


def parse_string(text: str) -> tuple[str, list[str]]:
    r"""Return the value of a quoted string literal, and its unknown escapes.

    Escapes of bytes above 127 (`\xe9`, `\303`) are bytes of UTF-8; invalid bytes become U+FFFD. An unknown
    escape is kept. Raises LiteralError for an escape that is neither a byte nor a character.
    """
    body = text[1:-1].replace("\\\n", "")  # a backslash continues the line
    if "\\" not in body:
        return body, []
    unknown: list[str] = []
    parts: list[bytes] = []
    position = 0
    for match in _ESCAPE.finditer(body):
        parts.append(body[position : match.start()].encode("utf-8", "surrogatepass"))
        parts.append(_escaped(match, unknown))
        position = match.end()
    parts.append(body[position:].encode("utf-8", "surrogatepass"))
    return b"".join(parts).decode(errors="replace"), unknown


def _escaped(match: re.Match[str], unknown: list[str]) -> bytes:
    octal, hexadecimal, short, long, simple = match.groups()
    if octal is not None or hexadecimal is not None:
        value = int(octal, 8) if octal is not None else int(hexadecimal, 16)
        if value > 255:
            raise LiteralError(f"the escape `{match.group()}` is larger than a byte")
        return bytes([value])
    if short is not None or long is not None:
        code_point = int(short or long, 16)
        if code_point > 0x10FFFF or 0xD800 <= code_point <= 0xDFFF:
            raise LiteralError(f"the escape `{match.group()}` is not a character")
        return chr(code_point).encode()
    if simple in {"x", "u", "U"}:
        raise LiteralError(f"the escape `{match.group()}` needs hexadecimal digits")
    if simple not in _SIMPLE_ESCAPES:
        unknown.append(match.group())
        return match.group().encode("utf-8", "surrogatepass")
    return _SIMPLE_ESCAPES[simple].encode()
