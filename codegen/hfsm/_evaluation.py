"""Evaluate a piece of code without running it: the operations it calls, the events it sends, how it answers.

What a name may be (the component, a proxy, an operation, a function, a text) is followed through assignments,
loops over literal lists, and calls of functions of the document, so that `getattr(self, f"{side}Motors")` is
understood if `side` is known. Code that cannot be followed may do anything.

A guard answers the same again only if it reads nothing but plain values, which `possible_values` defines: all
that the document gives to a name must be plain.
"""

from __future__ import annotations

import ast
from collections.abc import Iterable
from typing import TYPE_CHECKING, Final

from ._definitions import UNKNOWN, Answer, is_static
from ._piece_effects import Effects, ProxyCall
from ._possible_values import (
    COMPONENT,
    MOST_TEXTS,
    NOTHING,
    NUMBER,
    OTHER,
    PLAIN,
    READER,
    SAME_PROXY,
    SELF,
    SENDER,
    UNSURE,
    Names,
    Value,
    Values,
    add_values,
    are_plain,
    as_values,
    combined,
    parameters_of,
    texts_of,
)
from .code.names import COMPONENT_ALIASES, COMPONENT_ATTRIBUTES
from .code.text import binds, bound_names, child_nodes

if TYPE_CHECKING:
    from ._effects import CodeEffects

_SEND: Final = frozenset({"send", "_hfsm_send"})
_HARMLESS: Final = frozenset({"bool", "print", "repr", "str", "type"})
"""Builtins that do nothing with their arguments."""
_SIGNS: Final = (ast.expr_context, ast.boolop, ast.operator, ast.unaryop, ast.cmpop)
"""Nodes that have no effects: a third of all."""


_Argument = tuple[int | str | None, ast.expr, Values]
"""The position or name of an argument (None if unknown), its expression and its values."""


