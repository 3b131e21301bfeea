"""Parse a translation unit into a tree; after an error, continue at the next `;` or `}`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NoReturn, TypeVar

from codegen.diagnostics import Diagnostics, Location, Note, did_you_mean

from . import ast
from .lexer import LiteralError, Source, Token, TokenKind, parse_float, parse_integer, parse_string
from .report import Code, SourceReport, note_at

_TYPE_KEYWORDS = frozenset({*ast.BUILTIN_TYPES, "LocalObject", "Object", "Value"})
_NEVER_LOCAL = frozenset({"const", "module"})
_RESERVED_SUFFIXES = ("Helper", "Holder", "Prx", "Ptr")
_DEEPEST_MODULE = 50

_NO_OPERATIONS = "a struct or exception cannot have operations; use an interface"
_NO_MEMBERS = "an interface cannot have data members; use a struct or class"

_Item = TypeVar("_Item")


class _SliceSyntaxError(Exception):
    """A syntax error that has been reported; parsing continues after it."""


def parse(tokens: Sequence[Token], diagnostics: Diagnostics) -> ast.Module:
    """Return the root module of a translation unit, without definitions that have syntax errors."""
    return _Parser(tokens, diagnostics).root()


class _Parser:
    def __init__(self, tokens: Sequence[Token], diagnostics: Diagnostics) -> None:
        self._tokens = tokens
        self._next = 0
        self._token = tokens[0]
        self._diagnostics = diagnostics
        self._report = SourceReport(diagnostics)
        self._depth = 0
        self._sources_with_modules: set[Source] = set()
        self._well_spelled: set[str] = set()
        self._reported_end = False
        self._readers: dict[str, Callable[[], ast.Definition]] = {
            "class": self._class,
            "const": self._constant,
            "dictionary": self._dictionary,
            "enum": self._enumeration,
            "exception": self._exception,
            "interface": self._interface,
            "module": self._module,
            "sequence": self._sequence,
            "struct": self._struct,
        }

    # Definitions

    def root(self) -> ast.Module:
        """Parse the whole unit."""
        root = ast.Module("", self._token)
        while not self._at_end():
            self._read_into(root.definitions, self._definition)
        return root

    def _definition(self) -> ast.Definition | None:
        if self._at("[["):
            self._metadata_of_file()
            return None
        metadata, doc = self._metadata()
        local = self._accept("local") is not None
        token = self._token
        read = self._readers.get(token.text) if token.kind is TokenKind.KEYWORD else None
        if read is None or (local and token.text in _NEVER_LOCAL):
            notes = did_you_mean(token.text, self._readers) if token.kind is TokenKind.NAME else ()
            self._fail(f"expected a definition, found {_shown(token)}", *notes)
        self._advance()
        definition = read()
        definition.doc = doc or self._previous.trailing_doc
        definition.metadata += metadata
        definition.local = local
        return definition

    def _metadata_of_file(self) -> None:
        """Parse `[["..."]]`, which is for the generators of other languages."""
        opening = self._advance()
        self._strings("metadata of the file")
        self._expect("]]", "after metadata of the file")
        if opening.source in self._sources_with_modules:
            self._report.error(Code.SYNTAX, "metadata of the file must come before all definitions", opening)

    def _module(self) -> ast.Module:
        if self._token.kind is TokenKind.KEYWORD:
            self._fail(f"the keyword `{self._token.text}` cannot be the name of a module")
        name = self._name("a module")
        self._sources_with_modules.add(name.source)
        module = ast.Module(name.text, name)
        self._depth += 1
        if self._depth > _DEEPEST_MODULE:
            self._depth -= 1
            self._fail("modules are nested too deeply", token=name)
        try:
            if self._accept("::"):  # as in Ice 3.8
                module.definitions.append(self._module())
                return module
            module.definitions += self._block(self._definition, f"module {name.text}")
        finally:
            self._depth -= 1
        self._accept(";")
        return module

    def _struct(self) -> ast.Struct:
        name = self._name("a struct")
        found_before = len(self._diagnostics)
        members, _ = self._body(f"struct {name.text}", operations=False)
        if not members and len(self._diagnostics) == found_before:
            self._report_empty(f"struct `{name.text}` has no member", name)
        self._accept(";")
        return ast.Struct(name.text, name, members=members)

    def _class(self) -> ast.Class | ast.ForwardDeclaration:
        name = self._name("a class")
        if self._accept(";"):
            return ast.ForwardDeclaration(name.text, name, of=ast.Class)
        class_ = ast.Class(name.text, name)
        if self._accept("("):
            class_.compact_id = self._number("the compact id")
            self._expect(")", "after the compact id")
        class_.base = self._base("a class")
        if self._accept("implements"):
            class_.implements += self._list_of("an interface")
        class_.members, class_.operations = self._body(f"class {name.text}")
        self._accept(";")
        return class_

    def _exception(self) -> ast.ExceptionType:
        name = self._name("an exception")
        base = self._base("an exception")
        members, _ = self._body(f"exception {name.text}", operations=False)
        self._accept(";")
        return ast.ExceptionType(name.text, name, base=base, members=members)

    def _interface(self) -> ast.Interface | ast.ForwardDeclaration:
        name = self._name("an interface")
        if self._accept(";"):
            return ast.ForwardDeclaration(name.text, name, of=ast.Interface)
        bases = self._list_of("an interface") if self._accept_extends() else []
        _, operations = self._body(f"interface {name.text}", members=False)
        self._accept(";")
        return ast.Interface(name.text, name, bases=bases, operations=operations)

    def _accept_extends(self) -> bool:
        """Accept `extends`, or the `:` of Ice 3.8."""
        return self._accept("extends") is not None or self._accept(":") is not None

    def _base(self, what: str) -> ast.NamedType | None:
        return ast.NamedType(*self._scoped_name(what)) if self._accept_extends() else None

    def _enumeration(self) -> ast.Enumeration:
        name = self._name("an enumeration")
        opening = self._expect("{", f"before the body of enum {name.text}")
        found_before = len(self._diagnostics)
        enumeration = ast.Enumeration(name.text, name)
        while not self._at("}"):
            if self._at_end():
                self._report_end(f"enum {name.text}", opening)
                return enumeration
            if self._accept(","):
                continue
            try:
                enumeration.enumerators.append(self._enumerator(enumeration))
            except _SliceSyntaxError:
                while not (self._at(",") or self._at("}") or self._at_end()):
                    self._advance()
        self._advance()
        if not enumeration.enumerators and len(self._diagnostics) == found_before:
            self._report_empty(f"enumeration `{name.text}` has no enumerator", name)
        self._accept(";")
        return enumeration

    def _enumerator(self, enumeration: ast.Enumeration) -> ast.Enumerator:
        _, doc = self._metadata()
        name = self._name("an enumerator")
        literal = self._literal() if self._accept("=") else None
        if not (self._at(",") or self._at("}") or self._at_end()):
            self._fail(f"expected `,` or `}}` after an enumerator, found {_shown(self._token)}")
        doc = doc or self._previous.trailing_doc
        if self._at(","):
            doc = doc or self._token.trailing_doc
        return ast.Enumerator(name.text, name, doc, literal=literal, enumeration=enumeration)

    def _report_empty(self, message: str, name: Token) -> None:
        self._report.error(Code.NO_MEMBER, message, self._previous, note_at("it starts here", name))

    def _sequence(self) -> ast.Sequence:
        self._expect("<", "after `sequence`")
        metadata, _ = self._metadata()
        element = self._type("an element type")
        self._expect(">", "after the element type")
        name = self._name("a sequence")
        self._expect_end_of_statement("a sequence")
        return ast.Sequence(name.text, name, metadata=metadata, element=element)

    def _dictionary(self) -> ast.Dictionary:
        self._expect("<", "after `dictionary`")
        metadata, _ = self._metadata()
        key = self._type("a key type")
        self._expect(",", "between the types of a dictionary")
        metadata += self._metadata()[0]
        value = self._type("a value type")
        self._expect(">", "after the value type")
        name = self._name("a dictionary")
        self._expect_end_of_statement("a dictionary")
        return ast.Dictionary(name.text, name, metadata=metadata, key=key, value=value)

    def _constant(self) -> ast.Constant:
        metadata, _ = self._metadata()
        kind = self._type("the type of a constant")
        if self._token.kind is TokenKind.KEYWORD:
            self._fail(f"the keyword `{self._token.text}` cannot be the name of a constant")
        name = self._name("a constant")
        self._expect("=", "after the name of a constant")
        literal = self._literal()
        self._expect_end_of_statement("a constant")
        return ast.Constant(name.text, name, metadata=metadata, type=kind, literal=literal)

    # Bodies: members, operations and their parameters

    def _body(
        self, what: str, *, members: bool = True, operations: bool = True
    ) -> tuple[list[ast.Member], list[ast.Operation]]:
        """Parse the body of a definition that can have members, operations or both."""
        items = self._block(lambda: self._member_or_operation(members=members, operations=operations), what)
        return (
            [item for item in items if isinstance(item, ast.Member)],
            [item for item in items if isinstance(item, ast.Operation)],
        )

    def _member_or_operation(self, *, members: bool, operations: bool) -> ast.Member | ast.Operation:
        """Parse a member or, with a parenthesis after its name, an operation."""
        what = "a member or an operation"
        if not operations:
            what = "a member"
        elif not members:
            what = "an operation"
        metadata, doc = self._metadata()
        if self._at("idempotent") and not operations:
            self._fail(_NO_OPERATIONS)
        idempotent = self._accept("idempotent") is not None
        tag = self._tag()
        if self._at("void") and not operations:
            self._fail(_NO_OPERATIONS)
        if self._at("void") and tag is not None:
            self._fail("`void` cannot be optional")
        kind = None if self._accept("void") else self._type(f"the type of {what}")
        name = self._name(what)
        if self._at("("):
            if not operations:
                self._fail(_NO_OPERATIONS, token=name)
            operation = ast.Operation(name.text, name, doc, metadata, returns=kind, return_tag=tag)
            operation.idempotent = idempotent
            operation.parameters = self._parameters()
            operation.throws = self._list_of("an exception") if self._accept("throws") else []
            end = self._expect_end_of_statement("an operation")
            operation.doc = doc or end.trailing_doc
            return operation
        if not members and (self._at(";") or self._at("=")):
            self._fail(_NO_MEMBERS, token=name)
        if kind is None or idempotent or not members:
            self._fail(f"expected `(` after the name of an operation, found {_shown(self._token)}")
        default = self._literal() if self._accept("=") else None
        end = self._expect_end_of_statement("a member")
        doc = doc or end.trailing_doc
        return ast.Member(name.text, name, doc, metadata, type=kind, default=default, tag=tag)

    def _parameters(self) -> list[ast.Parameter]:
        opening = self._advance()
        parameters: list[ast.Parameter] = []
        while not self._at(")"):
            parameters.append(self._parameter())
            if not self._accept(","):
                break
            if self._at(")"):
                self._fail(f"expected a parameter after `,`, found {_shown(self._token)}")
        if not self._at(")"):
            begin = note_at("the parameters start here", opening)
            self._fail(f"expected `,` or `)` after a parameter, found {_shown(self._token)}", begin)
        self._advance()
        return parameters

    def _parameter(self) -> ast.Parameter:
        doc = self._token.doc
        out = self._accept("out") is not None
        metadata, _ = self._metadata()
        tag = self._tag()
        kind = self._type("the type of a parameter")
        name = self._name("a parameter")
        doc = doc or name.trailing_doc
        return ast.Parameter(name.text, name, doc, metadata, type=kind, out=out, tag=tag)

    # Parts of definitions: names, types, values, metadata

    def _name(self, what: str) -> Token:
        """Parse the name in a definition."""
        token = self._token
        if token.kind is TokenKind.KEYWORD:
            if token.text == "Value" and what in {"a member", "a parameter", "a member or an operation"}:
                self._report.warning(Code.TOLERATED_KEYWORD, "`Value` is a keyword of Ice since 3.7", token)
                return self._advance()
            note = note_at(f"a backslash makes it a name: `\\{token.text}`")
            message = f"the keyword `{token.text}` cannot be the name of {what}"
            self._report.error(Code.KEYWORD_AS_NAME, message, token, note)
            return self._advance()
        if token.kind is not TokenKind.NAME:
            self._fail(f"expected the name of {what}, found {_shown(token)}")
        self._check_spelling(token)
        return self._advance()

    def _check_spelling(self, token: Token) -> None:
        name = token.text
        if name in self._well_spelled:
            return
        suffix = next((each for each in _RESERVED_SUFFIXES if name.endswith(each)), None)
        if suffix is not None:
            reason = f"the suffix `{suffix}` is reserved"
        elif name.startswith("_") or name.endswith("_") or "__" in name:
            reason = "a name cannot start or end with an underscore, or have two in a row"
        else:
            self._well_spelled.add(name)
            return
        self._report.error(Code.RESERVED_NAME, f"`{name}`: {reason}", token)

    def _scoped_name(self, what: str) -> tuple[str, Token]:
        """Parse `A`, `A::B` or `::A::B`; return it with its last token, for the place of errors."""
        start = self._token
        parts = [""] if self._accept("::") else []
        while True:
            token = self._token
            if token.kind is not TokenKind.NAME and not (token.kind is TokenKind.KEYWORD and parts):
                notes = did_you_mean(token.text, _TYPE_KEYWORDS) if token.kind is TokenKind.KEYWORD else ()
                self._fail(f"expected the name of {what}, found {_shown(token)}", *notes)
            parts.append(self._advance().text)
            if not self._accept("::"):
                break
        end = token.offset + token.escaped + len(token.text)
        if len(parts) > 1 and token.source is start.source:
            written = start.source.text[start.offset : end]
            if any(character.isspace() for character in written):
                self._report.error(Code.SYNTAX, "a name with `::` cannot contain spaces", start)
        self._check_spelling(token)
        return "::".join(parts), token

    def _list_of(self, what: str) -> list[ast.NamedType]:
        """Parse names that are separated by commas."""
        names = [ast.NamedType(*self._scoped_name(what))]
        while self._accept(","):
            names.append(ast.NamedType(*self._scoped_name(what)))
        return names

    def _type(self, what: str) -> ast.Type:
        token = self._token
        kind: ast.BuiltinType | ast.NamedType
        if token.kind is TokenKind.KEYWORD and token.text in _TYPE_KEYWORDS:
            self._advance()
            kind = ast.BuiltinType(token.text, token)
        elif token.kind is TokenKind.NAME or self._at("::"):
            kind = ast.NamedType(*self._scoped_name("a type"))
        else:
            self._fail(f"expected {what}, found {_shown(token)}")
        if isinstance(kind, ast.BuiltinType) and kind.name != "Object":
            return kind
        star = self._accept("*")
        return ast.ProxyType(kind, star) if star else kind

    def _metadata(self) -> tuple[list[ast.Metadata], str | None]:
        """Parse metadata in brackets, if there is any; return it with the doc comment before it."""
        doc = self._token.doc
        if not self._accept("["):
            return [], doc
        found = self._strings("metadata")
        self._expect("]", "after metadata")
        return found, self._token.doc or doc

    def _strings(self, what: str) -> list[ast.Metadata]:
        """Parse strings that are separated by commas; adjacent strings are joined."""
        found: list[ast.Metadata] = []
        while True:
            token = self._token
            if token.kind is not TokenKind.STRING:
                self._fail(f"expected {what} in quotes, found {_shown(token)}")
            text = self._string()
            while self._token.kind is TokenKind.STRING:
                text += self._string()
            found.append(ast.Metadata(text, token))
            if not self._accept(","):
                return found

    def _string(self) -> str:
        token = self._advance()
        try:
            text, unknown = parse_string(token.text)
        except LiteralError as error:
            self._report.error(Code.BAD_LITERAL, str(error), token)
            return ""
        if "\N{REPLACEMENT CHARACTER}" in text and "\N{REPLACEMENT CHARACTER}" not in token.text:
            message = "the escapes of this string are not UTF-8; invalid bytes are replaced"
            self._report.warning(Code.NOT_UTF8_ESCAPES, message, token)
        for escape in unknown:
            self._report.warning(Code.UNKNOWN_ESCAPE, f"unknown escape `{escape}` is kept", token)
        return text

    def _tag(self) -> ast.Literal | None:
        """Parse `optional(n)`; return its number, or the name of one."""
        token = self._accept("optional")
        if token is None:
            return None
        if not self._accept("("):
            self._fail("`optional` needs the number of its tag: `optional(1)`", token=token)
        if self._at(")"):
            self._fail("`optional` needs the number of its tag: `optional(1)`")
        tag = self._number("the number of the tag")
        self._expect(")", "after the tag")
        return tag

    def _number(self, what: str) -> ast.Literal:
        """Parse an integer, or the name of a constant or an enumerator."""
        if self._token.kind not in {TokenKind.INTEGER, TokenKind.NAME} and not self._at("::"):
            self._fail(f"expected {what}, found {_shown(self._token)}")
        return self._literal()

    def _literal(self) -> ast.Literal:
        """Parse a literal, or the name of a constant or an enumerator."""
        token = self._token
        try:
            if token.kind is TokenKind.INTEGER:
                return ast.Literal(self._advance(), parse_integer(token.text))
            if token.kind is TokenKind.FLOAT:
                return ast.Literal(self._advance(), parse_float(token.text))
        except LiteralError as error:
            self._report.error(Code.BAD_LITERAL, str(error), token)
            return ast.Literal(token)
        if token.kind is TokenKind.STRING:
            return ast.Literal(token, self._string())
        if token.kind is TokenKind.KEYWORD and token.text in {"true", "false"}:
            return ast.Literal(self._advance(), token.text == "true")
        if token.kind is TokenKind.NAME or self._at("::"):
            name, last = self._scoped_name("a constant or an enumerator")
            return ast.Literal(last, name=name)
        return self._fail(f"expected a value, found {_shown(token)}")

    # Tokens

    def _advance(self) -> Token:
        token = self._token
        if token.kind is not TokenKind.END:
            self._next += 1
            self._token = self._tokens[self._next]
        return token

    @property
    def _previous(self) -> Token:
        """The last token that was consumed."""
        return self._tokens[self._next - 1]

    def _at_end(self) -> bool:
        return self._token.kind is TokenKind.END

    def _at(self, text: str) -> bool:
        token = self._token
        return token.text == text and (token.kind is TokenKind.PUNCTUATION or token.kind is TokenKind.KEYWORD)

    def _accept(self, text: str) -> Token | None:
        return self._advance() if self._at(text) else None

    def _expect(self, text: str, where: str) -> Token:
        if not self._at(text):
            self._fail(f"expected `{text}` {where}, found {_shown(self._token)}")
        return self._advance()

    def _expect_end_of_statement(self, what: str) -> Token:
        """Expect the `;` after a statement; at the end of a line, continue without it."""
        if self._at(";"):
            return self._advance()
        last = self._previous
        line, column = last.source.position(last.offset + len(last.text))
        note = note_at("it is missing here", Location(last.source.path, line, column))
        message = f"expected `;` after {what}, found {_shown(self._token)}"
        self._report.error(Code.SYNTAX, message, self._token, note)
        if self._at("}") or line != self._token.location.line:
            return last
        raise _SliceSyntaxError

    def _fail(self, message: str, *notes: Note, token: Token | None = None) -> NoReturn:
        self._report.error(Code.SYNTAX, message, token or self._token, *notes)
        raise _SliceSyntaxError

    # Bodies, and recovery after an error

    def _block(self, read_item: Callable[[], _Item | None], what: str) -> list[_Item]:
        """Parse `{`, items and `}`; an item with a syntax error is reported and left out."""
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
        """Parse one item; after an error, skip it, but at least one token."""
        before = self._next
        try:
            item = read_item()
            if item is not None:
                items.append(item)
        except _SliceSyntaxError:
            self._recover(self._tokens[before].source)
            if self._next == before:
                self._advance()

    def _recover(self, source: Source) -> None:
        """Skip past the next `;` or before the next `}`, over whole blocks, but not out of a file."""
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

    def _report_end(self, what: str, opening: Token) -> None:
        """Report the first body without an end."""
        if not self._reported_end:
            self._reported_end = True
            message = f"expected `}}` after the body of {what}, found the end of the file"
            self._report.error(Code.SYNTAX, message, self._token, note_at("the body starts here", opening))


def _shown(token: Token) -> str:
    """Return a token for messages."""
    if token.kind is TokenKind.END:
        return "the end of the file"
    if token.kind is TokenKind.KEYWORD:
        return f"the keyword `{token.text}`"
    return f"`{token.text if len(token.text) <= 40 else token.text[:40] + '...'}`"
