"""Read what the bodies of definitions hold: members, operations and their parameters."""

from __future__ import annotations

from codegen.diagnostics import Note

from . import ast
from .lexer import Token
from .phrase_parser import PhraseParser
from .token_reader import shown

_NO_OPERATIONS = "a struct or exception has no operations; put them into an interface"
_NO_MEMBERS = "an interface has no data members; put them into a struct or class"


class MemberParser(PhraseParser):
    """Reads members and operations."""

    def _member(self) -> ast.Member:
        """Read a member of a struct or an exception."""
        metadata, doc = self._metadata()
        tag = self._tag()
        if self._at("void") or self._at("idempotent"):
            self._fail(_NO_OPERATIONS)
        kind = self._type("the type of a member")
        name = self._name("a member")
        if self._at("("):
            self._fail(_NO_OPERATIONS, token=name)
        return self._rest_of_member(name, kind, tag, metadata, doc)

    def _operation(self) -> ast.Operation:
        """Read an operation of an interface."""
        item = self._member_or_operation(members=False)
        assert isinstance(item, ast.Operation)
        return item

    def _member_or_operation(self, *, members: bool = True) -> ast.Member | ast.Operation:
        """Read what a class holds; the parenthesis behind the name tells one from the other."""
        metadata, doc = self._metadata()
        idempotent = self._accept("idempotent") is not None
        tag = self._tag()
        if tag is not None and self._at("void"):
            self._fail("`void` cannot be optional")
        void = self._accept("void") is not None
        returns = None if void else self._type("the type of a member or an operation")
        name = self._name("a member or an operation" if members else "an operation")
        if not self._at("("):
            if returns is not None and members and not idempotent:
                return self._rest_of_member(name, returns, tag, metadata, doc)
            if not members and (self._at(";") or self._at("=")):
                self._fail(_NO_MEMBERS, token=name)
            self._fail(f"expected `(` behind the name of an operation, found {shown(self._token)}")
        parameters = self._parameters()
        throws = self._list_of("an exception") if self._accept("throws") else []
        end = self._expect_end_of_statement("an operation")
        return ast.Operation(
            name.text,
            name,
            doc or end.trailing_doc,
            metadata,
            returns=returns,
            return_tag=tag,
            parameters=parameters,
            throws=throws,
            idempotent=idempotent,
        )

    def _rest_of_member(
        self,
        name: Token,
        kind: ast.Type,
        tag: ast.Literal | None,
        metadata: list[ast.Metadata],
        doc: str | None,
    ) -> ast.Member:
        default = self._literal() if self._accept("=") else None
        end = self._expect_end_of_statement("a member")
        return ast.Member(
            name.text, name, doc or end.trailing_doc, metadata, type=kind, default=default, tag=tag
        )

    def _parameters(self) -> list[ast.Parameter]:
        opening = self._advance()
        parameters: list[ast.Parameter] = []
        while not self._at(")"):
            parameters.append(self._parameter())
            if not self._accept(","):
                break
            if self._at(")"):
                self._fail(f"expected a parameter behind `,`, found {shown(self._token)}")
        if not self._at(")"):
            begin = Note("the parameters begin here", opening.location)
            self._fail(f"expected `,` or `)` behind a parameter, found {shown(self._token)}", begin)
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
