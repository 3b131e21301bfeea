"""Evaluate code without running it: the operations that it calls, the events it sends, and how it answers.

What a name may be (the component, a proxy, an operation, a function, a text) is followed through assignments,
loops over literal lists, calls of functions of the document and arguments of states, so that
`getattr(self, f"{side}Motors")` is understood if `side` is known.

Code that cannot be followed may do anything. If the component or a proxy is passed to a helper object, a list
or a library, every call of an unknown object, anywhere in the document, may use it.
"""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Final, NamedTuple

from ..diagnostics import Location, Note
from .code.text import binds
from .definitions import COMPONENT_ALIASES, UNKNOWN, Answer, Definitions, is_static
from .document import NO_CHILD, Argument, State, Text

if TYPE_CHECKING:
    from .analysis import Analysis, AutomatonCode, Piece

__all__ = ["CodeEffects", "Effects", "ProxyCall"]

_SEND: Final = frozenset({"send", "_hfsm_send"})
_HARMLESS: Final = frozenset(
    {"bool", "getattr", "hasattr", "id", "isinstance", "print", "repr", "str", "type"}
)
"""Builtins that do nothing with their arguments."""


class ProxyCall(NamedTuple):
    """The use of an operation of `self.<proxy>`."""

    proxy: str
    operation: str


@dataclass
class Effects:
    """The effects of a piece of code, with those of the functions that it calls.

    A call is `possible` if an expression may be one of several operations.
    """

    calls: set[ProxyCall] = field(default_factory=set)
    possible: set[ProxyCall] = field(default_factory=set)
    events: dict[str, set[ast.AST]] = field(default_factory=dict)
    """The events that it sends, with the expressions of their names or the calls of functions that send."""
    answer: Answer = Answer.SAME
    any_event: list[ast.AST] = field(default_factory=list)
    """Places that may send any event."""
    any_call: list[ast.AST] = field(default_factory=list)
    """Places that may call any operation of any proxy."""
    unknown: list[ast.AST] = field(default_factory=list)
    """Calls of unknown objects."""

    def add(self, other: Effects, call: ast.AST | None = None) -> None:
        """Add the effects of other code that runs here; `call` replaces its places."""
        self.calls |= other.calls
        self.possible |= other.possible
        self.add_events(other, call)
        self.answer |= other.answer
        for mine, more in (
            (self.any_event, other.any_event),
            (self.any_call, other.any_call),
            (self.unknown, other.unknown),
        ):
            mine.extend(more if call is None else [call][: len(more)])

    def add_events(self, other: Effects, call: ast.AST | None = None) -> None:
        """Add only the events of other code."""
        for event, places in other.events.items():
            self.events.setdefault(event, set()).update(places if call is None else {call})

    def allow_anything(self, node: ast.AST) -> None:
        """Record that a node may use the component in any way."""
        self.any_event.append(node)
        self.any_call.append(node)


class _Value(NamedTuple):
    """A possible value of an expression.

    Its kind is `self` (the component), `proxy` (by its attribute), `operation`, `send` (the component's),
    `function` (of the component, by its name), `local` (a nested function or lambda), `text`, or `other` for
    unknown values.
    """

    kind: str
    name: str = ""


_SELF: Final = _Value("self")
_SENDER: Final = _Value("send")
_OTHER: Final = _Value("other")
_MOST_TEXTS: Final = 20
"""The most texts that a name may be; more are unknown."""
_MOST_CALLS: Final = 1000
"""The most calls of functions with different values that are followed."""
_Values = frozenset[_Value]
_NOTHING: Final[_Values] = frozenset()
_UNSURE: Final[_Values] = frozenset({_OTHER})
_Names = dict[str, _Values]
_Argument = tuple[int | str | None, ast.expr, _Values]
"""The position or name of an argument (None if unknown), its expression and its values."""
_Call = tuple[str, tuple[tuple[str, _Values], ...]]
"""A function, and the values of its parameters."""


