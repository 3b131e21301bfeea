"""Take a variable from below, or share one with the automata below."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Final

import msgspec

from codegen.hfsm.analysis import Analysis, AutomatonCode, Piece, analyze
from codegen.hfsm.document import NO_CHILD, Automaton, Document, Text
from codegen.messages import Message
from visualhfsm._base.errors import EditError

from .. import nodes
from ..places import CODE, Place, texts_in
from .base import Command, Id
from .text import SetText

_Name = Annotated[str, msgspec.Meta(max_length=1000)]
_NOWHERE: Final = Path()


class TakeOutput(Command, frozen=True, kw_only=True):
    """Take an output below a state into a new variable, which begins with the default of the output."""

    automaton: Id
    state: Id
    name: _Name
    child: Id = NO_CHILD

    def apply(self, document: Document) -> Document:
        above = nodes.find_automaton(document, self.automaton)
        state = nodes.find_state(above, self.state)
        below = (document.automaton(child) for child in state.children if self.child in (NO_CHILD, child))
        found = [item for each in below if each for item in each.outputs if item.name == self.name]
        default = found[0].default.text.strip() if found else "None"
        taken = _code(analyze(document, _NOWHERE), above).names
        variable = nodes.free_name(self.name, taken, "_") if self.name in taken else self.name
        lines = above.variables.text.rstrip()
        written = f"{lines}\n{variable} = {default}" if lines else f"{variable} = {default}"
        document = nodes.with_automaton(
            document, above.id, lambda each: nodes.changed(each, variables=written)
        )
        place = Place(
            kind="state", automaton=above.id, id=state.id, part="result", name=self.name, child=self.child
        )
        return SetText(place=place, text=variable).apply(document)

    def title(self, document: Document) -> Message:  # noqa: ARG002
        return Message("Take the output {name} into a new variable", name=self.name[:30])


class ShareVariable(Command, frozen=True, kw_only=True):
    """Keep a variable of the nearest automaton above that has it in the component, as `self.name`.

    The code of that automaton, and of all below it that have no such variable or input, is changed.
    """

    automaton: Id
    name: _Name

    def apply(self, document: Document) -> Document:
        analysis = analyze(document, _NOWHERE)
        owner = _owner(analysis, self.automaton, self.name)
        self._require_free(analysis, owner)
        texts = {id(text.text): (text, piece) for text, _, piece in analysis.by_text.values()}
        users = {each.id for each in self._users(analysis, owner.automaton)}
        for place, written, *_ in texts_in(document):
            text, piece = texts.get(id(written), (None, None))
            is_code = place.part in CODE and place.part != "functions"
            if is_code and place.automaton in users and text is not None and piece is not None:
                document = self._changed(document, place, text, piece)
        return document

    def title(self, document: Document) -> Message:  # noqa: ARG002
        return Message("Share “{name}” as self.{name}", name=self.name)

    def _require_free(self, analysis: Analysis, owner: AutomatonCode) -> None:
        document = analysis.document
        taken = {*analysis.defined, *(each.name for each in document.all_interfaces)}
        taken |= {each.name for each in document.parameters}
        if self.name in taken:
            self._refuse(
                Message("self.{name} is an interface, function or parameter", name=self.name),
                Message("rename the variable first"),
            )
        if any(each.name == self.name for each in owner.automaton.inputs):
            self._refuse(Message("it is an input of the automaton above"), Message("pass it on as an input"))
        if self.name in owner.results or self.name in owner.automaton.declared:
            self._refuse(Message("outputs of automata are taken into it"), Message("hand it up as an output"))

    def _refuse(self, why: Message, hint: Message) -> None:
        raise EditError(Message("Cannot share “{name}”", name=self.name), why, hint)

    def _users(self, analysis: Analysis, owner: Automaton) -> Iterator[Automaton]:
        """Yield an automaton and those below it that have no such variable."""
        yield owner
        for each in analysis.document.automata:
            if each.father == owner.id and each.id != owner.id:
                code = _code(analysis, each)
                own = each.declared | (frozenset() if code.variables is None else code.variables.bound)
                if self.name not in own:
                    yield from self._users(analysis, each)

    def _changed(self, document: Document, place: Place, text: Text, piece: Piece) -> Document:
        if any(self._is_elsewhere(node) for node in ast.walk(piece.tree)):
            self._refuse(
                Message("some of its code binds the name in another way"), Message("write self yourself")
            )
        lines = text.text.split("\n")
        for line, column in sorted(self._found(piece, text), reverse=True):
            written = lines[line]
            if written[column:].startswith(self.name):
                lines[line] = f"{written[:column]}self.{written[column:]}"
        for node in ast.walk(piece.tree):
            if isinstance(node, ast.JoinedStr) and self._reads(node):
                first = piece.place(node).line - text.line
                for line in range(first, first + (node.end_lineno or node.lineno) - node.lineno + 1):
                    lines[line] = self._in_braces(lines[line])
        return SetText(place=place, text="\n".join(lines)).apply(document)

    def _in_braces(self, line: str) -> str:
        """Change the expressions in a line of an f-string; before Python 3.12 their places are wrong."""
        name = rf"((?<!\{{)(?:\{{\{{)*\{{(?!\{{)[^{{}}]*?)(?<![\w.]){re.escape(self.name)}(?!\w)"
        while (after := re.sub(name, rf"\1self.{self.name}", line)) != line:
            line = after
        return line

    def _found(self, piece: Piece, text: Text) -> Iterator[tuple[int, int]]:
        """Yield the line and the column of each use of the name, from 0."""
        inside = {
            id(name)
            for node in ast.walk(piece.tree) if isinstance(node, ast.JoinedStr)
            for name in ast.walk(node)
        }  # fmt: skip
        for node in ast.walk(piece.tree):
            if isinstance(node, ast.Name) and node.id == self.name and id(node) not in inside:
                place = piece.place(node)
                line = place.line - text.line
                yield line, place.column - 1 - (text.column - 1 if line == 0 else 0)

    def _reads(self, node: ast.AST) -> bool:
        return any(isinstance(each, ast.Name) and each.id == self.name for each in ast.walk(node))

    def _is_elsewhere(self, node: ast.AST) -> bool:
        """Return whether a node binds the name in a way in which no attribute can be bound."""
        match node:
            case ast.Global(names=names) | ast.Nonlocal(names=names):
                return self.name in names
            case (
                ast.arg(arg=name)
                | ast.ExceptHandler(name=name)
                | ast.MatchAs(name=name)
                | ast.MatchStar(name=name)
            ):
                return name == self.name
            case ast.FunctionDef(name=name) | ast.AsyncFunctionDef(name=name) | ast.ClassDef(name=name):
                return name == self.name
            case ast.alias(name=name, asname=alias):
                return (alias or name.split(".")[0]) == self.name
            case ast.NamedExpr(target=target) | ast.comprehension(target=target):
                return self._reads(target)
        return False


def _code(analysis: Analysis, automaton: Automaton) -> AutomatonCode:
    for each in analysis.automata:
        if each.automaton is automaton:
            return each
    raise EditError("Cannot read the code", "the document is not in Python")


def _owner(analysis: Analysis, id: int, name: str) -> AutomatonCode:
    """Return the nearest automaton above one that has a variable. Raises EditError."""
    for above in analysis.document.above(nodes.find_automaton(analysis.document, id)):
        code = _code(analysis, above)
        if name in code.names:
            return code
    raise EditError(
        Message("Cannot find “{name}”", name=name),
        "no automaton above has such a variable",
        "declare it there first",
    )