class Evaluation:
    """Evaluate code: collect the values of `names`, and the `effects`.

    `value` evaluates an expression whose value is followed. `visit` is for expressions whose value is not:
    the component or a proxy makes the code unclear there, and a function may be called.
    """

    def __init__(self, code: CodeEffects, names: Names, context: str, automaton: int = 0) -> None:
        self.effects = Effects()
        self._code, self._definitions = code, code.definitions
        self._names = names
        self._context = context
        """Distinguishes nested functions of the same text."""
        self._automaton = automaton

    def visit(self, node: ast.AST) -> None:
        """Evaluate a statement, or an expression whose value is not followed."""
        if isinstance(node, _SIGNS):
            return
        self._note(node)
        match node:
            case ast.Expr(value=value):
                self.value(value)
            case ast.Assign(targets=targets, value=value):
                for target in targets:
                    self._store(target, value)
            case ast.AnnAssign(target=target, value=ast.expr() as value):
                self._store(target, value)
            case ast.AugAssign(target=ast.Name() | ast.Attribute() as target, value=value):
                added = self.value(value)
                self._escape(node, added)
                self._give(target, combined(self.value(target), added))
            case ast.For(target=target, iter=iterable) | ast.comprehension(target=target, iter=iterable):
                self._loop(node, target, iterable)
            case ast.If(test=test) | ast.While(test=test) | ast.Assert(test=test):
                self.value(test)
                self._inside(node, test)
            case ast.Attribute(ctx=ast.Store() | ast.Del()):
                self._give(node, UNSURE)
            case ast.Tuple(ctx=ast.Store()) | ast.List(ctx=ast.Store()) | ast.Starred(ctx=ast.Store()):
                self._inside(node)  # what is unpacked may be anything
            case ast.FunctionDef(name=name) | ast.AsyncFunctionDef(name=name):
                add_values(self._names, name, self._function(node, node.body))
            case ast.ClassDef(name=name):
                self._class(node)
            case ast.Name(ctx=ast.Load()):
                self._escape(node, self.value(node))
            case ast.Name() | ast.alias() | ast.ExceptHandler() | ast.pattern():
                for name in binds(node):
                    add_values(self._names, name, UNSURE)
                self._reflect(node, getattr(node, "name", None) or "")
                self._inside(node)
            case ast.expr():
                self._escape(node, self.value(node))
            case _:
                self._inside(node)

    def _note(self, node: ast.AST) -> None:
        answer = self._definitions.answer_of_node(node, self._automaton)
        if answer is not Answer.SAME:  # nearly all are
            self.effects.answer |= answer

    def _reflect(self, node: ast.AST, name: str) -> None:
        if name in self._definitions.reflection:
            self.effects.allow_anything(node)

    def _inside(self, node: ast.AST, *evaluated: ast.AST) -> None:
        for child in child_nodes(node):
            if child not in evaluated:
                self.visit(child)

    def _function(
        self, node: ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda, body: Iterable[ast.AST]
    ) -> Values:
        """Evaluate a nested function, and return it as a value."""
        decorators = [] if isinstance(node, ast.Lambda) else node.decorator_list
        defaults = [*node.args.defaults, *(each for each in node.args.kw_defaults if each is not None)]
        for evaluated in (*decorators, *defaults):
            self.visit(evaluated)
        parameters = {each.arg for each in ast.walk(node.args) if isinstance(each, ast.arg)}
        names = {**self._names, **dict.fromkeys(parameters, UNSURE)}
        walk = Evaluation(self._code, names, f"{self._context} {id(node)}", self._automaton)
        for each in body:
            walk.visit(each)
        for name, values in names.items():
            if name not in parameters:
                add_values(self._names, name, values)
        self._code.local[walk._context] = walk.effects
        self.effects.add_events(walk.effects)  # at any later call
        self.effects.any_event += walk.effects.any_event
        found = frozenset({Value("local", walk._context)})
        if decorators:
            self._escape(node, found)
        return found

    def _class(self, node: ast.ClassDef) -> None:
        """Evaluate a nested class: if it uses or holds the component, it may do anything with it."""
        names = dict(self._names)
        walk = Evaluation(self._code, names, f"{self._context} {id(node)}", self._automaton)
        walk._inside(node)
        attributes = bound_names(ast.Module(node.body, []))
        for name, values in names.items():
            methods = {each for each in values if each.kind == "local"} - self._names.get(name, NOTHING)
            walk._escape(node, values if name in attributes else frozenset(methods))
            if name in self._names:
                add_values(self._names, name, values - methods)
        done = walk.effects
        if done.calls or done.possible or done.events or done.any_call or done.any_event:
            self.effects.allow_anything(node)
        add_values(self._names, node.name, UNSURE)

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
                self._give(target, self.value(value))
            case ast.Attribute(value=owner) if (owners := self._owner(owner)) & {SELF}:
                self._note(target)
                values = self.value(value)
                self._give(target, values)
                if len(owners) > 1:
                    self._escape(value, values)
            case _:
                self.visit(target)
                self.visit(value)

    def _give(self, target: ast.Name | ast.Attribute, values: Values) -> None:
        """Add values to those that a name or an attribute may have."""
        if isinstance(target, ast.Name):
            add_values(self._names, target.id, values)
            return
        owners = self._owner(target.value)
        if SELF in owners and self._definitions.is_unclear_attribute(target.attr):
            self.effects.allow_anything(target)  # a property may run code, too
        if OTHER in owners and self._definitions.is_unknown(target.value):
            self.effects.unknown.append(target)
        # another object may be the component, or its class
        add_values(self._code.attributes, target.attr, values if SELF in owners else UNSURE)

    def _use(self, operation: Value, *, is_certain: bool) -> None:
        proxy, _, name = operation.name.partition(".")
        (self.effects.calls if is_certain else self.effects.possible).add(ProxyCall(proxy, name))

    def _escape(self, node: ast.AST, values: Values) -> None:
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

    def value(self, node: ast.expr) -> Values:
        """Return the values of an expression; none if it has none yet."""
        if isinstance(node, ast.Constant):
            return as_values([node.value]) if isinstance(node.value, str) else NUMBER
        self._note(node)
        match node:
            case ast.Name() | ast.Attribute():
                return self._used(node, self._read(node))
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
            case ast.Lambda(body=body):
                return self._function(node, [body])
            case ast.UnaryOp(op=ast.Not(), operand=operand):
                self.value(operand)
                return NUMBER
            case ast.UnaryOp(operand=operand):
                return combined(self.value(operand))
            case ast.Compare(left=left, comparators=others, ops=operators):
                return self._compare(operators, [left, *others])
            case ast.BinOp(left=left, op=operator, right=right):
                first, second = self._passed(left), self._passed(right)
                texts = [text + more for text in texts_of(first) for more in texts_of(second)]
                return as_values(texts if isinstance(operator, ast.Add) else []) or combined(first, second)
            case ast.Subscript(value=owner, slice=place):
                return combined(self._passed(owner), self._passed(place))
            case ast.Tuple(elts=elements):
                return combined(NUMBER, *map(self._passed, elements))
            case ast.JoinedStr():
                return as_values(self._texts(node)) or PLAIN
        self._inside(node)
        return UNSURE

    def _passed(self, node: ast.expr) -> Values:
        """Return the values of an expression that other code may get."""
        values = self.value(node)
        self._escape(node, values)
        return values

    def _compare(self, operators: list[ast.cmpop], compared: list[ast.expr]) -> Values:
        """Return the values of a comparison."""
        if all(isinstance(each, ast.Is | ast.IsNot) for each in operators):
            for each in compared:
                self._owner(each)
            return NUMBER
        values = [self._passed(each) for each in compared]
        is_inside = all(isinstance(each, ast.In | ast.NotIn) for each in operators)
        return NUMBER if is_inside or are_plain(*values) else UNSURE

    def _used(self, node: ast.expr, values: Values) -> Values:
        """Return the values of a name or attribute that is used: if they are not plain, this may run code."""
        if not are_plain(values):
            self.effects.answer |= UNKNOWN
            if OTHER in values and self._definitions.is_unknown(node):
                self.effects.unknown.append(node)
            if SELF in values and self._definitions.has_special_methods:
                self.effects.allow_anything(node)
        return values

    def _owner(self, node: ast.expr) -> Values:
        """Return the values of an expression whose identity or attributes are used, not its value."""
        if isinstance(node, ast.Name | ast.Attribute):
            self._note(node)
            return self._read(node)
        return self.value(node)

    def _read(self, node: ast.Name | ast.Attribute) -> Values:
        """Return the values of a name or an attribute."""
        if isinstance(node, ast.Name):
            self._reflect(node, node.id)
            is_outside = node.id in self._definitions.libraries or node.id in self._definitions.globals
            return self._names.get(node.id, UNSURE if is_outside else NOTHING)
        if self._definitions.is_constant(node):
            return NUMBER
        return self._attribute(self._owner(node.value), node.attr, node)

    def _attribute(self, owners: Values, name: str, node: ast.AST) -> Values:
        """Return the values of an attribute."""
        self._reflect(node, name)
        if SELF in owners:
            self.effects.reads_component = True
            if self._definitions.is_unclear_attribute(name):
                self.effects.allow_anything(node)
        self._escape(node, frozenset({OTHER, *(owner for owner in owners if self._leaks(owner, name))}))
        return frozenset().union(*(self._attribute_of(owner, name) for owner in owners))

    def _leaks(self, owner: Value, name: str) -> bool:
        """Return whether an attribute may lead to the component or another value that is followed."""
        if owner == SELF and (name in _SEND or self._definitions.is_assigned(name)):
            return False
        # to build the automata again gives their code to the caller
        return owner.leaks_by(name) or (owner == SELF and name.startswith("automaton"))

    def _attribute_of(self, owner: Value, name: str) -> Values:
        """Return the values of an attribute of a value."""
        match owner.kind:
            case "proxy":
                return frozenset({Value("operation", f"{owner.name}.{name}")})
            case "operation" if name == "begin":  # without waiting
                return frozenset({owner})
            case "operation" if name in ("latest", "wait"):
                return frozenset({READER})
            case "number" | "plain" | "text":
                return PLAIN
            case "operation" | "function" | "send" | "local" if name == "__call__":
                return frozenset({owner})
            case "self" if name == "__class__":
                return COMPONENT
            case "self":
                return self._code.attributes.get(name, NOTHING) | self._declared(name)
        return UNSURE

    def _declared(self, name: str) -> Values:
        """Return the values of an attribute of the component that no code assigns."""
        if name in self._definitions.proxies:
            return frozenset({Value("proxy", name)})
        function = {Value("function", name)} if name in self._definitions.functions else set()
        found = frozenset(function | ({SENDER} if name in _SEND else set()))
        if found or self._definitions.is_assigned(name):
            return found
        if name in COMPONENT_ALIASES:
            return COMPONENT
        return UNSURE if name in COMPONENT_ATTRIBUTES or name.startswith("__") else NOTHING

    def _texts(self, node: ast.expr) -> list[str]:
        """Return the texts that an expression may be, none if they are unknown."""
        match node:
            case ast.Constant(value=str() as value):
                return [value]
            case ast.JoinedStr(values=parts):
                texts = [""]
                for more in [self._texts(part) for part in parts]:
                    texts = [text + each for text in texts for each in more]
                    texts = texts if len(texts) <= MOST_TEXTS else []
                return texts
            case ast.FormattedValue(value=value, format_spec=None):
                found = self.value(value)
                return texts_of(found) if node.conversion == -1 else []
        self._inside(node)
        return []

    def _call(self, call: ast.Call) -> Values:
        called = call.func
        name = called.id if isinstance(called, ast.Name) else ""
        if name in ("getattr", "hasattr") and len(call.args) > 1:
            return self._getattr(call)
        if name == "super" and not call.args:
            return COMPONENT
        if name == "type" and len(call.args) == 1 and SELF in self._owner(call.args[0]):
            return COMPONENT
        owners = self._owner(called.value) if isinstance(called, ast.Attribute) else UNSURE
        match called:
            case ast.Name():
                found = self._read(called)
            case ast.Attribute(attr=attribute):
                found = self._attribute(owners, attribute, called)
            case _:
                found = self.value(called)
        functions = frozenset(each for each in found if not each.is_plain)
        kinds = {each.kind for each in functions}
        evaluate = self._owner if kinds == {"function"} else self.value  # it is followed into the function
        is_spread = any(isinstance(each, ast.Starred) for each in call.args)
        arguments: list[_Argument] = [
            (None if is_spread else place, each, evaluate(each)) for place, each in enumerate(call.args)
        ]
        arguments += [(each.arg, each.value, evaluate(each.value)) for each in call.keywords]
        if kinds and kinds <= {"function", "operation", "reader", "send"}:
            for each in functions:
                if each.kind == "operation":
                    self._use(each, is_certain=len(functions) == 1)
                self._follow(each, call, arguments)
            return frozenset().union(*(self._result(each, owners) for each in functions))
        is_of_text, of_plain = are_plain(owners), are_plain(*(values for _, _, values in arguments))
        self.effects.answer |= self._definitions.answer_of_call(call, is_of_text=is_of_text)
        is_plain = self._definitions.has_plain_result(call, is_of_text=is_of_text, of_plain=of_plain)
        result = PLAIN if is_plain else UNSURE
        if name in _HARMLESS and name not in self._definitions.bound:
            return result
        if kinds != {"local"} and self._definitions.is_unknown(called):
            self.effects.unknown.append(call)
        self._escape(call, functions)
        for _, node, values in arguments:
            self._escape(node, values)
        return result

    def _follow(self, function: Value, call: ast.Call, arguments: list[_Argument]) -> None:
        """Add the effects of a call of a known function."""
        if function.kind == "function":
            self.effects.add(self._called(function.name, arguments), call)
        elif function.kind in ("operation", "reader"):
            self.effects.answer |= Answer.OTHER
        else:
            self.effects.answer |= UNKNOWN
            names = [(node, texts_of(values)) for place, node, values in arguments if place in (0, "name")]
            for node, events in names:
                for event in events:
                    self.effects.events.setdefault(event.strip(), set()).add(node)
            if not names or not names[0][1]:
                self.effects.any_event.append(call)

    def _result(self, function: Value, owners: Values) -> Values:
        """Return what the call of a known function of these owners gives; servants answer with data."""
        if function.kind == "reader":
            return PLAIN
        proxy, _, operation = function.name.partition(".")
        if operation in SAME_PROXY:
            return frozenset({Value("proxy", proxy)})
        is_direct = {each.kind for each in owners} == {"proxy"}  # and begins no call, which gives a future
        return PLAIN if is_direct and proxy not in self._definitions.arriving else UNSURE

    def _getattr(self, call: ast.Call) -> Values:
        owners, names, *default = [self.value(each) for each in call.args]
        self.effects.answer |= UNKNOWN
        texts = texts_of(names)
        if not texts and any(owner.kind in ("self", "proxy") for owner in owners):
            self.effects.any_call.append(call)
        if not texts and SELF in owners:
            names_of_self = {*_SEND, *self._definitions.functions, *self._code.attributes}
            any_of_them = Evaluation(self._code, self._names, self._context)
            for text in _matching(call.args[1], names_of_self):
                any_of_them._escape(call, self._attribute_of(SELF, text))
            self.effects.add_events(any_of_them.effects)
            self.effects.any_event += any_of_them.effects.any_event
        found: Values = frozenset().union(*(self._attribute(owners, text, call) for text in texts))
        return found.union(*default, UNSURE) if default else found

    def _called(self, name: str, arguments: list[_Argument]) -> Effects:
        """Return the effects of a call of a function of the document."""
        function = self._definitions.functions[name]
        positional = parameters_of(function)[0 if is_static(function) else 1 :]
        by_name = {*positional, *(each.arg for each in function.args.kwonlyargs)}
        passed: Names = {}
        for place, node, values in arguments:
            parameter = place
            if isinstance(place, int):
                parameter = positional[place] if place < len(positional) else None
            if isinstance(parameter, str) and parameter in by_name:
                add_values(passed, parameter, values)
            else:
                self._escape(node, values)
        return self._code.called(name, passed)


def _matching(computed: ast.expr, names: Iterable[str]) -> list[str]:
    """Return the names that a computed text may be, by its literal beginning and end."""
    start = end = ""
    match computed:
        case ast.JoinedStr(values=[first, *_, last]) | ast.BinOp(op=ast.Add(), left=first, right=last):
            start, end = (str(part.value) if isinstance(part, ast.Constant) else "" for part in (first, last))
    return [name for name in names if name.startswith(start) and name.endswith(end)]


def _elements(node: ast.expr) -> list[ast.expr]:
    """Return the elements of a literal tuple, list or set; none for any other expression."""
    return node.elts if isinstance(node, ast.Tuple | ast.List | ast.Set) else []