class CodeEffects:
    """The effects of the code of a document, piece by piece."""

    def __init__(self, analysis: Analysis) -> None:
        document = analysis.document
        self._analysis = analysis
        self.definitions = Definitions(analysis)
        self.attributes: _Names = {each.name: _UNSURE for each in document.parameters}
        """The values of attributes that code assigns."""
        self.local: dict[str, Effects] = {}
        """The effects of nested functions and lambdas."""
        self._known: dict[_Call, Effects] = {}
        self._last: dict[_Call, Effects] = {}
        """The effects of functions by the values of their parameters: of this pass, and of the last one."""
        self._names: dict[int, _Names] = {
            automaton.id: {"self": frozenset({_SELF}), **{item.name: _UNSURE for item in automaton.inputs}}
            for automaton in document.automata
        }
        """The values of the variables of each automaton, by its id."""
        self._by_piece: dict[Piece, Effects] = {}
        for _, state in document.states():
            for child, argument in _passed(state):
                if child in self._names:
                    self._names[child].pop(argument.name, None)  # the argument gives its value
        self._follow()
        if any(effects.any_call for effects in self._by_piece.values()):
            for effects in self._by_piece.values():
                effects.any_call += effects.unknown

    def of(self, text: Text) -> Effects:
        """Return the effects of a text of the document; one that is not valid Python may do anything."""
        piece = self._analysis.piece(text)
        if piece is not None:
            return self.of_piece(piece)
        return _anything(ast.Module([], [])) if self._analysis.is_broken(text) else Effects()

    def of_piece(self, piece: Piece) -> Effects:
        """Return the effects of a piece of code; of functions, those of all together."""
        return _anything(piece.tree) if piece.is_deep else self._by_piece[piece]

    @cached_property
    def unclear_sends(self) -> tuple[Note, ...]:
        """The places that may send any event."""
        found = []
        if self._analysis.extension is not None:
            place = Location(self._analysis.path)
            found.append(Note("hand-written code beside the document may send any event", place))
        for text, path, piece in self._analysis.by_text.values():
            effects = self.of(text)
            if effects.any_event:
                place = Location(path, max(1, text.line), max(1, text.column))
                if piece is not None:
                    first = min(effects.any_event, key=lambda node: getattr(node, "lineno", 1))
                    place = piece.place(first)
                found.append(Note("this code may send any event", place))
        return tuple(found)

    def _follow(self) -> None:
        """Evaluate all code until no name gets a new value: the effects are then complete."""
        before: object = None
        while before != (now := self._snapshot()):
            before = now
            self._last, self._known = self._known, {}
            for code in self._analysis.automata:
                names = self._names[code.automaton.id]
                for piece in code.sharing():
                    self._by_piece[piece] = self._look(piece, names)
                self._pass_arguments(code, names)
            for piece in self._analysis.functions:
                self._by_piece[piece] = self._look(piece, {})

    def _snapshot(self) -> object:
        names = {number: {**names} for number, names in self._names.items()}
        return {**self.attributes}, names, self._known, {**self.local}

    def _look(self, piece: Piece, names: _Names) -> Effects:
        functions = self.definitions.functions if piece.is_functions else {}
        walk = _Walk(self, names, f"{piece.automaton}", piece.automaton)
        try:
            for node in piece.tree.body:
                if isinstance(node, ast.FunctionDef) and functions.get(node.name) is node:
                    walk.effects.add(self.called(node.name, {}))
                else:
                    walk.visit(node)
        except RecursionError:
            return _anything(piece.tree)
        return walk.effects

    def _pass_arguments(self, code: AutomatonCode, names: _Names) -> None:
        """Give the values of arguments to the inputs of automata."""
        for state in code.automaton.states:
            for child, argument in _passed(state):
                piece = code.of("argument", argument)
                if piece is not None and not piece.is_deep and piece.expression is not None:
                    values = _Walk(self, names, f"{piece.automaton}").known(piece.expression)
                    if child in self._names:
                        _add(self._names[child], argument.name, values)

    def called(self, name: str, passed: _Names) -> Effects:
        """Return the effects of a function of the document for these values of its parameters."""
        function = self.definitions.functions[name]
        key = name, tuple(sorted(passed.items()))
        if key not in self._known:
            if len(self._known) >= _MOST_CALLS:
                return _anything(function)
            self._known[key] = self._last.get(key, Effects())  # in case functions call each other
            names = dict(passed)
            if not is_static(function):
                names[_parameters(function)[0]] = frozenset({_SELF})
            walk = _Walk(self, names, f"{name} {hash(key)}")
            try:
                walk.follow(function.body)
            except RecursionError:
                walk.effects = _anything(function)
            self._known[key] = walk.effects
        return self._known[key]

    def attribute(self, owner: _Value, name: str) -> _Values:
        """Return the values of an attribute of a value."""
        match owner.kind:
            case "other":
                return _UNSURE
            case "proxy":
                return frozenset({_Value("operation", f"{owner.name}.{name}")})
            case "operation" if name == "begin":  # without waiting
                return frozenset({owner})
            case "self":
                return self.attributes.get(name, _NOTHING) | self._declared(name)
        return _NOTHING

    def _declared(self, name: str) -> _Values:
        """Return the values of an attribute of the component that no code assigns."""
        if name in self.definitions.proxies:
            return frozenset({_Value("proxy", name)})
        function = {_Value("function", name)} if name in self.definitions.functions else set()
        found = frozenset(function | ({_SENDER} if name in _SEND else set()))
        is_alias = name in COMPONENT_ALIASES and not self.definitions.is_assigned(name)
        return found or frozenset({_SELF} if is_alias else ())


