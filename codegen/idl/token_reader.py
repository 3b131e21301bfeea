"""Walk over the tokens of a translation unit: expect, report, and find back after an error."""

from __future__ import annotations

from collections.abc import Callable
from typing import NoReturn, TypeVar

from codegen.diagnostics import Diagnostics, Location, Note

from .codes import Code
from .lexer import Kind, Source, Token
from .preprocessor import TranslationUnit

_Item = TypeVar("_Item")


class SliceSyntaxError(Exception):
    """What is read does not follow the grammar; it has been reported, and reading goes on behind it."""


class TokenReader:
    """The present token, and what a parser does with it."""

    def __init__(self, unit: TranslationUnit, diagnostics: Diagnostics) -> None:
        self._tokens = unit.tokens
        self._next = 0
        self._token = unit.tokens[0]
        self._diagnostics = diagnostics
        self._reported_end = False

    def _advance(self) -> Token:
        token = self._token
        if token.kind is not Kind.END:
            self._next += 1
            self._token = self._tokens[self._next]
        return token

    @property
    def _previous(self) -> Token:
        """The token taken last."""
        return self._tokens[self._next - 1]

    def _at_end(self) -> bool:
        return self._token.kind is Kind.END

    def _at(self, text: str) -> bool:
        token = self._token
        return token.text == text and (token.kind is Kind.PUNCTUATION or token.kind is Kind.KEYWORD)

    def _accept(self, text: str) -> Token | None:
        return self._advance() if self._at(text) else None

    def _expect(self, text: str, where: str) -> Token:
        if not self._at(text):
            self._fail(f"expected `{text}` {where}, found {shown(self._token)}")
        return self._advance()

    def _expect_end_of_statement(self, what: str) -> Token:
        """Take the `;` behind a statement; at the end of a line reading goes on without one."""
        if self._at(";"):
            return self._advance()
        last = self._previous
        line, column = last.source.position(last.offset + len(last.text))
        note = Note("it is missing here", Location(last.source.path, line, column))
        message = f"expected `;` behind {what}, found {shown(self._token)}"
        self._diagnostics.error(Code.SYNTAX, message, self._token.location, [note])
        if self._at("}") or line != self._token.location.line:
            return last
        raise SliceSyntaxError

    def _fail(self, message: str, *notes: Note, token: Token | None = None) -> NoReturn:
        self._diagnostics.error(Code.SYNTAX, message, (token or self._token).location, notes)
        raise SliceSyntaxError

    def _recover(self, source: Source) -> None:
        """Skip to behind the next `;` or before the next `}`, over whole blocks, but not out of a file."""
        depth = 0
        while not self._at_end() and self._token.source is source:
            if self._at("{"):
                depth += 1
            elif self._at("}"):
                if depth == 0:
                    return
                depth -= 1
                if depth == 0:
                    self._advance()
                    self._accept(";")
                    return
            elif self._at(";") and depth == 0:
                self._advance()
                return
            self._advance()

    def _block(self, read_item: Callable[[], _Item | None], what: str) -> list[_Item]:
        """Read `{`, items and `}`; an item that cannot be read is reported and left out."""
        opening = self._expect("{", f"before the body of {what}")
        items: list[_Item] = []
        while not self._at("}"):
            if self._at_end():
                self._report_end(what, opening)
                return items
            self._read_into(items, read_item)
        self._advance()
        return items

    def _read_into(self, items: list[_Item], read_item: Callable[[], _Item | None]) -> None:
        """Read one item; after an error go on behind it, by one token at least."""
        before = self._next
        try:
            item = read_item()
            if item is not None:
                items.append(item)
        except SliceSyntaxError:
            self._recover(self._tokens[before].source)
            if self._next == before:
                self._advance()

    def _report_end(self, what: str, opening: Token) -> None:
        """Report the first body that the end of the file leaves open."""
        if not self._reported_end:
            self._reported_end = True
            note = Note("the body begins here", opening.location)
            message = f"expected `}}` behind the body of {what}, found the end of the file"
            self._diagnostics.error(Code.SYNTAX, message, self._token.location, [note])


def shown(token: Token) -> str:
    """Return a token as messages name it."""
    if token.kind is Kind.END:
        return "the end of the file"
    if token.kind is Kind.KEYWORD:
        return f"the keyword `{token.text}`"
    return f"`{token.text if len(token.text) <= 40 else token.text[:40] + '...'}`"
