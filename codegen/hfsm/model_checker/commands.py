"""What the code of an automaton commands: operations of interfaces that change something.

The code is not run. What a name may stand for (the component, a proxy, an operation of one, a text) is
followed through assignments, loops over written lists, calls of functions of the document and arguments of
states, so that `getattr(self, f"{side}Motors")` is understood where `side` is known. Where the component or a
proxy goes to what is not followed, such as a helper object, the code may command anything.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Final, NamedTuple

from ...diagnostics import Diagnostics, Location, Note
from ..analysis import Analysis, AutomatonCode, Piece
from ..code.text import all_nodes
from ..codes import Code
from ..document import NO_CHILD, Interface, Text
from ..known_interfaces import DescriptionError, KnownInterfaces

__all__ = ["Command", "Commands", "Operations", "is_command", "read_operations"]

_COMMANDS: Final = re.compile(r"(set|send|play|stop|start|move|turn|walk|go|do|reset|say|command)(?![a-z])")
_READS: Final = re.compile(r"(get|is|has|read|list|find|ice)(?![a-z])")
_HARMLESS: Final = frozenset(
    {"bool", "getattr", "hasattr", "id", "isinstance", "print", "repr", "str", "type"}
)
"""Builtins that command nothing, whatever they are given."""

Operations = Mapping[str, Mapping[str, bool]]
"""Whether each operation commands something, by the attribute of `self` that holds the proxy."""


@dataclass(frozen=True, slots=True)
class Command:
    """That a piece of code commands the servant `identity` by an operation of `self.<interface>`."""

    identity: str
    interface: str
    operation: str


def is_command(operation: str, idempotent: bool | None = None) -> bool | None:
    """Return whether an operation changes something, by its name and whether its IDL says `idempotent`.

    None where neither says so.
    """
    if _COMMANDS.match(operation):
        return True
    if _READS.match(operation):
        return False
    return None if idempotent is None else not idempotent


def read_operations(
    interfaces: Iterable[Interface], known: KnownInterfaces, diagnostics: Diagnostics
) -> dict[str, dict[str, bool]]:
    """Return the operations of a document's interfaces, as their packages describe them.

    A description that cannot be read is reported as an error; there is none of a proxy written by hand.
    """
    found: dict[str, dict[str, bool]] = {}
    for interface in interfaces:
        candidates = known.find(interface.type)
        try:
            operations = known.operations(candidates[0]) if len(candidates) == 1 else None
        except DescriptionError as error:
            path = error.place.path
            if path.is_file():
                diagnostics.add_source(path, path.read_text(encoding="utf-8", errors="replace"))
            message = f"the description of package `{path.parent.name}` {error}"
            note = Note("the model checker needs it: undo a broken merge, or generate the package again")
            diagnostics.error(Code.BAD_DESCRIPTION, message, error.place, [note])
        else:
            if operations is not None:
                found[interface.name] = {
                    name: is_command(name, each.is_idempotent) is True for name, each in operations.items()
                }
    return found


class _Value(NamedTuple):
    """What an expression may be.

    Its kind is `self`, the component; a `proxy` by its attribute, or its `operation`; a `function` of the
    component; a `text`; or `other`, beside these, for what is not known.
    """

    kind: str
    name: str = ""


_SELF: Final = _Value("self")
_OTHER: Final = _Value("other")
_MOST_TEXTS: Final = 20
"""Texts that a name may stand for; with more of them nothing is known."""
_MOST_CALLS: Final = 1000
"""Calls of functions with other values that are followed; of more of them nothing is known."""
_Values = frozenset[_Value]
_NOTHING: Final[_Values] = frozenset()
_Names = dict[str, _Values]
_Argument = tuple[int | str | None, ast.expr, _Values]
"""The place or the name of an argument, None where nobody knows, and what it may be."""
_Calls = dict[tuple[str, tuple[tuple[str, _Values], ...]], "Found"]


@dataclass
class Found:
    """What code commands for certain, what it may command, and the nodes that are not followed."""

    certain: set[Command] = field(default_factory=set)
    possible: set[Command] = field(default_factory=set)
    unclear: list[ast.AST] = field(default_factory=list)

    def add(self, other: Found, call: ast.AST) -> None:
        """Add what a function commands that is called here."""
        self.certain |= other.certain
        self.possible |= other.possible
        self.unclear += [call] if other.unclear else []


class Commands:
    """What the code of a document commands, by the texts of its pieces."""

    def __init__(self, analysis: Analysis, operations: Operations | None = None) -> None:
        document = analysis.document
        self._analysis = analysis
        self._operations = operations or {}
        self._interfaces = {interface.name: interface for interface in document.interfaces}
        for alias, name in document.proxy_aliases.items():
            self._interfaces.setdefault(alias, self._interfaces[name])
        self.functions = {
            node.name: node
            for piece in analysis.functions
            for node in piece.tree.body
            if isinstance(node, ast.FunctionDef)
        }
        self.globals = {
            name
            for piece in analysis.pieces
            for node in all_nodes(piece.tree)
            if isinstance(node, ast.Global)
            for name in node.names
        }
        """Names of the whole file, which are not followed."""
        self.attributes: _Names = {}
        """What attributes may stand for that code gives to the component."""
        self._known: _Calls = {}
        self._last: _Calls = {}
        """What functions command that are called with some values: now, and when all was looked at last."""
        self._names: dict[int, _Names] = {automaton.id: {} for automaton in document.automata}
        """What the variables of each automaton may stand for, by its id."""
        self._by_piece: dict[int, Found] = {}
        if self._interfaces:
            self._follow()

    def of(self, text: Text) -> Found:
        """Return what a text of the document commands, itself or by the functions it calls."""
        return self._by_piece.get(id(self._analysis.piece(text)), Found())

    def unclear(self, text: Text) -> Location | None:
        """Return the first place where code may command anything, None when all of it is followed."""
        piece, found = self._analysis.piece(text), self.of(text)
        return piece.place(found.unclear[0]) if piece is not None and found.unclear else None

    def _follow(self) -> None:
        """Look at all code until no name may stand for anything new: then what was found is complete."""
        before: object = None
        while before != (self.attributes, self._names, self._known):
            names_before = {number: {**names} for number, names in self._names.items()}
            before = {**self.attributes}, names_before, self._known
            self._last, self._known = self._known, {}
            for code in self._analysis.automata:
                names = self._names[code.automaton.id]
                for piece in code.sharing():
                    self._by_piece[id(piece)] = self._look(piece, names)
                self._hand_over(code, names)
            for name in self.functions:
                self.called(name, {})

    def _look(self, piece: Piece, names: _Names) -> Found:
        if piece.is_deep:
            return Found(unclear=[piece.tree])
        walk = _Walk(self, names)
        try:
            walk.visit(piece.tree)
        except RecursionError:
            walk.found.unclear.append(piece.tree)
        return walk.found

    def _hand_over(self, code: AutomatonCode, names: _Names) -> None:
        """Give the inputs of automata what their states hand over."""
        for state in code.automaton.states:
            for argument in state.arguments:
                piece = self._analysis.piece(argument.value)
                if piece is not None and not piece.is_deep and piece.expression is not None:
                    values = _Walk(self, names).value(piece.expression)
                    for child in state.children if argument.child == NO_CHILD else (argument.child,):
                        if child in self._names:
                            _add(self._names[child], argument.name, values)

    def called(self, name: str, handed: _Names) -> Found:
        """Return what a function of the document commands when these values are handed to its parameters."""
        function = self.functions[name]
        key = name, tuple(sorted(handed.items()))
        if key not in self._known:
            if len(self._known) >= _MOST_CALLS:
                return Found(unclear=[function])
            self._known[key] = self._last.get(key, Found())  # where functions call each other
            walk = _Walk(self, {**handed, _parameters(function)[0]: frozenset({_SELF})})
            try:
                walk.follow(function.body)
            except RecursionError:
                walk.found.unclear.append(function)
            self._known[key] = walk.found
        return self._known[key]

    def attribute(self, owner: _Value, name: str) -> _Values:
        """Return what an attribute of a value may be."""
        if owner == _OTHER:
            return frozenset({_OTHER})
        if owner.kind == "proxy":
            return frozenset({_Value("operation", f"{owner.name}.{name}")})
        if owner.kind == "operation" and name == "begin":  # without waiting
            return frozenset({owner})
        if owner.kind != "self":
            return _NOTHING
        if name in self._interfaces:
            return frozenset({_Value("proxy", name)})
        if name in self.functions:
            return frozenset({_Value("function", name)})
        return self.attributes.get(name, _NOTHING)

    def command(self, operation: str) -> tuple[Command, bool] | None:
        """Return the command that `proxy.operation` is, None if it is none, and whether that is certain."""
        attribute, _, method = operation.partition(".")
        interface = self._interfaces[attribute]
        changes = self._operations.get(interface.name, {}).get(method, is_command(method))
        return None if changes is False else (Command(interface.identity, attribute, method), changes is True)


class _Walk:
    """Evaluate code without running it: `names` get what they may stand for, `found` what it commands.

    Each expression is evaluated by what it stands in. `visit` is for those whose value goes where nobody
    follows it: then the component or a proxy makes the code unclear, and a function may be called.
    """

    def __init__(self, commands: Commands, names: _Names) -> None:
        self.found = Found()
        self._commands = commands
        self._names = names

    def follow(self, body: list[ast.stmt]) -> None:
        """Look at statements until no name may stand for anything new."""
        before = None
        while before != self._names:
            before = {**self._names}
            self.found = Found()
            for statement in body:
                self.visit(statement)

    def visit(self, node: ast.AST) -> None:
        """Look at a statement, or at an expression whose value nobody follows."""
        match node:
            case ast.Expr(value=value):
                self.value(value)
            case ast.Assign(targets=targets, value=value):
                for target in targets:
                    self._store(target, value)
            case ast.AnnAssign(target=target, value=ast.expr() as value):
                self._store(target, value)
            case ast.AugAssign(target=ast.Name(id=name), value=value):
                _add(self._names, name, frozenset({_OTHER}))
                self.visit(value)
            case ast.For(target=target, iter=iterable) | ast.comprehension(target=target, iter=iterable):
                self._loop(node, target, iterable)
            case ast.If(test=test) | ast.While(test=test) | ast.Assert(test=test):
                self.value(test)
                self._inside(node, test)
            case ast.Name(ctx=ast.Store() | ast.Del()):
                pass
            case ast.Attribute(value=owner, ctx=ast.Store() | ast.Del()):
                self.value(owner)
            case ast.expr():
                self._escape(node, self.value(node))
            case _:
                self._inside(node)

    def _inside(self, node: ast.AST, *evaluated: ast.AST) -> None:
        for child in ast.iter_child_nodes(node):
            if child not in evaluated:
                self.visit(child)

    def _loop(self, node: ast.AST, target: ast.expr, iterable: ast.expr) -> None:
        elements = _elements(iterable)
        for element in elements:
            self._store(target, element)
        if not elements:
            self.visit(iterable)
            if isinstance(target, ast.Name):
                _add(self._names, target.id, frozenset({_OTHER}))
        self._inside(node, iterable)

    def _store(self, target: ast.expr, value: ast.expr) -> None:
        """Give a target what an expression may be."""
        elements = _elements(value)
        match target:
            case ast.Tuple(elts=targets) | ast.List(elts=targets) if len(targets) == len(elements):
                for one, other in zip(targets, elements, strict=True):
                    self._store(one, other)
            case ast.Name(id=name) if name not in self._commands.globals:
                _add(self._names, name, self._stored(value))
            case ast.Attribute(value=owner, attr=name) if (owners := self.value(owner)) & {_SELF}:
                values = self._stored(value)
                _add(self._commands.attributes, name, values)
                if len(owners) > 1:
                    self._escape(value, values)
            case _:
                self.visit(target)
                self.visit(value)

    def _stored(self, value: ast.expr) -> _Values:
        if isinstance(value, ast.Constant) and not isinstance(value.value, str):
            return _NOTHING  # such as None, before it has a value
        return self.value(value) or frozenset({_OTHER})

    def _escape(self, node: ast.AST, values: _Values) -> None:
        """Note that values go where nobody follows them."""
        for value in values:
            if value.kind in ("self", "proxy"):
                self.found.unclear.append(node)
            elif value.kind == "function":  # it may be called there
                self.found.add(self._commands.called(value.name, {}), node)

    def value(self, node: ast.expr) -> _Values:
        """Return what of interest an expression may be."""
        match node:
            case ast.Name(id=name):
                return frozenset({_SELF}) if name == "self" else self._names.get(name, _NOTHING)
            case ast.Attribute(value=owner, attr=name):
                return self._used(self._commands.attribute(one, name) for one in self.value(owner))
            case ast.IfExp(test=test, body=body, orelse=orelse):
                self.value(test)
                return self.value(body) | self.value(orelse)
            case ast.BoolOp(values=values):
                return frozenset().union(*map(self.value, values))
            case ast.NamedExpr(target=target, value=value):
                self._store(target, value)
                return self.value(value)
            case ast.Call():
                return self._call(node)
            case ast.UnaryOp(operand=operand):
                self.value(operand)
                return _NOTHING
            case ast.Compare(left=left, comparators=others, ops=operators):
                if not any(isinstance(each, ast.In | ast.NotIn) for each in operators):
                    for each in (left, *others):
                        self.value(each)
                    return _NOTHING
        return frozenset(_Value("text", text) for text in self._texts(node))

    def _texts(self, node: ast.expr) -> list[str]:
        """Return the texts that an expression may be, none when they are not known."""
        match node:
            case ast.Constant(value=str() as value):
                return [value]
            case ast.JoinedStr(values=parts):
                texts = [""]
                for part in parts:
                    more = self._texts(part)
                    texts = [text + each for text in texts for each in more]
                return texts
            case ast.FormattedValue(value=value):
                known = node.conversion == -1 and node.format_spec is None
                return _texts(self.value(value)) if known else []
            case ast.BinOp(op=ast.Add(), left=left, right=right):
                first, second = self.value(left), self.value(right)
                self._escape(node, first | second)
                return [text + more for text in _texts(first) for more in _texts(second)]
        self._inside(node)
        return []

    def _used(self, values: Iterable[_Values]) -> _Values:
        """Return all values; the operations among them are commands: code that names one means to give it."""
        found: _Values = frozenset().union(*values)
        for value in found:
            known = self._commands.command(value.name) if value.kind == "operation" else None
            if known is not None:
                command, is_sure = known
                (self.found.certain if is_sure and len(found) == 1 else self.found.possible).add(command)
        return found

    def _call(self, call: ast.Call) -> _Values:
        name = call.func.id if isinstance(call.func, ast.Name) else ""
        if name == "getattr" and len(call.args) > 1:
            return self._getattr(call)
        functions = self.value(call.func)
        is_followed = bool(functions) and all(each.kind in ("function", "operation") for each in functions)
        is_spread = any(isinstance(each, ast.Starred) for each in call.args)
        arguments: list[_Argument] = [
            (None if is_spread else place, each, self.value(each)) for place, each in enumerate(call.args)
        ]
        arguments += [(each.arg, each.value, self.value(each.value)) for each in call.keywords]
        if is_followed:
            for function in functions:
                if function.kind == "function":
                    self.found.add(self._called(function.name, arguments), call)
        elif name not in _HARMLESS:
            self._escape(call.func, functions)
            for _, node, values in arguments:
                self._escape(node, values)
        return _NOTHING

    def _getattr(self, call: ast.Call) -> _Values:
        owners, names, *default = [self.value(each) for each in call.args]
        texts = _texts(names)
        if not texts and any(owner.kind in ("self", "proxy") for owner in owners):
            self.found.unclear.append(call)
        found = (self._commands.attribute(owner, text) for owner in owners for text in texts)
        return self._used(found).union(*default)

    def _called(self, name: str, arguments: list[_Argument]) -> Found:
        """Return what a function of the document commands when it is called so."""
        _, *positional = _parameters(self._commands.functions[name])
        by_name = {*positional, *(each.arg for each in self._commands.functions[name].args.kwonlyargs)}
        handed: _Names = {}
        for place, node, values in arguments:
            parameter = place
            if isinstance(place, int):
                parameter = positional[place] if place < len(positional) else None
            if isinstance(parameter, str) and parameter in by_name:
                _add(handed, parameter, values)
            else:
                self._escape(node, values)
        return self._commands.called(name, handed)


def _add(names: _Names, name: str, values: _Values) -> None:
    if values:
        known = names.get(name, _NOTHING) | values
        if _OTHER in known or len(known) > _MOST_TEXTS:
            known = frozenset(value for value in known if value.kind != "text") | {_OTHER}
        names[name] = known


def _texts(values: _Values) -> list[str]:
    """Return all texts that there may be, none when they are not known."""
    if _OTHER in values:
        return []
    return sorted(value.name for value in values if value.kind == "text")


def _parameters(function: ast.FunctionDef) -> list[str]:
    """Return the positional parameters, of which the first is the component."""
    return [each.arg for each in (*function.args.posonlyargs, *function.args.args)] or ["self"]


def _elements(node: ast.expr) -> list[ast.expr]:
    """Return what a written tuple or list has, nothing for any other expression."""
    return node.elts if isinstance(node, ast.Tuple | ast.List | ast.Set) else []
