"""Build the tree of a translation unit, and go on after an error at the next `;` or `}`."""

from __future__ import annotations

from collections.abc import Callable

from codegen.diagnostics import Diagnostics, Note, did_you_mean

from . import ast
from .codes import Code
from .dialect import DEFAULT, Dialect
from .lexer import Kind, Source, Token
from .member_parser import MemberParser
from .preprocessor import TranslationUnit
from .token_reader import SliceSyntaxError, shown

_DEEPEST_MODULE = 50


def parse(unit: TranslationUnit, diagnostics: Diagnostics, dialect: Dialect = DEFAULT) -> ast.Module:
    """Return the root module of a translation unit: what its files define, without what could not be read."""
    return _Parser(unit, diagnostics, dialect).root()


class _Parser(MemberParser):
    def __init__(self, unit: TranslationUnit, diagnostics: Diagnostics, dialect: Dialect) -> None:
        super().__init__(unit, diagnostics, dialect)
        self._depth = 0
        self._sources_with_modules: set[Source] = set()
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

    def root(self) -> ast.Module:
        """Read everything."""
        root = ast.Module("", self._token)
        while not self._at_end():
            self._read_into(root.definitions, self._definition)
        return root

    def _definition(self) -> ast.Definition | None:
        if self._at("[["):
            self._metadata_of_file()
            return None
        metadata, doc = self._metadata()
        token = self._token
        local = self._accept("local") is not None
        token = self._token
        read = self._readers.get(token.text) if token.kind is Kind.KEYWORD else None
        if read is None or (local and token.text in {"module", "const"}):
            notes = did_you_mean(token.text, self._readers) if token.kind is Kind.NAME else ()
            self._fail(f"expected a definition, found {shown(token)}", *notes)
        self._advance()
        definition = read()
        definition.local = local
        definition.doc = doc or self._previous.trailing_doc
        definition.metadata += metadata
        return definition

    def _metadata_of_file(self) -> None:
        """Take `[["..."]]`; it speaks to the generators of other languages."""
        opening = self._advance()
        metadata = self._strings("metadata of the file")
        self._file_metadata[opening.source] += [each.text for each in metadata]
        self._expect("]]", "behind metadata of the file")
        if opening.source in self._sources_with_modules:
            message = "metadata of the file must stand before all definitions"
            self._diagnostics.error(Code.SYNTAX, message, opening.location)

    def _no_member(self, message: str, name: Token) -> None:
        note = Note("it begins here", name.location)
        self._diagnostics.error(Code.NO_MEMBER, message, self._previous.location, [note])

    def _end_of_body(self) -> None:
        self._accept(";")

    def _module(self) -> ast.Module:
        if self._token.kind is Kind.KEYWORD:
            self._fail(f"the keyword `{self._token.text}` cannot be the name of a module")
        name = self._name("a module")
        self._sources_with_modules.add(name.source)
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
            self._no_member(f"struct `{name.text}` has no member", name)
        self._end_of_body()
        return ast.Struct(name.text, name, members=members)

    def _class(self) -> ast.Class | ast.ForwardDeclaration:
        name = self._name("a class")
        if self._accept(";"):
            return ast.ForwardDeclaration(name.text, name, of=ast.Class)
        class_ = ast.Class(name.text, name)
        if self._accept("("):
            class_.compact_id = self._number("the compact id")
            self._expect(")", "behind the compact id")
        class_.base = self._base("a class")
        if self._accept("implements"):
            class_.implements += self._list_of("an interface")
        body: list[ast.Member | ast.Operation] = self._block(self._member_or_operation, f"class {name.text}")
        for each in body:
            if isinstance(each, ast.Operation):
                class_.operations.append(each)
            else:
                class_.members.append(each)
        self._end_of_body()
        return class_

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
        if self._accept_extends():
            bases += self._list_of("an interface")
        operations = self._block(self._operation, f"interface {name.text}")
        self._end_of_body()
        return ast.Interface(name.text, name, bases=bases, operations=operations)

    def _accept_extends(self) -> bool:
        if self._at(":") and not self._dialect.colon_extends:
            self._fail("expected `extends`, found `:`", Note("`:` for `extends` is of Slice 3.8"))
        return self._accept("extends") is not None or self._accept(":") is not None

    def _base(self, what: str) -> ast.NamedType | None:
        if self._accept_extends():
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
            except SliceSyntaxError:
                while not (self._at(",") or self._at("}") or self._at_end()):
                    self._advance()
        self._advance()
        if not enumeration.enumerators and len(self._diagnostics) == found_before:
            self._no_member(f"enumeration `{name.text}` has no enumerator", name)
        self._end_of_body()
        return enumeration

    def _enumerator(self, enumeration: ast.Enumeration) -> ast.Enumerator:
        doc = self._token.doc
        name = self._name("an enumerator")
        literal = self._literal() if self._accept("=") else None
        if not (self._at(",") or self._at("}") or self._at_end()):
            self._fail(f"expected `,` or `}}` behind an enumerator, found {shown(self._token)}")
        doc = doc or self._previous.trailing_doc
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
        if self._token.kind is Kind.KEYWORD:
            self._fail(f"the keyword `{self._token.text}` cannot be the name of a constant")
        name = self._name("a constant")
        self._expect("=", "behind the name of a constant")
        literal = self._literal()
        self._expect_end_of_statement("a constant")
        return ast.Constant(name.text, name, metadata=metadata, type=kind, literal=literal)
