"""Read the phrases that definitions are made of: names, types, values, metadata."""

from __future__ import annotations

from codegen.diagnostics import Note, did_you_mean

from . import ast
from .codes import Code
from .lexer import Kind, Token
from .literals import LiteralError, parse_float, parse_integer, parse_string
from .token_reader import TokenReader, shown

BUILTIN_TYPES = ("bool", "byte", "short", "int", "long", "float", "double", "string")
_TYPE_KEYWORDS = frozenset({*BUILTIN_TYPES, "Object", "LocalObject", "Value"})


class PhraseParser(TokenReader):
    """Reads what stands inside of definitions."""

    def _name(self, what: str) -> Token:
        """Take the name of something that is being defined."""
        token = self._token
        if token.kind is Kind.KEYWORD:
            if token.text == "Value" and what in {"a member", "a parameter"}:
                message = "`Value` is a keyword of Ice since 3.7"
                self._diagnostics.warning(Code.TOLERATED_KEYWORD, message, token.location)
                return self._advance()
            note = Note(f"a backslash makes it a name: `\\{token.text}`")
            message = f"the keyword `{token.text}` cannot be the name of {what}"
            self._diagnostics.error(Code.KEYWORD_AS_NAME, message, token.location, [note])
            return self._advance()
        if token.kind is not Kind.NAME:
            self._fail(f"expected the name of {what}, found {shown(token)}")
        return self._advance()

    def _scoped_name(self, what: str) -> tuple[str, Token]:
        """Take `A`, `A::B` or `::A::B`; return it with its last part, where errors point to."""
        parts = [""] if self._accept("::") else []
        while True:
            token = self._token
            if token.kind is not Kind.NAME:
                notes = did_you_mean(token.text, _TYPE_KEYWORDS) if token.kind is Kind.KEYWORD else ()
                self._fail(f"expected the name of {what}, found {shown(token)}", *notes)
            parts.append(self._advance().text)
            if not self._accept("::"):
                return "::".join(parts), token

    def _list_of(self, what: str) -> list[ast.NamedType]:
        """Take names with commas between them."""
        names = [ast.NamedType(*self._scoped_name(what))]
        while self._accept(","):
            names.append(ast.NamedType(*self._scoped_name(what)))
        return names

    def _metadata(self) -> tuple[list[ast.Metadata], str | None]:
        """Take metadata in brackets, if there is any; return it with the doc comment before it."""
        found: list[ast.Metadata] = []
        doc = self._token.doc
        while self._at("["):
            self._advance()
            while True:
                token = self._token
                text = self._string()
                while self._token.kind is Kind.STRING:  # adjacent strings are one
                    text += self._string()
                found.append(ast.Metadata(text, token))
                if not self._accept(","):
                    break
            self._expect("]", "behind metadata")
        return found, self._token.doc or doc

    def _string(self) -> str:
        if self._token.kind is not Kind.STRING:
            self._fail(f"expected a string, found {shown(self._token)}")
        token = self._advance()
        try:
            text, unknown = parse_string(token.text)
        except LiteralError as error:
            self._diagnostics.error(Code.BAD_LITERAL, str(error), token.location)
            return ""
        for escape in unknown:
            message = f"unknown escape `{escape}` is kept as it is"
            self._diagnostics.warning(Code.UNKNOWN_ESCAPE, message, token.location)
        return text

    def _tag(self) -> ast.Literal | None:
        """Take `optional(n)`; return its number or the name of one."""
        token = self._accept("optional")
        if token is None:
            return None
        if not self._accept("("):
            self._fail("`optional` needs the number of its tag: `optional(1)`", token=token)
        if self._at(")"):
            self._fail("`optional` needs the number of its tag: `optional(1)`")
        tag = self._number("the number of the tag")
        self._expect(")", "behind the tag")
        return tag

    def _number(self, what: str) -> ast.Literal:
        """Take an integer, or the name of a constant or an enumerator."""
        if self._token.kind not in {Kind.INTEGER, Kind.NAME} and not self._at("::"):
            self._fail(f"expected {what}, found {shown(self._token)}")
        return self._literal()

    def _type(self, what: str) -> ast.Type:
        token = self._token
        kind: ast.BuiltinType | ast.NamedType
        if token.kind is Kind.KEYWORD and token.text in _TYPE_KEYWORDS:
            self._advance()
            kind = ast.BuiltinType(token.text, token)
        elif token.kind is Kind.KEYWORD:
            self._fail(f"expected {what}, found {shown(token)}")
        elif token.kind is Kind.NAME or self._at("::"):
            kind = ast.NamedType(*self._scoped_name("a type"))
        else:
            self._fail(f"expected {what}, found {shown(token)}")
        star = self._accept("*")
        return ast.ProxyType(kind, star) if star else kind

    def _literal(self) -> ast.Literal:
        """Take a literal or the name of a constant or an enumerator."""
        token = self._token
        try:
            if token.kind is Kind.INTEGER:
                return ast.Literal(self._advance(), parse_integer(token.text))
            if token.kind is Kind.FLOAT:
                return ast.Literal(self._advance(), parse_float(token.text))
        except LiteralError as error:
            self._diagnostics.error(Code.BAD_LITERAL, str(error), token.location)
            return ast.Literal(token)
        if token.kind is Kind.STRING:
            return ast.Literal(token, self._string())
        if token.kind is Kind.KEYWORD and token.text in {"true", "false"}:
            return ast.Literal(self._advance(), token.text == "true")
        if token.kind is Kind.NAME or self._at("::"):
            name, last = self._scoped_name("a constant or an enumerator")
            return ast.Literal(last, name=name)
        return self._fail(f"expected a value, found {shown(token)}")
