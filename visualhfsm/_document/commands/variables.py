"""Exchange variables with an automaton above: as inputs, as outputs, or both keep them in the component."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from itertools import takewhile
from pathlib import Path
from typing import Annotated, Final, Literal

import msgspec

from codegen.hfsm.analysis import Analysis, AutomatonCode, Piece, analyze
from codegen.hfsm.document import NO_CHILD, Argument, Automaton, Document, Parameter, State, Text
from codegen.messages import Message
from codegen.parsing import parse_python
from visualhfsm._base.errors import EditError

from .. import nodes
from ..places import CODE, Place, texts_in
from .base import Command, Id
from .text import SetText

_Name = Annotated[str, msgspec.Meta(max_length=1000)]
_TYPES: Final = {int: "int", float: "float", bool: "bool", str: "str"}
_NOWHERE: Final = Path()


class PassVariable(Command, frozen=True, kw_only=True):
    """Pass a variable of the nearest automaton above that has it down to this one, as an input."""

    automaton: Id
    name: _Name

    def apply(self, document: Document) -> Document:
        analysis = analyze(document, _NOWHERE)
        owner = _owner(analysis, self.automaton, self.name)
        target = nodes.find_automaton(document, self.automaton)
        if any(self.name in piece.bound for piece in _code(analysis, target).sharing()):
            raise EditError(
                Message("Cannot pass “{name}”", name=self.name),
                "this automaton also assigns it, which the other would not see",
                Message("write self.{name} in both", name=self.name),
            )
        given = _type(owner, self.name)
        for each in _below(document, owner, target):
            document = self._handed_over(document, each, given)
        return document

    def title(self, document: Document) -> Message:  # noqa: ARG002
        return Message("Pass “{name}” as an input", name=self.name)

    def _handed_over(self, document: Document, automaton: Automaton, type: str) -> Document:
        state = _state_of(document, automaton, Message("Cannot pass “{name}”", name=self.name))
        declared = Parameter(name=self.name, type=Text(type), default=Text(), description=Text())
        document = nodes.with_automaton(
            document, automaton.id, lambda each: nodes.changed(each, inputs=(*each.inputs, declared))
        )
        several = len(state.children) > 1
        argument = Argument(name=self.name, value=Text(self.name), child=automaton.id if several else 0)

        def pass_on(father: Automaton) -> Automaton:
            states = tuple(
                nodes.changed(each, arguments=(*each.arguments, argument)) if each.id == state.id else each
                for each in father.states
            )
            return nodes.changed(father, states=states)

        return nodes.with_automaton(document, automaton.father, pass_on)


class HandUpVariable(Command, frozen=True, kw_only=True):
    """Hand a variable up to the nearest automaton above that has one of this name, as an output."""

    automaton: Id
    name: _Name

    def apply(self, document: Document) -> Document:
        analysis = analyze(document, _NOWHERE)
        owner = _owner(analysis, self.automaton, self.name)
        target = nodes.find_automaton(document, self.automaton)
        what = Message("Cannot hand “{name}” up", name=self.name)
        variables = _code(analysis, target).variables
        if variables is not None and self.name in variables.bound:
            raise EditError(
                what, "this automaton's variables set it", "delete it there: an output has a default"
            )
        if any(each.name == self.name for each in owner.automaton.inputs):
            raise EditError(what, "it is an input of the automaton above", "give the output another name")
        declared = Parameter(
            name=self.name,
            type=Text(_type(owner, self.name)),
            default=Text(_default(owner, self.name)),
            description=Text(),
        )
        for each in _below(document, owner, target):
            if self.name not in each.declared:
                document = nodes.with_automaton(
                    document,
                    each.id,
                    lambda automaton: nodes.changed(automaton, outputs=(*automaton.outputs, declared)),
                )
            document = self._taken(document, each)
        return document

    def title(self, document: Document) -> Message:  # noqa: ARG002
        return Message("Hand “{name}” up as an output", name=self.name)

    def _taken(self, document: Document, automaton: Automaton) -> Document:
        state = _state_of(document, automaton, Message("Cannot hand “{name}” up", name=self.name))
        child = automaton.id if len(state.children) > 1 else NO_CHILD
        place = Place(
            kind="state", automaton=automaton.father, id=state.id, part="result", name=self.name, child=child
        )
        return SetText(place=place, text=self.name).apply(document)


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


class TakeDefault(Command, frozen=True, kw_only=True):
    """Give an input or output the default that the variables assign to it, and delete that there."""

    automaton: Id
    list: Literal["inputs", "outputs"]
    name: _Name

    def apply(self, document: Document) -> Document:
        automaton = nodes.find_automaton(document, self.automaton)
        items: tuple[Parameter, ...] = getattr(automaton, self.list)
        item = next((each for each in items if each.name == self.name), None)
        pattern = re.compile(rf"^{re.escape(self.name)}\s*(?::[^=\n]*)?=(.+)\n?", re.MULTILINE)
        found = pattern.search(automaton.variables.text)
        try:
            tree = parse_python(found[1].strip() if found else "", mode="eval")
            value = ast.literal_eval(tree)
        except (SyntaxError, ValueError, TypeError, MemoryError, RecursionError):
            item = None
        if item is None:
            raise EditError(
                Message("Cannot take the default of “{name}”", name=self.name[:30]),
                "the variables do not set it to a literal in a separate line",
                "write the default, and delete the line yourself",
            )
        kind, given = _TYPES.get(type(value), "object"), item.type.text.strip()
        fits = given in (kind, "object") or (given, kind) == ("float", "int")
        new = nodes.changed(item, type=given if fits else kind, default=ast.unparse(tree))
        fields = {
            self.list: nodes.swapped(items, item, new),
            "variables": pattern.sub("", automaton.variables.text, count=1),
        }
        return nodes.with_automaton(document, self.automaton, lambda each: nodes.changed(each, **fields))

    def title(self, document: Document) -> Message:  # noqa: ARG002
        return Message("Take the default of “{name}” from the variables", name=self.name[:30])


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


def has_first_value(document: Document, automaton: int, name: str) -> bool:
    """Return whether a variable of an automaton above has a value before any state is entered."""
    owner = _owner(analyze(document, _NOWHERE), automaton, name)
    variables = owner.variables
    return name in owner.automaton.declared or (variables is not None and name in variables.bound)


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


def _below(document: Document, owner: AutomatonCode, target: Automaton) -> Iterator[Automaton]:
    """Yield an automaton and those above it, up to below the one that has a variable."""
    return takewhile(lambda each: each.id != owner.automaton.id, (target, *document.above(target)))


def _state_of(document: Document, automaton: Automaton, what: Message) -> State:
    """Return the state that owns an automaton. Raises EditError, which begins with `what`."""
    state = document.owner(automaton)
    if state is None:
        raise EditError(what, "no state owns the automaton")
    return state


def _type(owner: AutomatonCode, name: str) -> str:
    """Return the type of an input or output for a variable: that of its first value if it is a literal."""
    for item in (*owner.automaton.inputs, *owner.automaton.outputs):
        if item.name == name:
            return item.type.text
    return _TYPES.get(type(_literal(owner, name)), "object")


def _default(owner: AutomatonCode, name: str) -> str:
    """Return the default of an output for a variable: the variable's first value if it is a literal."""
    for item in owner.automaton.outputs:
        if item.name == name:
            return item.default.text
    return repr(_literal(owner, name))


def _literal(owner: AutomatonCode, name: str) -> object:
    """Return the first value of a variable; None if it is no literal."""
    first = owner.first_value(name)
    try:
        return None if first is None else ast.literal_eval(first)
    except (ValueError, TypeError, MemoryError, RecursionError):
        return None
