"""Build the tree of a translation unit, and go on after an error at the next `;` or `}`."""

from __future__ import annotations

from collections.abc import Callable
from typing import NoReturn, TypeVar

from codegen.diagnostics import Diagnostics, Location, Note, did_you_mean

from . import ast
from .codes import Code
from .lexer import Kind, Source, Token
from .literals import LiteralError, parse_float, parse_integer, parse_string
from .preprocessor import TranslationUnit

_BUILTIN_TYPES = frozenset(
    ("bool", "byte", "short", "int", "long", "float", "double", "string", "Object", "LocalObject", "Value")
)
_DEFINITION_KEYWORDS = frozenset(
    (
        "class",
        "const",
        "dictionary",
        "enum",
        "exception",
        "interface",
        "local",
        "module",
        "sequence",
        "struct",
    )
)
_DEEPEST_MODULE = 50
_NO_OPERATIONS = "a struct, class or exception has no operations; put them into an interface"

_Item = TypeVar("_Item")


class _SyntaxError(Exception):
    """Reported already; caught where reading can go on."""


def parse(unit: TranslationUnit, diagnostics: Diagnostics) -> ast.Module:
    """Return the root module of a translation unit: what its files define, without what could not be read."""
    return _Parser(unit, diagnostics).root()


class _Parser:
    def __init__(self, unit: TranslationUnit, diagnostics: Diagnostics) -> None:
        self._tokens = unit.tokens
        self._next = 0
        self._token = unit.tokens[0]
        self._diagnostics = diagnostics
        self._depth = 0
        self._reported_end = False
        self._sources_with_definitions: set[Source] = set()

    # Tokens

    def _advance(self) -> Token:
        token = self._token
        if token.kind is not Kind.END:
            self._next += 1
            self._token = self._tokens[self._next]
        return token

    def _at_end(self) -> bool:
        return self._token.kind is Kind.END

    def _at(self, text: str) -> bool:
        token = self._token
        return token.text == text and (token.kind is Kind.PUNCTUATION or token.kind is Kind.KEYWORD)

    def _accept(self, text: str) -> Token | None:
        return self._advance() if self._at(text) else None

    def _expect(self, text: str, where: str) -> Token:
        if not self._at(text):
            self._fail(f"expected `{text}` {where}, found {_shown(self._token)}")
        return self._advance()

    def _expect_end_of_statement(self, what: str) -> Token:
        """Take the `;` behind a statement; at the end of a line reading goes on without one."""
        if self._at(";"):
            return self._advance()
        last = self._tokens[self._next - 1]
        line, column = last.source.position(last.offset + len(last.text))
        note = Note("it is missing here", Location(last.source.path, line, column))
        message = f"expected `;` behind {what}, found {_shown(self._token)}"
        self._diagnostics.error(Code.SYNTAX, message, self._token.location, [note])
        if self._at("}") or line != self._token.location.line:
            return last
        raise _SyntaxError

    def _fail(self, message: str, *notes: Note, token: Token | None = None) -> NoReturn:
        self._diagnostics.error(Code.SYNTAX, message, (token or self._token).location, notes)
        raise _SyntaxError

    def _recover(self) -> None:
        """Skip to behind the next `;` or before the next `}`, over whole blocks."""
        depth = 0
        while not self._at_end():
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
            before = self._next
            try:
                item = read_item()
                if item is not None:
                    items.append(item)
            except _SyntaxError:
                self._recover()
                if self._next == before:
                    self._advance()
        self._advance()
        return items

    def _report_end(self, what: str, opening: Token) -> None:
        """Report the first body that the end of the file leaves open."""
        if not self._reported_end:
            self._reported_end = True
            note = Note("the body begins here", opening.location)
            message = f"expected `}}` behind the body of {what}, found the end of the file"
            self._diagnostics.error(Code.SYNTAX, message, self._token.location, [note])

    # Names and documentation

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
            self._fail(f"expected the name of {what}, found {_shown(token)}")
        return self._advance()

    def _scoped_name(self, what: str) -> tuple[str, Token]:
        """Take `A`, `A::B` or `::A::B`; return it with its last part, where errors point to."""
        parts = [""] if self._accept("::") else []
        while True:
            token = self._token
            if token.kind is not Kind.NAME:
                notes = did_you_mean(token.text, _BUILTIN_TYPES) if token.kind is Kind.KEYWORD else ()
                self._fail(f"expected the name of {what}, found {_shown(token)}", *notes)
            parts.append(self._advance().text)
            if not self._accept("::"):
                return "::".join(parts), token

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
            self._fail(f"expected a string, found {_shown(self._token)}")
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

    # Definitions

    def root(self) -> ast.Module:
        root = ast.Module("", self._token)
        while not self._at_end():
            before = self._next
            try:
                definition = self._definition()
                if definition is not None:
                    root.definitions.append(definition)
            except _SyntaxError:
                self._recover()
                if self._next == before:
                    self._advance()
        return root

    def _definition(self) -> ast.Definition | None:
        if self._at("[") and self._tokens[self._next + 1].text == "[":
            self._file_metadata()
            return None
        metadata, doc = self._metadata()
        token = self._token
        self._sources_with_definitions.add(token.source)
        if token.kind is not Kind.KEYWORD or token.text not in _DEFINITION_KEYWORDS:
            notes = did_you_mean(token.text, _DEFINITION_KEYWORDS) if token.kind is Kind.NAME else ()
            self._fail(f"expected a definition, found {_shown(token)}", *notes)
        self._advance()
        if token.text == "local":
            self._local(token)
        definition: ast.Definition
        match token.text:
            case "module":
                definition = self._module()
            case "struct":
                definition = self._struct()
            case "class":
                definition = self._class()
            case "exception":
                definition = self._exception()
            case "interface":
                definition = self._interface()
            case "enum":
                definition = self._enumeration()
            case "sequence":
                definition = self._sequence()
            case "dictionary":
                definition = self._dictionary()
            case _:
                definition = self._constant()
        definition.doc = doc or self._tokens[self._next - 1].trailing_doc
        definition.metadata += metadata
        return definition

    def _file_metadata(self) -> None:
        """Take `[["..."]]`; it speaks to the generators of other languages."""
        opening = self._advance()
        if opening.source in self._sources_with_definitions:
            message = "metadata of the file must stand before all definitions"
            self._diagnostics.error(Code.SYNTAX, message, opening.location)
        self._metadata()
        self._expect("]", "behind metadata of the file")

    def _local(self, token: Token) -> NoReturn:
        self._diagnostics.error(Code.NOT_SUPPORTED, "`local` definitions are not supported", token.location)
        raise _SyntaxError

    def _end_of_body(self) -> None:
        self._accept(";")

    def _module(self) -> ast.Module:
        name = self._name("a module")
        module = ast.Module(name.text, name)
        self._depth += 1
        if self._depth > _DEEPEST_MODULE:
            self._depth -= 1
            self._fail("modules are nested too deeply", token=name)
        try:
            module.definitions += self._block(self._definition, f"module {name.text}")
        finally:
            self._depth -= 1
        self._end_of_body()
        return module

    def _struct(self) -> ast.Struct:
        name = self._name("a struct")
        found_before = len(self._diagnostics)
        members = self._block(self._member, f"struct {name.text}")
        if not members and len(self._diagnostics) == found_before:
            self._diagnostics.error(Code.NO_MEMBER, f"struct `{name.text}` has no member", name.location)
        self._end_of_body()
        return ast.Struct(name.text, name, members=members)

    def _class(self) -> ast.Class | ast.ForwardDeclaration:
        name = self._name("a class")
        if self._accept(";"):
            return ast.ForwardDeclaration(name.text, name, of=ast.Class)
        compact_id = None
        if self._accept("("):
            compact_id = self._advance()
            self._expect(")", "behind the compact id")
        base = self._base("a class")
        if self._at("implements"):
            message = "a class that implements interfaces is not supported"
            self._diagnostics.error(Code.NOT_SUPPORTED, message, self._token.location)
            raise _SyntaxError
        members = self._block(self._member, f"class {name.text}")
        self._end_of_body()
        return ast.Class(name.text, name, base=base, members=members, compact_id=compact_id)

    def _exception(self) -> ast.ExceptionType:
        name = self._name("an exception")
        base = self._base("an exception")
        members = self._block(self._member, f"exception {name.text}")
        self._end_of_body()
        return ast.ExceptionType(name.text, name, base=base, members=members)

    def _interface(self) -> ast.Interface | ast.ForwardDeclaration:
        name = self._name("an interface")
        if self._accept(";"):
            return ast.ForwardDeclaration(name.text, name, of=ast.Interface)
        bases: list[ast.NamedType] = []
        if self._accept("extends") or self._accept(":"):
            bases.append(ast.NamedType(*self._scoped_name("an interface")))
            while self._accept(","):
                bases.append(ast.NamedType(*self._scoped_name("an interface")))
        operations = self._block(self._operation, f"interface {name.text}")
        self._end_of_body()
        return ast.Interface(name.text, name, bases=bases, operations=operations)

    def _base(self, what: str) -> ast.NamedType | None:
        if self._accept("extends") or self._accept(":"):
            return ast.NamedType(*self._scoped_name(what))
        return None

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
            except _SyntaxError:
                while not (self._at(",") or self._at("}") or self._at_end()):
                    self._advance()
        self._advance()
        if not enumeration.enumerators and len(self._diagnostics) == found_before:
            message = f"enumeration `{name.text}` has no enumerator"
            self._diagnostics.error(Code.NO_MEMBER, message, name.location)
        self._end_of_body()
        return enumeration

    def _enumerator(self, enumeration: ast.Enumeration) -> ast.Enumerator:
        doc = self._token.doc
        name = self._name("an enumerator")
        literal = self._literal() if self._accept("=") else None
        if not (self._at(",") or self._at("}") or self._at_end()):
            self._fail(f"expected `,` or `}}` behind an enumerator, found {_shown(self._token)}")
        doc = doc or self._tokens[self._next - 1].trailing_doc
        if self._at(","):
            doc = doc or self._token.trailing_doc
        return ast.Enumerator(name.text, name, doc, literal=literal, enumeration=enumeration)

    def _sequence(self) -> ast.Sequence:
        self._expect("<", "behind `sequence`")
        metadata, _ = self._metadata()
        element = self._type("an element type")
        self._expect(">", "behind the element type")
        name = self._name("a sequence")
        self._expect_end_of_statement("a sequence")
        return ast.Sequence(name.text, name, metadata=metadata, element=element)

    def _dictionary(self) -> ast.Dictionary:
        self._expect("<", "behind `dictionary`")
        metadata, _ = self._metadata()
        key = self._type("a key type")
        self._expect(",", "between the types of a dictionary")
        metadata += self._metadata()[0]
        value = self._type("a value type")
        self._expect(">", "behind the value type")
        name = self._name("a dictionary")
        self._expect_end_of_statement("a dictionary")
        return ast.Dictionary(name.text, name, metadata=metadata, key=key, value=value)

    def _constant(self) -> ast.Constant:
        metadata, _ = self._metadata()
        kind = self._type("the type of a constant")
        name = self._name("a constant")
        self._expect("=", "behind the name of a constant")
        literal = self._literal()
        self._expect_end_of_statement("a constant")
        return ast.Constant(name.text, name, metadata=metadata, type=kind, literal=literal)

    # Members and operations

    def _member(self) -> ast.Member:
        metadata, doc = self._metadata()
        tag = self._tag()
        if self._at("void") or self._at("idempotent"):
            self._fail(_NO_OPERATIONS)
        kind = self._type("the type of a member")
        name = self._name("a member")
        if self._at("("):
            self._fail(_NO_OPERATIONS, token=name)
        default = self._literal() if self._accept("=") else None
        end = self._expect_end_of_statement("a member")
        return ast.Member(
            name.text, name, doc or end.trailing_doc, metadata, type=kind, default=default, tag=tag
        )

    def _operation(self) -> ast.Operation:
        metadata, doc = self._metadata()
        idempotent = self._accept("idempotent") is not None
        self._tag()
        returns = None if self._accept("void") else self._type("the type that an operation returns")
        name = self._name("an operation")
        if not self._at("("):
            if self._at(";") or self._at("="):
                self._fail("an interface has no data members; put them into a struct or class", token=name)
            self._fail(f"expected `(` behind the name of an operation, found {_shown(self._token)}")
        opening = self._advance()
        parameters: list[ast.Parameter] = []
        while not self._at(")"):
            parameters.append(self._parameter())
            if not self._accept(","):
                break
            if self._at(")"):
                self._fail(f"expected a parameter behind `,`, found {_shown(self._token)}")
        if not self._at(")"):
            begin = Note("the parameters begin here", opening.location)
            self._fail(f"expected `,` or `)` behind a parameter, found {_shown(self._token)}", begin)
        self._advance()
        throws: list[ast.NamedType] = []
        if self._accept("throws"):
            throws.append(ast.NamedType(*self._scoped_name("an exception")))
            while self._accept(","):
                throws.append(ast.NamedType(*self._scoped_name("an exception")))
        end = self._expect_end_of_statement("an operation")
        return ast.Operation(
            name.text,
            name,
            doc or end.trailing_doc,
            metadata,
            returns=returns,
            parameters=parameters,
            throws=throws,
            idempotent=idempotent,
        )

    def _parameter(self) -> ast.Parameter:
        doc = self._token.doc
        out = self._accept("out") is not None
        metadata, _ = self._metadata()
        tag = self._tag()
        kind = self._type("the type of a parameter")
        name = self._name("a parameter")
        doc = doc or name.trailing_doc
        return ast.Parameter(name.text, name, doc, metadata, type=kind, out=out, tag=tag)

    def _tag(self) -> Token | None:
        """Take `optional(n)`."""
        token = self._accept("optional")
        if token is not None:
            self._expect("(", "behind `optional`")
            self._literal()
            self._expect(")", "behind the tag")
            self._diagnostics.error(Code.NOT_SUPPORTED, "optional values are not supported", token.location)
        return token

    def _type(self, what: str) -> ast.Type:
        token = self._token
        kind: ast.BuiltinType | ast.NamedType
        if token.kind is Kind.KEYWORD and token.text in _BUILTIN_TYPES:
            self._advance()
            kind = ast.BuiltinType(token.text, token)
        elif token.kind is Kind.KEYWORD:
            self._fail(f"expected {what}, found {_shown(token)}")
        elif token.kind is Kind.NAME or self._at("::"):
            kind = ast.NamedType(*self._scoped_name("a type"))
        else:
            self._fail(f"expected {what}, found {_shown(token)}")
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
        return self._fail(f"expected a value, found {_shown(token)}")


def _shown(token: Token) -> str:
    if token.kind is Kind.END:
        return "the end of the file"
    if token.kind is Kind.KEYWORD:
        return f"the keyword `{token.text}`"
    return f"`{token.text if len(token.text) <= 40 else token.text[:40] + '...'}`"
