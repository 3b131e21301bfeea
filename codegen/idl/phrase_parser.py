"""Read the phrases that definitions are made of: names, types, values, metadata."""

from __future__ import annotations

from collections import defaultdict

from codegen.diagnostics import Diagnostics, Note, did_you_mean

from . import ast
from .codes import Code
from .dialect import DEFAULT, Dialect
from .lexer import Kind, Source, Token
from .literals import LiteralError, parse_float, parse_integer, parse_string
from .name_rules import why_reserved
from .preprocessor import TranslationUnit
from .token_reader import TokenReader, shown

BUILTIN_TYPES = ("bool", "byte", "short", "int", "long", "float", "double", "string")
_TYPE_KEYWORDS = frozenset({*BUILTIN_TYPES, "Object", "LocalObject", "Value"})


class PhraseParser(TokenReader):
    """Reads what stands inside of definitions."""

    def __init__(self, unit: TranslationUnit, diagnostics: Diagnostics, dialect: Dialect) -> None:
        super().__init__(unit, diagnostics)
        self._dialect = dialect
        self._main_source = unit.source
        self._well_spelled: set[tuple[str, Source]] = set()
        self._file_metadata: defaultdict[Source, list[str]] = defaultdict(list)

    def _check_spelling(self, token: Token) -> None:
        """Report a reserved name; what only the dialect forbids is allowed in included files."""
        source = token.source
        if (token.text, source) in self._well_spelled:
            return
        self._well_spelled.add((token.text, source))
        dialect = self._dialect if source is self._main_source else DEFAULT
        reason = why_reserved(token.text, dialect, self._file_metadata[source])
        if reason:
            self._well_spelled.discard((token.text, source))
            self._diagnostics.error(Code.RESERVED_NAME, f"`{token.text}`: {reason}", token.location)

    def _name(self, what: str) -> Token:
        """Take the name of something that is being defined."""
        token = self._token
        if token.kind is Kind.KEYWORD:
            allowed = {"a member", "a parameter", "a member or an operation"}
            if token.text == "Value" and what in allowed and self._dialect.value_as_name:
                message = "`Value` is a keyword of Ice since 3.7"
                self._diagnostics.warning(Code.TOLERATED_KEYWORD, message, token.location)
                return self._advance()
            note = Note(f"a backslash makes it a name: `\\{token.text}`")
            message = f"the keyword `{token.text}` cannot be the name of {what}"
            self._diagnostics.error(Code.KEYWORD_AS_NAME, message, token.location, [note])
            return self._advance()
        if token.kind is not Kind.NAME:
            self._fail(f"expected the name of {what}, found {shown(token)}")
        self._check_spelling(token)
        return self._advance()

    def _scoped_name(self, what: str) -> tuple[str, Token]:
        """Take `A`, `A::B` or `::A::B`; return it with its last part, where errors point to."""
        start = self._token
        parts = [""] if self._accept("::") else []
        while True:
            token = self._token
            if token.kind is not Kind.NAME and not (token.kind is Kind.KEYWORD and parts):
                notes = did_you_mean(token.text, _TYPE_KEYWORDS) if token.kind is Kind.KEYWORD else ()
                self._fail(f"expected the name of {what}, found {shown(token)}", *notes)
            parts.append(self._advance().text)
            if not self._accept("::"):
                break
        end = token.offset + token.escaped + len(token.text)
        if len(parts) > 1 and token.source is start.source:
            written = start.source.text[start.offset : end]
            if any(character.isspace() for character in written):
                message = "a name with `::` has no space in it"
                self._diagnostics.error(Code.SYNTAX, message, start.location)
        self._check_spelling(token)
        return "::".join(parts), token

    def _list_of(self, what: str) -> list[ast.NamedType]:
        """Take names with commas between them."""
        names = [ast.NamedType(*self._scoped_name(what))]
        while self._accept(","):
            names.append(ast.NamedType(*self._scoped_name(what)))
        return names

    def _metadata(self) -> tuple[list[ast.Metadata], str | None]:
        """Take metadata in brackets, if there is any; return it with the doc comment before it."""
        doc = self._token.doc
        if not self._accept("["):
            return [], doc
        found = self._strings("metadata")
        self._expect("]", "behind metadata")
        return found, self._token.doc or doc

    def _strings(self, what: str) -> list[ast.Metadata]:
        """Take strings with commas between them; adjacent strings are one."""
        found: list[ast.Metadata] = []
        while True:
            token = self._token
            if token.kind is not Kind.STRING:
                self._fail(f"expected {what} in quotes, found {shown(token)}")
            text = self._string()
            while self._token.kind is Kind.STRING:
                text += self._string()
            found.append(ast.Metadata(text, token))
            if not self._accept(","):
                return found

    def _string(self) -> str:
        token = self._advance()
        try:
            text, unknown = parse_string(token.text)
        except LiteralError as error:
            self._diagnostics.error(Code.BAD_LITERAL, str(error), token.location)
            return ""
        if "\N{REPLACEMENT CHARACTER}" in text and "\N{REPLACEMENT CHARACTER}" not in token.text:
            message = "the escapes of this string are not UTF-8; what is not is replaced"
            self._diagnostics.warning(Code.NOT_UTF8_ESCAPES, message, token.location)
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
        if isinstance(kind, ast.BuiltinType) and kind.name != "Object":
            return kind
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
