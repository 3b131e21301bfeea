"""What the code of an automaton commands: operations of interfaces that change something.

The code is not run. What a name may stand for (the component, a proxy, an operation of one, a text) is
followed through assignments, loops over written lists, calls of functions of the document and arguments of
states, so that `getattr(self, f"{side}Motors")` is understood where `side` is known. Where the component or a
proxy goes to what is not followed, such as a helper object, the code may command anything.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Final, NamedTuple

from ...diagnostics import Diagnostics, Location, Note
from ..analysis import Analysis, AutomatonCode
from ..code.text import all_nodes
from ..codes import Code
from ..document import NO_CHILD, Text
from ..known_interfaces import DescriptionError, KnownInterface, KnownInterfaces

__all__ = ["Command", "Commands", "Operations", "is_command", "read_operations"]

_COMMANDS: Final = re.compile(r"(set|send|play|stop|start|move|turn|walk|go|do|reset|say|command)(?![a-z])")
_READS: Final = re.compile(r"(get|is|has|read|list|find|ice)(?![a-z])")
_DEEPEST: Final = 40
_HARMLESS: Final = frozenset(
    {"bool", "getattr", "hasattr", "id", "isinstance", "print", "repr", "str", "type"}
)
"""Builtins that command nothing, whatever they are given."""

Operations = Mapping[str, Mapping[str, bool]]
"""Whether each operation commands something, by the plain name of its interface."""


@dataclass(frozen=True, slots=True)
class Command:
    """That a piece of code commands the servant `identity` by an operation of `self.<interface>`."""

    identity: str
    interface: str
    operation: str


def is_command(operation: str, idempotent: bool | None = None) -> bool:
    """Return whether an operation changes something, by its name and whether its IDL says `idempotent`."""
    if _COMMANDS.match(operation):
        return True
    return not _READS.match(operation) and idempotent is False


def read_operations(
    interfaces: Iterable[KnownInterface], known: KnownInterfaces, diagnostics: Diagnostics
) -> dict[str, dict[str, bool]]:
    """Return the operations of interfaces, as their packages describe them.

    A description that cannot be read is reported as an error; there is none of a proxy written by hand.
    """
    found: dict[str, dict[str, bool]] = {}
    for interface in interfaces:
        try:
            operations = known.operations(interface) or {}
        except DescriptionError as error:
            path = error.place.path
            if path.is_file():
                diagnostics.add_source(path, path.read_text(encoding="utf-8", errors="replace"))
            message = f"the description of package `{path.parent.name}` {error}"
            note = Note("the model checker needs it: undo a broken merge, or generate the package again")
            diagnostics.error(Code.BAD_DESCRIPTION, message, error.place, [note])
        else:
            commands = {name: is_command(name, each.is_idempotent) for name, each in operations.items()}
            found[interface.scoped_name.rsplit("::", 1)[-1]] = commands
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
_Values = frozenset[_Value]
_NOTHING: Final[_Values] = frozenset()
_Names = dict[str, _Values]


@dataclass
class _Found:
    """What code commands for certain, what it may command, and the nodes that are not followed."""

    certain: set[Command] = field(default_factory=set)
    possible: set[Command] = field(default_factory=set)
    unclear: list[ast.AST] = field(default_factory=list)

    def add(self, other: _Found, call: ast.AST) -> None:
        self.certain |= other.certain
        self.possible |= other.possible
        self.unclear += [call] if other.unclear else []


class Commands:
    """What the code of a document commands, by the texts of its pieces."""

    def __init__(self, analysis: Analysis, operations: Operations | None = None) -> None:
        document = analysis.document
        self._analysis = analysis
        self._operations = operations or {}
        self._interfaces = {
            interface.name: (interface.identity, interface.type.replace(".", "::").rsplit("::", 1)[-1])
            for interface in document.interfaces
        }
        for alias, name in document.proxy_aliases.items():
            self._interfaces.setdefault(alias, self._interfaces[name])
        self._functions = {
            node.name: node
            for piece in analysis.functions
            for node in piece.tree.body
            if isinstance(node, ast.FunctionDef)
        }
        self._globals = {
            name
            for piece in analysis.pieces
            for node in all_nodes(piece.tree)
            if isinstance(node, ast.Global)
            for name in node.names
        }
        """Names of the whole file, which are not followed."""
        self._attributes: _Names = {}
        """What attributes may stand for that code gives to the component."""
        self._known: dict[tuple[str, tuple[tuple[str, _Values], ...]], _Found] = {}
        self._names: dict[int, _Names] = {automaton.id: {} for automaton in document.automata}
        """What the variables of each automaton may stand for, by its id."""
        self._automata: dict[int, int] = {}
        """The automaton of each piece, by the ids of both."""
        self._by_piece: dict[int, _Found] = {}
        if self._interfaces:
            self._follow_names()

    def of(self, text: Text) -> frozenset[Command]:
        """Return what a text of the document certainly commands, itself or by the functions it calls."""
        return frozenset(self._found(text).certain)

    def possible(self, text: Text) -> frozenset[Command]:
        """Return what a text of the document may command: a name in it may be one proxy or another."""
        return frozenset(self._found(text).possible)

    def unclear(self, text: Text) -> Location | None:
        """Return the first place where code may command anything, None when all of it is followed."""
        piece, found = self._analysis.piece(text), self._found(text)
        return piece.place(found.unclear[0]) if piece is not None and found.unclear else None

    def _found(self, text: Text) -> _Found:
        piece = self._analysis.piece(text)
        if piece is None or not self._interfaces:
            return _Found()
        if id(piece) not in self._by_piece:
            names = self._names.get(self._automata.get(id(piece), 0), {})
            found = _Found(unclear=[piece.tree]) if piece.is_deep else self._in_tree(piece.tree, names, 0)
            self._by_piece[id(piece)] = found
        return self._by_piece[id(piece)]

    def _follow_names(self) -> None:
        """Find out what variables and attributes may stand for, until nothing new comes."""
        while True:
            before = repr(_size(self._attributes)), [_size(names) for names in self._names.values()]
            for code in self._analysis.automata:
                names = self._names[code.automaton.id]
                for piece in code.sharing():
                    self._automata[id(piece)] = code.automaton.id
                    self._bind(piece.tree, names)
                self._hand_over(code, names)
            for function in self._functions.values():
                self._bind(function, {_own_name(function): frozenset({_SELF})})
            if before == (repr(_size(self._attributes)), [_size(names) for names in self._names.values()]):
                return

    def _hand_over(self, code: AutomatonCode, names: _Names) -> None:
        """Give the inputs of automata what their states hand over."""
        for state in code.automaton.states:
            for argument in state.arguments:
                piece = self._analysis.piece(argument.value)
                expression = None if piece is None else piece.expression
                if expression is not None:
                    values = self._values(expression, names)
                    for child in state.children if argument.child == NO_CHILD else (argument.child,):
                        if child in self._names:
                            _add(self._names[child], argument.name, values)

    def _bind(self, tree: ast.AST, names: _Names) -> None:
        """Give names and attributes what a tree assigns to them."""
        for node in all_nodes(tree):
            match node:
                case ast.Assign(targets=targets, value=value):
                    for target in targets:
                        self._store(target, value, names)
                case ast.AnnAssign(target=target, value=ast.expr() as value):
                    self._store(target, value, names)
                case ast.NamedExpr(target=target, value=value):
                    self._store(target, value, names)
                case ast.For(target=target, iter=iterable) | ast.comprehension(target=target, iter=iterable):
                    for element in _elements(iterable) or [iterable]:
                        self._store(target, element, names)
                case ast.AugAssign(target=ast.Name(id=name)):
                    _add(names, name, frozenset({_OTHER}))

    def _store(self, target: ast.expr, value: ast.expr, names: _Names) -> None:
        match target, value:
            case ast.Name(id=name), _:
                _add(names, name, self._stored(value, names))
            case ast.Attribute(value=owner, attr=name), _ if _SELF in self._values(owner, names):
                _add(self._attributes, name, self._stored(value, names))
            case ((ast.Tuple(elts=targets) | ast.List(elts=targets)), _):
                values = _elements(value)
                if len(targets) == len(values):
                    for one, other in zip(targets, values, strict=True):
                        self._store(one, other, names)

    def _stored(self, value: ast.expr, names: _Names) -> _Values:
        if isinstance(value, ast.Constant) and not isinstance(value.value, str):
            return _NOTHING  # such as None, before it has a value
        return self._values(value, names) or frozenset({_OTHER})

    def _values(self, node: ast.expr, names: _Names) -> _Values:
        """Return what of interest an expression may be."""
        match node:
            case ast.Name(id=name):
                return frozenset({_SELF}) if name == "self" else names.get(name, _NOTHING)
            case ast.Attribute(value=owner, attr=name):
                return frozenset().union(*(self._attribute(one, name) for one in self._values(owner, names)))
            case ast.IfExp(body=body, orelse=orelse):
                return self._values(body, names) | self._values(orelse, names)
            case ast.BoolOp(values=values):
                return frozenset().union(*(self._values(value, names) for value in values))
            case ast.NamedExpr(value=value):
                return self._values(value, names)
            case ast.Call(func=ast.Name(id="getattr"), args=[owner, name, *_]):
                found = (
                    self._attribute(one, text)
                    for one in self._values(owner, names)
                    for text in _texts(self._values(name, names))
                )
                return frozenset().union(*found)
        return frozenset(_Value("text", text) for text in self._written(node, names))

    def _written(self, node: ast.expr, names: _Names) -> list[str]:
        """Return the texts that an expression may be, none when they are not known."""
        match node:
            case ast.Constant(value=str() as value):
                return [value]
            case ast.JoinedStr(values=parts):
                texts = [""]
                for part in parts:
                    texts = [text + more for text in texts for more in self._written(part, names)]
                return texts
            case ast.FormattedValue(value=value, conversion=-1, format_spec=None):
                return _texts(self._values(value, names))
            case ast.BinOp(op=ast.Add(), left=left, right=right):
                rights = _texts(self._values(right, names))
                return [text + more for text in _texts(self._values(left, names)) for more in rights]
        return []

    def _attribute(self, owner: _Value, name: str) -> _Values:
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
        if name in self._functions:
            return frozenset({_Value("function", name)})
        return self._attributes.get(name, _NOTHING)

    def _in_tree(self, tree: ast.AST, names: _Names, depth: int) -> _Found:
        """Return what code commands whose names may stand for something."""
        found = _Found()
        followed: set[int] = set()
        """The nodes whose value goes nowhere but where it is followed."""
        for node in all_nodes(tree):
            self._mark(node, names, followed)
            match node:
                case ast.Call(func=ast.Name(id="getattr"), args=[owner, name, *_]):
                    kinds = {value.kind for value in self._values(owner, names)}
                    if kinds & {"self", "proxy"} and not _texts(self._values(name, names)):
                        found.unclear.append(node)
                    self._use(node, names, found)
                case ast.Call(func=function):
                    for value in self._values(function, names):
                        if value.kind == "function":
                            found.add(self._called(value.name, node, names, depth), node)
                            followed.add(id(function))
                case ast.Attribute(ctx=ast.Load()):
                    self._use(node, names, found)
        for node in all_nodes(tree):
            if isinstance(node, ast.expr) and id(node) not in followed:
                self._escape(node, names, found, depth)
        return found

    def _use(self, node: ast.expr, names: _Names, found: _Found) -> None:
        """Note the commands that an expression names: who names one means to give it."""
        values = self._values(node, names)
        commands = {value for value in values if value.kind == "operation"}
        for value in commands:
            attribute, _, operation = value.name.partition(".")
            command = self._command(attribute, operation)
            if command is not None:
                (found.certain if len(values) == 1 else found.possible).add(command)

    def _mark(self, node: ast.AST, names: _Names, followed: set[int]) -> None:
        """Add the parts of a node that it takes without giving them to anybody."""
        match node:
            case ast.Attribute(value=value) | ast.Expr(value=value) | ast.FormattedValue(value=value):
                followed.add(id(value))
            case ast.Assign(targets=targets, value=value):
                if all(self._is_stored(target, names) for target in targets):
                    followed.update(map(id, [value, *_alternatives(value)]))
                    followed.update(map(id, _elements(value)) if isinstance(targets[0], ast.Tuple) else ())
            case ast.AnnAssign(target=target, value=ast.expr() as value):
                if self._is_stored(target, names):
                    followed.update(map(id, [value, *_alternatives(value)]))
            case ast.NamedExpr(target=target, value=value) if self._is_stored(target, names):
                followed.add(id(value))
            case ast.IfExp(test=test) | ast.If(test=test) | ast.While(test=test) | ast.Assert(test=test):
                followed.update(map(id, [test, *_alternatives(test)]))
            case ast.UnaryOp(operand=operand):
                followed.add(id(operand))
            case ast.Compare(left=left, comparators=others, ops=operators):
                if not any(isinstance(each, ast.In | ast.NotIn) for each in operators):
                    followed.update(map(id, [left, *others]))
            case ast.For(target=target, iter=iterable) | ast.comprehension(target=target, iter=iterable) if (
                self._is_stored(target, names)
            ):
                followed.update(map(id, _elements(iterable)))
            case ast.Call(func=ast.Name(id=name), args=arguments) if name in _HARMLESS:
                followed.update(map(id, arguments))
            case ast.Call(func=function, args=arguments, keywords=keywords):
                values = self._values(function, names)
                if values and all(value.kind in ("function", "operation") for value in values):
                    followed.add(id(function))
                    followed.update(id(each) for each in arguments)
                    followed.update(id(each.value) for each in keywords if each.arg is not None)

    def _is_stored(self, target: ast.expr, names: _Names) -> bool:
        """Return whether `_store` follows an assignment."""
        match target:
            case ast.Name(id=name):
                return name not in self._globals
            case ast.Attribute(value=owner):
                return self._values(owner, names) == {_SELF}
            case ast.Tuple(elts=targets):
                return all(isinstance(each, ast.Name) and self._is_stored(each, names) for each in targets)
        return False

    def _escape(self, node: ast.expr, names: _Names, found: _Found, depth: int) -> None:
        """Note that a value goes where nobody follows it."""
        if isinstance(getattr(node, "ctx", None), ast.Store | ast.Del):
            return
        if isinstance(node, ast.IfExp | ast.BoolOp | ast.NamedExpr):
            return  # their parts are looked at
        for value in self._values(node, names):
            if value.kind in ("self", "proxy"):
                found.unclear.append(node)
            elif value.kind == "function":  # whoever gets it may call it
                found.add(self._called(value.name, None, names, depth), node)

    def _called(self, name: str, call: ast.Call | None, names: _Names, depth: int) -> _Found:
        """Return what a function of the document commands when it is called so."""
        function = self._functions[name]
        handed: _Names = {_own_name(function): frozenset({_SELF})}
        parameters = [argument.arg for argument in (*function.args.posonlyargs, *function.args.args)][1:]
        parameters_by_name = {*parameters, *(argument.arg for argument in function.args.kwonlyargs)}
        found = _Found()
        if call is not None:
            places = [*zip(parameters, call.args, strict=False)]
            places += [(each.arg, each.value) for each in call.keywords if each.arg in parameters_by_name]
            for parameter, value in places:
                _add(handed, parameter, self._values(value, names))
            given = len(call.args) + len(call.keywords)
            lost = given > len(places) or any(isinstance(each, ast.Starred) for each in call.args)
            rest = [*call.args[len(parameters) :], *(each.value for each in call.keywords)]
            if lost and any(
                value.kind in ("self", "proxy") for each in rest for value in self._values(each, names)
            ):
                found.unclear.append(call)
        key = name, tuple(sorted((parameter, values) for parameter, values in handed.items() if values))
        if key not in self._known:
            self._known[key] = _Found()  # a function that calls itself adds nothing
            if depth < _DEEPEST:
                self._bind_all(function, handed)
                self._known[key] = self._in_tree(_body(function), handed, depth + 1)
            else:
                self._known[key] = _Found(unclear=[function])
        known = self._known[key]
        return _Found(known.certain, known.possible, [*found.unclear, *known.unclear])

    def _bind_all(self, tree: ast.AST, names: _Names) -> None:
        before = -1
        while before != _size(names):
            before = _size(names)
            self._bind(tree, names)

    def _command(self, attribute: str, method: str) -> Command | None:
        identity, kind = self._interfaces[attribute]
        known = self._operations.get(kind, {})
        commands = known[method] if method in known else is_command(method)
        return Command(identity, attribute, method) if commands else None


@lru_cache(maxsize=1024)
def _body(function: ast.FunctionDef) -> ast.Module:
    return ast.Module(function.body, [])


def _add(names: _Names, name: str, values: _Values) -> None:
    if values:
        known = names.get(name, _NOTHING) | values
        if len(known) > _MOST_TEXTS:
            known = frozenset(value for value in known if value.kind != "text") | {_OTHER}
        names[name] = known


def _size(names: _Names) -> int:
    return sum(len(values) for values in names.values())


def _texts(values: _Values) -> list[str]:
    """Return all texts that there may be, none when they are not known."""
    if _OTHER in values:
        return []
    return sorted(value.name for value in values if value.kind == "text")


def _own_name(function: ast.FunctionDef) -> str:
    arguments = [*function.args.posonlyargs, *function.args.args]
    return arguments[0].arg if arguments else "self"


def _elements(node: ast.expr) -> list[ast.expr]:
    """Return what a written tuple or list has, nothing for any other expression."""
    match node:
        case ast.Tuple(elts=elements) | ast.List(elts=elements) | ast.Set(elts=elements):
            return elements
    return []


def _alternatives(node: ast.expr) -> Iterator[ast.expr]:
    """Yield the expressions of which the value of another is one."""
    match node:
        case ast.IfExp(body=body, orelse=orelse):
            yield from (body, orelse, *_alternatives(body), *_alternatives(orelse))
        case ast.BoolOp(values=values):
            yield from values