class _Walk:
    """Evaluate code: collect the values of `names`, and the `effects`.

    `value` evaluates an expression whose value is followed. `visit` is for expressions whose value is not:
    the component or a proxy makes the code unclear there, and a function may be called.
    """

    def __init__(self, code: CodeEffects, names: _Names, context: str, automaton: int = 0) -> None:
        self.effects = Effects()
        self._code, self._definitions = code, code.definitions
        self._names = names
        self._context = context
        """Distinguishes nested functions of the same text."""
        self._automaton = automaton

    def follow(self, body: list[ast.stmt]) -> None:
        """Evaluate statements until no name gets a new value."""
        before = None
        while before != self._names:
            before = {**self._names}
            self.effects = Effects()
            for statement in body:
                self.visit(statement)

    def visit(self, node: ast.AST) -> None:
        """Evaluate a statement, or an expression whose value is not followed."""
        self._note(node)
        match node:
            case ast.Expr(value=value):
                self.value(value)
            case ast.Assign(targets=targets, value=value):
                for target in targets:
                    self._store(target, value)
            case ast.AnnAssign(target=target, value=ast.expr() as value):
                self._store(target, value)
            case ast.For(target=target, iter=iterable) | ast.comprehension(target=target, iter=iterable):
                self._loop(node, target, iterable)
            case ast.If(test=test) | ast.While(test=test) | ast.Assert(test=test):
                self.value(test)
                self._inside(node, test)
            case ast.Attribute(value=owner, attr=name, ctx=ast.Store() | ast.Del()):
                if _SELF in self.value(owner):
                    _add(self._code.attributes, name, _UNSURE)
            case ast.FunctionDef(name=name) | ast.AsyncFunctionDef(name=name):
                _add(self._names, name, self._function(node, node.body))
            case ast.ClassDef(name=name):
                self._class(node)
            case ast.Name(ctx=ast.Load()):
                self._escape(node, self.value(node))
            case ast.Name() | ast.alias() | ast.ExceptHandler() | ast.pattern():
                for name in binds(node):
                    _add(self._names, name, _UNSURE)
                self._reflect(node, getattr(node, "name", None) or "")
                self._inside(node)
            case ast.expr():
                self._escape(node, self.value(node))
            case _:
                self._inside(node)

    def _note(self, node: ast.AST) -> None:
        self.effects.answer |= self._definitions.answer_of_node(node, self._automaton)

    def _reflect(self, node: ast.AST, name: str) -> None:
        if name in self._definitions.reflection:
            self.effects.allow_anything(node)

    def _inside(self, node: ast.AST, *evaluated: ast.AST) -> None:
        for child in ast.iter_child_nodes(node):
            if child not in evaluated:
                self.visit(child)

    def _function(
        self, node: ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda, body: Iterable[ast.AST]
    ) -> _Values:
        """Evaluate a nested function, and return it as a value."""
        decorators = [] if isinstance(node, ast.Lambda) else node.decorator_list
        defaults = [*node.args.defaults, *(each for each in node.args.kw_defaults if each is not None)]
        for evaluated in (*decorators, *defaults):
            self.visit(evaluated)
        parameters = {each.arg for each in ast.walk(node.args) if isinstance(each, ast.arg)}
        names = {name: values for name, values in self._names.items() if name not in parameters}
        walk = _Walk(self._code, names, f"{self._context} {id(node)}", self._automaton)
        for each in body:
            walk.visit(each)
        for name, values in names.items():
            if name not in parameters:
                _add(self._names, name, values)
        self._code.local[walk._context] = walk.effects
        self.effects.add_events(walk.effects)  # at any later call
        self.effects.any_event += walk.effects.any_event
        found = frozenset({_Value("local", walk._context)})
        if decorators:
            self._escape(node, found)
        return found

    def _class(self, node: ast.ClassDef) -> None:
        """Evaluate a nested class: if its methods use the component, it may do anything with it."""
        names = dict(self._names)
        walk = _Walk(self._code, names, f"{self._context} {id(node)}", self._automaton)
        walk._inside(node)
        for name, values in names.items():
            methods = {each for each in values if each.kind == "local"} - self._names.get(name, _NOTHING)
            walk._escape(node, frozenset(methods))
            if name in self._names:
                _add(self._names, name, values - methods)
        done = walk.effects
        if done.calls or done.possible or done.events or done.any_call or done.any_event:
            self.effects.allow_anything(node)
        _add(self._names, node.name, _UNSURE)

    def _loop(self, node: ast.AST, target: ast.expr, iterable: ast.expr) -> None:
        elements = _elements(iterable)
        for element in elements:
            self._store(target, element)
        if not elements:
            self.visit(iterable)
            self.visit(target)
        self._inside(node, target, iterable)

    def _store(self, target: ast.expr, value: ast.expr) -> None:
        """Give the values of an expression to a target."""
        elements = _elements(value)
        match target:
            case ast.Tuple(elts=targets) | ast.List(elts=targets) if len(targets) == len(
                elements
            ) and not any(isinstance(each, ast.Starred) for each in (*targets, *elements)):
                for one, other in zip(targets, elements, strict=True):
                    self._store(one, other)
            case ast.Name(id=name) if name not in self._definitions.globals:
                self._note(target)
                _add(self._names, name, self.known(value))
            case ast.Attribute(value=owner, attr=name) if (owners := self.value(owner)) & {_SELF}:
                self._note(target)
                values = self.known(value)
                _add(self._code.attributes, name, values)
                if len(owners) > 1:
                    self._escape(value, values)
            case _:
                self.visit(target)
                self.visit(value)

    def known(self, value: ast.expr) -> _Values:
        """Return the values of an expression, `other` if they are unknown."""
        if isinstance(value, ast.Constant) and not isinstance(value.value, str):
            return _NOTHING  # such as None, as a first value
        return self.value(value) or _UNSURE

    def _use(self, operation: _Value, *, is_certain: bool) -> None:
        proxy, _, name = operation.name.partition(".")
        (self.effects.calls if is_certain else self.effects.possible).add(ProxyCall(proxy, name))

    def _escape(self, node: ast.AST, values: _Values) -> None:
        """Record that values are no longer followed."""
        for value in values:
            match value.kind:
                case "operation":
                    self._use(value, is_certain=len(values) == 1)
                case "self":
                    self.effects.allow_anything(node)
                case "proxy":
                    self.effects.any_call.append(node)
                case "send":
                    self.effects.any_event.append(node)
                case "function":  # it may be called
                    self.effects.add(self._code.called(value.name, {}), node)
                case "local":
                    self.effects.add(self._code.local.get(value.name, Effects()), node)

    def value(self, node: ast.expr) -> _Values:
        """Return the values of an expression; none if they are unknown, or of no interest."""
        self._note(node)
        match node:
            case ast.Name() | ast.Attribute():
                return self._read(node)
            case ast.IfExp(test=test, body=body, orelse=orelse):
                self.value(test)
                return self.known(body) | self.known(orelse)
            case ast.BoolOp(values=values):
                return frozenset().union(*map(self.known, values))
            case ast.NamedExpr(target=target, value=value):
                self._store(target, value)
                return self.value(value)
            case ast.Call():
                return self._call(node)
            case ast.Lambda(body=body):
                return self._function(node, [body])
            case ast.UnaryOp(operand=operand):
                self.value(operand)
                return _NOTHING
            case ast.Compare(left=left, comparators=others, ops=operators):
                if not any(isinstance(each, ast.In | ast.NotIn) for each in operators):
                    for each in (left, *others):
                        self.value(each)
                    return _NOTHING
        return frozenset(_Value("text", text) for text in self._texts(node))

    def _read(self, node: ast.Name | ast.Attribute) -> _Values:
        """Return the values of a name or an attribute."""
        if isinstance(node, ast.Name):
            self._reflect(node, node.id)
            return self._names.get(node.id, _NOTHING)
        return self._attribute(self.value(node.value), node.attr, node)

    def _attribute(self, owners: _Values, name: str, node: ast.AST) -> _Values:
        """Return the values of an attribute."""
        self._reflect(node, name)
        if _SELF in owners and self._definitions.is_unclear_attribute(name):
            self.effects.allow_anything(node)
        return frozenset().union(*(self._code.attribute(owner, name) for owner in owners))

    def _texts(self, node: ast.expr) -> list[str]:
        """Return the texts that an expression may be, none if they are unknown."""
        match node:
            case ast.Constant(value=str() as value):
                return [value]
            case ast.JoinedStr(values=parts):
                texts = [""]
                for more in [self._texts(part) for part in parts]:
                    texts = [text + each for text in texts for each in more]
                    texts = texts if len(texts) <= _MOST_TEXTS else []
                return texts
            case ast.FormattedValue(value=value):
                found = self.value(value)
                return _texts(found) if node.conversion == -1 and node.format_spec is None else []
            case ast.BinOp(op=ast.Add(), left=left, right=right):
                first, second = self.value(left), self.value(right)
                self._escape(node, first | second)
                return [text + more for text in _texts(first) for more in _texts(second)]
        self._inside(node)
        return []

    def _call(self, call: ast.Call) -> _Values:
        called = call.func
        name = called.id if isinstance(called, ast.Name) else ""
        if name == "getattr" and len(call.args) > 1:
            return self._getattr(call)
        if name == "super" and not call.args:
            return frozenset({_SELF})
        functions = self._read(called) if isinstance(called, ast.Name | ast.Attribute) else self.value(called)
        is_spread = any(isinstance(each, ast.Starred) for each in call.args)
        arguments: list[_Argument] = [
            (None if is_spread else place, each, self.value(each)) for place, each in enumerate(call.args)
        ]
        arguments += [(each.arg, each.value, self.value(each.value)) for each in call.keywords]
        kinds = {each.kind for each in functions}
        if kinds and kinds <= {"function", "operation", "send"}:
            for each in functions:
                if each.kind == "operation":
                    self._use(each, is_certain=len(functions) == 1)
                self._follow(each, call, arguments)
            return _NOTHING
        self.effects.answer |= self._definitions.answer_of_call(call)
        if name in _HARMLESS and name not in self._definitions.bound:
            return _NOTHING
        if kinds != {"local"} and self._definitions.is_unknown(called):
            self.effects.unknown.append(call)
        self._escape(call, functions)
        for _, node, values in arguments:
            self._escape(node, values)
        return _NOTHING

    def _follow(self, function: _Value, call: ast.Call, arguments: list[_Argument]) -> None:
        """Add the effects of a call of a known function."""
        if function.kind == "function":
            self.effects.add(self._called(function.name, arguments), call)
        elif function.kind == "operation":
            self.effects.answer |= Answer.OTHER
        else:
            self.effects.answer |= UNKNOWN
            names = [(node, _texts(values)) for place, node, values in arguments if place in (0, "name")]
            for node, events in names:
                for event in events:
                    self.effects.events.setdefault(event.strip(), set()).add(node)
            if not names or not names[0][1]:
                self.effects.any_event.append(call)

    def _getattr(self, call: ast.Call) -> _Values:
        owners, names, *default = [self.value(each) for each in call.args]
        self.effects.answer |= UNKNOWN
        texts = _texts(names)
        if not texts and any(owner.kind in ("self", "proxy") for owner in owners):
            self.effects.any_call.append(call)
            if _SELF in owners and _may_be_send(call.args[1]):
                self.effects.any_event.append(call)
        found: _Values = frozenset().union(*(self._attribute(owners, text, call) for text in texts))
        return found.union(*default, _UNSURE) if default else found

    def _called(self, name: str, arguments: list[_Argument]) -> Effects:
        """Return the effects of a call of a function of the document."""
        function = self._definitions.functions[name]
        positional = _parameters(function)[0 if is_static(function) else 1 :]
        by_name = {*positional, *(each.arg for each in function.args.kwonlyargs)}
        passed: _Names = {}
        for place, node, values in arguments:
            parameter = place
            if isinstance(place, int):
                parameter = positional[place] if place < len(positional) else None
            if isinstance(parameter, str) and parameter in by_name:
                _add(passed, parameter, values)
            else:
                self._escape(node, values)
        return self._code.called(name, passed)


def _anything(node: ast.AST) -> Effects:
    """Return the effects of code that may do anything."""
    effects = Effects(answer=UNKNOWN)
    effects.allow_anything(node)
    return effects


def _add(names: _Names, name: str, values: _Values) -> None:
    if values:
        known = names.get(name, _NOTHING) | values
        if _OTHER in known or len(known) > _MOST_TEXTS:
            known = frozenset(value for value in known if value.kind != "text") | {_OTHER}
        names[name] = known


def _texts(values: _Values) -> list[str]:
    """Return all texts among values, none if some are unknown."""
    if _OTHER in values:
        return []
    return sorted(value.name for value in values if value.kind == "text")


def _may_be_send(name: ast.expr) -> bool:
    """Return whether a computed name of an attribute may be `send`."""
    match name:
        case ast.JoinedStr(values=[first, *_, last]) | ast.BinOp(op=ast.Add(), left=first, right=last):
            start, end = (part.value if isinstance(part, ast.Constant) else "" for part in (first, last))
            return any(each.startswith(str(start)) and each.endswith(str(end)) for each in _SEND)
    return True


def _parameters(function: ast.FunctionDef) -> list[str]:
    """Return the positional parameters; the first is the component."""
    return [each.arg for each in (*function.args.posonlyargs, *function.args.args)] or ["self"]


def _passed(state: State) -> Iterator[tuple[int, Argument]]:
    """Yield the arguments of a state, each with the id of an automaton that gets it."""
    for argument in state.arguments:
        for child in state.children if argument.child == NO_CHILD else (argument.child,):
            yield child, argument


def _elements(node: ast.expr) -> list[ast.expr]:
    """Return the elements of a literal tuple, list or set; none for any other expression."""
    return node.elts if isinstance(node, ast.Tuple | ast.List | ast.Set) else []
