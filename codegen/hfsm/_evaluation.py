"""Evaluate a piece of code without running it: the operations it calls, the events it sends, how it answers.

A capability (see `possible_values`) is followed only through these forms:

- names, `self.name`, `proxy.operation`, and the `begin`, `latest` and `wait` of an operation; `getattr` and
  `hasattr` with a name that is known, or of which a literal beginning or end is;
- `=`, `:=`, a literal tuple or list that as many targets unpack, and `for` over a literal tuple, list or set;
- `a if b else c`, `and`, `or`, `not`, `is`, the truth of a condition, and f-strings;
- calls of `self.send`, of operations, of nested functions, and of functions of the document that are
  defined once, undecorated (or as `staticmethod`) and no generators, with single arguments, by position or
  by name;
- `bool`, `print`, `repr` and `str` of it.

A text is known if it is a literal, an f-string or a `+` of known texts, or comes through these forms or out
of a container. What code puts into any list, table or the like is kept together, so that no item is missed:
an item of one may be any of them, and once something that is not followed has a container, anything. In any
other form, and that is all else that Python has, a capability *escapes*, and the value is unknown. All code
may use what has escaped, at any time, and a function that has escaped gets any arguments. Until something
escapes, unknown values are objects of libraries, which neither send nor command.

A guard keeps its answer only if it consists of the forms in `_STEADY`, and all that it reads is plain and
assigned by no code that may run within the cycle.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable
from typing import Final

from ._definitions import FINDERS, UNKNOWN, Answer, is_static, yields
from ._known_code import KnownCode
from ._literals import Items
from ._piece_effects import Effects, ProxyCall
from ._possible_values import (
    AGE,
    ANY,
    COMPONENT,
    CONTAINER,
    CONTAINERS,
    DATA,
    FAILED_ON,
    NOTHING,
    NUMBER,
    OTHER,
    PLAIN,
    READER,
    SAME_PROXY,
    SELF,
    TUPLE,
    UNSURE,
    WHOLE,
    Names,
    Value,
    Values,
    add_values,
    added,
    are_plain,
    are_texts,
    as_values,
    combined,
    matches,
    of_constant,
    parameters_of,
    shapes_of,
    texts_of,
    united,
)
from .code.text import binds, bound_names, child_nodes, dotted, evaluated_at_once

_HARMLESS: Final = frozenset({"bool", "print", "repr", "str"})
_DISPLAYS: Final = (ast.Constant, ast.Dict, ast.List, ast.Set, ast.Tuple)
_STEADY: Final = frozenset(
    {
        *(ast.Attribute, ast.BinOp, ast.BoolOp, ast.Call, ast.Compare, ast.IfExp, ast.JoinedStr, ast.Name),
        *(ast.Slice, ast.Starred, ast.Subscript, ast.UnaryOp, *_DISPLAYS, ast.FormattedValue, ast.keyword),
        *(ast.AnnAssign, ast.Assert, ast.Assign, ast.Expr, ast.If, ast.Pass, ast.Raise, ast.Return, ast.Try),
        *(ast.Match, ast.match_case, ast.MatchOr, ast.MatchSingleton, ast.MatchValue),
    }
)
_SERVED: Final = frozenset({"data", "operation", "proxy", "self"})
"""The kinds of the component, of servants and of their answers: nothing else assigns their attributes."""
_OF_TEXTS: Final = frozenset({"capitalize", "lower", "lstrip", "rstrip", "strip", "title", "upper"})
_JOINING: Final = (ast.Add, ast.Mult, ast.Sub, ast.BitOr, ast.BitAnd, ast.BitXor)
_OF_CONTAINERS: Final = frozenset(
    {
        *(
            "add",
            "append",
            "appendleft",
            "clear",
            "copy",
            "count",
            "discard",
            "extend",
            "get",
            "index",
            "insert",
        ),
        *("items", "keys", "pop", "popitem", "popleft", "remove", "reverse", "setdefault", "sort", "update"),
        "values",
    }
)
_MAKING: Final = frozenset(
    {"dict", "enumerate", "frozenset", "iter", "list", "reversed", "set", "sorted", "tuple", "zip"}
)
_TAKING_ONE: Final = frozenset({"max", "min", "next"})
_NO_FUNCTIONS: Final = frozenset({"number", "shape", "text", "whole"})
_FORMAT: Final = re.compile(r"%[^a-zA-Z%]*[a-zA-Z]|%%")
_SIGNS: Final = (ast.expr_context, ast.boolop, ast.operator, ast.unaryop, ast.cmpop)
_Argument = tuple[int | str | None, ast.expr, Values]  # its position or name, if it is single


class Evaluation:
    """Evaluate code: collect the values of `names`, and the `effects`.

    `value` evaluates an expression whose value is followed; from `visit` it escapes. The `context`
    distinguishes nested functions of the same text.
    """

    def __init__(
        self,
        code: KnownCode,
        names: Names,
        context: str,
        automaton: int = 0,
        *,
        is_function: bool = False,
    ) -> None:
        self.effects = Effects()
        self._is_function = is_function
        self._code, self._definitions = code, code.definitions
        self._names, self._context, self._automaton = names, context, automaton

    def visit(self, node: ast.AST) -> None:
        """Evaluate a statement, or an expression whose value is not followed."""
        if isinstance(node, ast.expr):
            self._give_away(node, self.value(node))
            return
        if type(node) not in _STEADY and not _is_plain_part(node):
            self._note(UNKNOWN)
        match node:
            case ast.Expr(value=value):
                self.value(value)
            case ast.Assign(targets=targets, value=value):
                for target in targets:
                    self._store(target, value)
            case ast.AnnAssign(target=target, value=ast.expr() as value):
                self._store(target, value)
            case ast.AugAssign(target=ast.Name() | ast.Attribute() as target, op=op, value=value):
                more, old = self.value(value), self._identity(target)
                self._give_away(node, (more | old) - CONTAINERS)  # it may change in place
                if old & CONTAINERS:
                    self._put(value, self._item(more))
                self._give(target, self._result(node, op, old, more))
            case ast.AugAssign(target=ast.Subscript(value=owner) as target, op=op, value=value):
                old, more = self._item(self.value(owner)), self.value(value)
                self._give_away(node, more - CONTAINERS)
                self._assign(target, self._result(node, op, old, more))
            case ast.Return(value=ast.expr() as value) if self._is_function:
                values = self.value(value)
                self._escape(node, values - CONTAINERS)
                is_known = are_plain(values - CONTAINER)
                self.effects.returned = united(self.effects.returned, values if is_known else UNSURE)
            case ast.For(target=target, iter=iterable) | ast.comprehension(target=target, iter=iterable):
                elements = _elements(iterable) or self._known_elements(iterable)
                for element in elements:
                    self._store(target, element)
                if not elements:
                    values = self.value(iterable)
                    self._escape(iterable, values - CONTAINERS)
                    self._assign(target, self._item(values))
                tests = node.ifs if isinstance(node, ast.comprehension) else []
                for test in tests:
                    self.value(test)
                self._inside(node, target, iterable, *tests)
            case ast.If(test=test) | ast.While(test=test) | ast.Assert(test=test):
                self.value(test)
                self._inside(node, test)
            case ast.FunctionDef(name=name) | ast.AsyncFunctionDef(name=name):
                self._bind(node, name, self._function(node, node.body))
            case ast.ClassDef(name=name):
                self.effects.add(self._nested(node, child_nodes(node)).effects)
                for attribute in bound_names(ast.Module(node.body, [])):
                    self._give_away(node, self._names.get(attribute, NOTHING))
                self._bind(node, name, UNSURE)
            case ast.ExceptHandler(type=ast.Name(id=kind), name=None) if self._definitions.is_builtin(kind):
                for each in node.body:
                    self.visit(each)
            case ast.MatchAs(pattern=None, name=None):
                pass
            case ast.MatchClass(kwd_attrs=names):
                for name in names:
                    self._attribute(UNSURE, name, node)
                self._inside(node)
            case ast.ImportFrom(module=str(path)) | ast.alias(name=path):
                is_renamed = path in FINDERS and getattr(node, "asname", None) is not None
                self._reflect(node, is_renamed or self._definitions.is_reflective_import(path))
                self._inside(node)
            case _:
                self._inside(node)

    def value(self, node: ast.expr) -> Values:
        """Return the values of an expression; none if it has none yet."""
        if isinstance(node, ast.Constant):
            return of_constant(node.value)
        if type(node) not in _STEADY:
            self._note(UNKNOWN)
        if isinstance(getattr(node, "ctx", None), ast.Store | ast.Del):  # of an unknown value
            if isinstance(node, ast.Name | ast.Attribute):
                self._give(node, UNSURE)
            elif isinstance(node, ast.Subscript):
                self._assign(node, UNSURE if isinstance(node.ctx, ast.Store) else NOTHING)
            else:
                self._note(UNKNOWN)
                self._inside(node)
            return NOTHING
        match node:
            case ast.Name() | ast.Attribute():
                values = self._identity(node)
                if not are_plain(values):
                    self._note(UNKNOWN)  # to use it may run code
                return values
            case ast.Call():
                return self._taken(node) or self._call(node)
            case ast.IfExp(test=test, body=body, orelse=orelse):
                self.value(test)
                return self.value(body) | self.value(orelse)
            case ast.BoolOp(values=values):
                return NOTHING.union(*[self.value(each) for each in values])
            case ast.NamedExpr(target=target, value=value):
                self._note(Answer.OTHER)
                self._store(target, value)
                return self.value(value)
            case ast.Lambda(body=body):
                return self._function(node, [body])
            case ast.GeneratorExp():
                return self._function(node, child_nodes(node))
            case ast.UnaryOp(op=ast.Not(), operand=operand):
                self.value(operand)
                return NUMBER
            case ast.Compare():
                return self._compare(node)
            case ast.BinOp(left=ast.Constant(value=str(text)), op=ast.Mod(), right=right):
                values = self._operand(right)
                return (
                    as_values([_FORMAT.sub(ANY, text)]) if values and are_plain(values) else combined(values)
                )
            case ast.Subscript(value=owner, slice=index) if items := self._items(owner):
                self._operand(index)
                return NOTHING.union(*[self.value(each) for _, each in items])
            case ast.BinOp(left=left, op=op, right=right):
                return self._result(node, op, self._operand(left), self._operand(right))
            case ast.Subscript(value=owner, slice=index):
                owners, place = self._operand(owner), self._operand(index)
                held = owners & CONTAINERS
                taken = held if isinstance(index, ast.Slice) else self._item(held)
                return taken if held and owners == held else taken | combined(owners - held, place)
            case ast.List() | ast.Set() | ast.Tuple() | ast.Dict():
                return self._display(node)
            case ast.ListComp() | ast.SetComp() | ast.DictComp():
                for generator in node.generators:
                    self.visit(generator)
                for each in [node.key, node.value] if isinstance(node, ast.DictComp) else [node.elt]:
                    self._put(each, self.value(each))
                return CONTAINER
            case ast.UnaryOp() | ast.Starred():
                operands = [each for each in child_nodes(node) if isinstance(each, ast.expr)]
                return combined(*[self._operand(each) for each in operands])
            case ast.JoinedStr(values=parts):
                return self._join(parts)
        self._inside(node)
        return UNSURE

    def _inside(self, node: ast.AST, *evaluated: ast.AST) -> None:
        """Visit what a node consists of; the names that it binds are unknown."""
        for name in () if isinstance(node, ast.Nonlocal) else binds(node):
            self._bind(node, name, UNSURE)
        for child in child_nodes(node):
            if child not in evaluated and not isinstance(child, _SIGNS):
                self.visit(child)

    def _note(self, answer: Answer) -> None:
        if answer is not Answer.SAME:  # nearly all are
            self.effects.answer |= answer

    def _escape(self, node: ast.AST, values: Iterable[Value]) -> None:
        """Record that code that is not followed has values: whatever they can do, it may do."""
        for value in values:
            if value in CONTAINER:
                self._code.contents = united(self._code.contents, UNSURE)  # it may put anything in
                continue
            if not value.is_plain and value not in (OTHER, READER):
                self._code.escaped.add(value)
                self.effects.add(self._code.effects_of(value), node)

    def _give_away(self, node: ast.AST, values: Values) -> None:
        """Let values escape; data may then change in place."""
        self._escape(node, values)
        self._code.escaped |= values & {DATA}

    def _reflect(self, node: ast.AST, leads_anywhere: bool) -> None:
        if leads_anywhere:
            self._definitions.is_opaque = True
            self._escape(node, COMPONENT)

    def _nested(self, node: ast.AST, body: Iterable[ast.AST], parameters: Iterable[str] = ()) -> Evaluation:
        """Evaluate the body of a nested function or class: it shares all names but the parameters."""
        context = f"{self._context} {id(node)}"
        own = self._code.parameters.setdefault(context, dict.fromkeys(parameters, NOTHING))
        if Value("local", context) in self._code.escaped or not _is_followed(node):
            for name in own:  # others may call it with anything
                add_values(own, name, UNSURE)
        is_function = isinstance(node, ast.FunctionDef)
        walk = Evaluation(self._code, self._names | own, context, self._automaton, is_function=is_function)
        for each in body:
            if isinstance(node, ast.Lambda) and isinstance(each, ast.expr):
                values = walk.value(each)
                walk._escape(each, values - CONTAINERS)
                walk.effects.returned = values if are_plain(values - CONTAINER) else UNSURE
            else:
                walk.visit(each)
        if isinstance(node, ast.FunctionDef) and not ends(node.body):
            walk.effects.returned |= NUMBER
        for name, values in walk._names.items():
            add_values(own if name in own else self._names, name, values)
        return walk

    def _function(self, node: ast.AST, body: Iterable[ast.AST]) -> Values:
        """Evaluate a nested function, which may be called at any later time, and return it as a value."""
        is_generator = isinstance(node, ast.GeneratorExp)
        for each in () if is_generator else evaluated_at_once(node):  # decorators and defaults
            self.visit(each)
        arguments = () if is_generator else ast.walk(node.args)  # type: ignore[attr-defined]
        walk = self._nested(node, body, [each.arg for each in arguments if isinstance(each, ast.arg)])
        self._code.local[walk._context] = walk.effects
        self.effects.add(Effects(events=walk.effects.events, any_event=walk.effects.any_event))
        found = frozenset({Value("local", walk._context)})
        is_changed = getattr(node, "decorator_list", ()) or isinstance(node, ast.AsyncFunctionDef)
        if not (is_changed or is_generator or yields(node)):
            return found
        self._escape(node, found)
        return UNSURE

    def _store(self, target: ast.expr, value: ast.expr) -> None:
        """Give the values of an expression to a target."""
        elements = _elements(value) if isinstance(value, ast.Tuple | ast.List) else []
        targets = _elements(target)
        has_star = any(isinstance(each, ast.Starred) for each in (*targets, *elements))
        if targets and len(targets) == len(elements) and not has_star:
            for one, other in zip(targets, elements, strict=True):
                self._store(one, other)
        elif isinstance(target, ast.Name | ast.Attribute):
            self._give(target, self.value(value))
        else:
            values = self.value(value)
            self._escape(value, values - CONTAINERS)
            self._assign(target, values)

    def _assign(self, target: ast.expr, values: Values) -> None:
        """Give values to a target, whose parts get their items."""
        match target:
            case ast.Name() | ast.Attribute():
                self._give(target, values)
            case ast.Starred(value=inner):
                self._put(target, values)
                self._assign(inner, CONTAINER)
            case ast.Tuple(elts=targets) | ast.List(elts=targets):
                self._note(UNKNOWN)
                for each in targets:
                    self._assign(each, self._item(values))
            case ast.Subscript(value=owner, slice=index):
                self._note(UNKNOWN)
                owners, place = self.value(owner), self.value(index)
                self._give_away(owner, (owners - CONTAINERS) | (owners & {DATA}))  # it changes in place
                for given in (values, place):
                    self._put(target, given)
                    if not owners or owners - CONTAINERS:
                        self._give_away(target, given)

    def _put(self, node: ast.AST, values: Values) -> None:
        """Put values into a container."""
        kept = frozenset(each for each in values if each.is_plain or each in CONTAINER)
        self._give_away(node, (values - kept) | (values & {DATA}))
        self._code.contents = united(self._code.contents, kept | (UNSURE if values - kept else NOTHING))

    def _item(self, values: Values) -> Values:
        """Return what an item of a value may be."""
        contents, found = UNSURE if self._definitions.is_opaque else self._code.contents, NOTHING
        for each in values:
            if each in CONTAINER:
                found |= contents
            elif each in TUPLE:
                found |= contents if are_plain(contents) else PLAIN
            elif each.is_plain:
                found |= frozenset({DATA}) if each == DATA else PLAIN
            else:
                found |= UNSURE
        return found

    def _display(self, node: ast.List | ast.Set | ast.Tuple | ast.Dict) -> Values:
        """Return what is spelled out: a tuple of plain values is one, too."""
        parts = [each for each in child_nodes(node) if isinstance(each, ast.expr)]
        found: list[Values] = []
        for each in parts:
            values = self._item(self.value(each.value)) if isinstance(each, ast.Starred) else self.value(each)
            if isinstance(node, ast.Dict) and node.keys[: len(node.keys)].count(None):
                values |= self._item(values)  # of `**`
            found.append(values)
            self._put(each, values)
        if isinstance(node, ast.Tuple) and are_plain(*found):
            return frozenset({DATA}) if any(DATA in each for each in found) else TUPLE
        return CONTAINER

    def _result(self, node: ast.AST, op: ast.operator, left: Values, right: Values) -> Values:
        """Return what an operator gives of two values."""
        held = (left | right) & CONTAINERS
        if held and (OTHER in left | right or not isinstance(op, _JOINING)):
            self._escape(node, held)
            return UNSURE
        if held:
            left, right = left - held, right - held
            kind = CONTAINER if held & CONTAINER else TUPLE
            return kind | self._result(node, op, left, right) if left and right else kind
        if isinstance(op, ast.Add):
            return added(left, right)
        found = combined(left, right)
        return NUMBER if found == WHOLE and isinstance(op, ast.Div | ast.Pow) else found

    def _give(self, target: ast.Name | ast.Attribute, values: Values) -> None:
        """Add values to those that a name or an attribute may have."""
        if self._automaton or isinstance(target, ast.Attribute):
            self._note(UNKNOWN)
        if isinstance(target, ast.Name):
            self._bind(target, target.id, values)
            return
        self._reflect(target, self._definitions.is_reflective(target.attr))
        owners = self._identity(target.value)
        is_own = owners <= COMPONENT
        if not is_own or target.attr in self._definitions.unclear_attributes:
            self._give_away(target, values | owners)  # to another object, or through code of a property
        self._code.escaped |= values & {DATA}
        add_values(self._code.attributes, target.attr, values if is_own else UNSURE)

    def _bind(self, node: ast.AST, name: str, values: Values) -> None:
        self._note(self._definitions.answer_of_name(name))
        if name in self._definitions.globals:
            self._give_away(node, values)
        add_values(self._names, name, values)

    def _identity(self, node: ast.expr) -> Values:
        """Return the values of an expression whose identity or attributes are used, not its value."""
        match node:
            case ast.Name(id=name):
                found = self._names.get(name)
                is_class = found is None and name in self._definitions.classes
                is_finder = bool(self._definitions.finder(node))  # which may be called by another name
                self._reflect(node, is_class or is_finder or self._definitions.is_reflective(name))
                self._note(self._definitions.answer_of_name(name))
                values = self._definitions.outside(name) if found is None else found
                if name in self._definitions.globals:
                    values |= UNSURE
            case ast.Attribute(value=owner, attr=name):
                if self._definitions.is_constant(node):
                    return NUMBER
                self._reflect(node, bool(self._definitions.finder(node)))
                owners = self._identity(owner)
                values = self._attribute(owners, name, node)
                if not owners or {each.kind for each in owners} - _SERVED:
                    self._note(self._definitions.answer_of_library(node))
            case _:
                return self.value(node)
        return values | UNSURE if DATA in values & self._code.escaped else values

    def _attribute(self, owners: Values, name: str, node: ast.AST) -> Values:
        """Return the values of an attribute of these owners."""
        is_hidden = OTHER in owners and self._definitions.is_private(name)
        self._reflect(node, is_hidden or self._definitions.is_reflective(name))
        if SELF in owners:
            self._note(self._definitions.answer_of_attribute(name, self._automaton))
            if name in self._definitions.unclear_attributes:
                self._escape(node, COMPONENT)
        if name == AGE and DATA in owners:
            self._note(Answer.UNKNOWN)
        if name == FAILED_ON and OTHER in owners:
            self._escape(node, COMPONENT)
        self._escape(node, owners & CONTAINER)  # a method may put anything in
        hidden = {each for each in owners if each.leaks_by(name)}
        self._escape(node, hidden - COMPONENT if name in self._definitions.defined else hidden)
        return NOTHING.union(*[self._attribute_of(each, name) for each in owners])

    def _attribute_of(self, owner: Value, name: str) -> Values:
        match owner.kind:
            case "self":
                found = self._code.attributes.get(name, NOTHING) | self._definitions.declared(name)
                return found | UNSURE if SELF in self._code.escaped else found
            case "proxy":
                return frozenset({Value("operation", f"{owner.name}.{name}")})
            case "operation" if name in ("latest", "wait"):
                return frozenset({READER})
            case "operation" | "function" | "send" | "local" if name in ("__call__", "begin"):
                return frozenset({owner})  # `begin` calls without waiting
            case "data" | "number" | "plain" | "shape" | "text" | "whole":
                return frozenset({owner}) if owner == DATA else PLAIN
        return UNSURE

    def _operand(self, node: ast.expr) -> Values:
        """Return the values of an expression on which an operator works: it gets them."""
        values = self.value(node)
        self._escape(node, values - CONTAINERS)
        return values

    def _compare(self, node: ast.Compare) -> Values:
        operators, compared = node.ops, [node.left, *node.comparators]
        if all(isinstance(each, ast.Is | ast.IsNot) for each in operators):
            for each in compared:
                self._identity(each)
            return NUMBER
        values = [self._operand(each) if not self._items(each) else NUMBER for each in compared]
        kinds = {value.kind for each in values for value in each}
        is_total = len(operators) == 1 and (kinds <= {"whole"} or kinds <= {"text", "shape"})
        self._code.is_total[node] = self._code.is_total.get(node, True) and is_total
        is_inside = [isinstance(each, ast.In | ast.NotIn) for each in operators]
        searched = [each for each, inside in zip(compared[1:], is_inside, strict=True) if inside]
        if not all(isinstance(each, _DISPLAYS) or self._items(each) for each in searched):
            self._note(UNKNOWN)  # it may be in a generator
        return NUMBER if all(is_inside) or are_plain(*values) else UNSURE

    def _join(self, parts: list[ast.expr]) -> Values:
        """Return the values of an f-string: texts if each part is a known text, whatever values it has."""
        joined = of_constant("")
        for part in parts:
            values = self.value(part.value if isinstance(part, ast.FormattedValue) else part)
            if isinstance(part, ast.FormattedValue) and (part.format_spec or part.conversion != -1):
                self.value(part.format_spec or ast.Constant(""))
                values = values and PLAIN
            if len(parts) == 1 and not are_plain(values):
                return UNSURE  # what an object gives for its text may be more than a text
            is_text = all(each.kind in ("text", "shape") for each in values)
            joined = added(joined, values if is_text else PLAIN)
        return joined

    def _call(self, call: ast.Call) -> Values:
        function, owners = call.func, NOTHING
        name = function.id if isinstance(function, ast.Name) else ""
        is_single = not any(isinstance(each, ast.Starred) for each in call.args)
        is_getattr = name in ("getattr", "hasattr") and len(call.args) in (2, 3) and not call.keywords
        if is_getattr and is_single and self._definitions.is_builtin(name):
            found = self._getattr(call)
            return NUMBER if name == "hasattr" else found
        if isinstance(function, ast.Attribute):
            owners = self._identity(function.value)
            found = self._attribute(owners, function.attr, function)
            found = frozenset(each for each in found if each.kind not in _NO_FUNCTIONS) or found
        else:
            is_finder = bool(self._definitions.finder(function))
            found = self._names.get(name, UNSURE) if is_finder else self._identity(function)
        kinds = {each.kind for each in found or UNSURE}
        self._code.called_kinds[call] = self._code.called_kinds.get(call, frozenset()) | kinds
        evaluate = self._identity if kinds == {"function"} else self.value
        arguments: list[_Argument] = []
        for place, each in enumerate(call.args):
            given = each.value if isinstance(each, ast.Starred) else each
            arguments.append((place if is_single else None, given, evaluate(given)))
        arguments += [(each.arg, each.value, evaluate(each.value)) for each in call.keywords]
        results: list[Values] = []
        for one in found or UNSURE:
            match one.kind:
                case "function":
                    results.append(self._call_function(one, call, arguments))
                case "operation" | "reader":
                    results.append(self._ask(one, owners, arguments, is_certain=len(found) == 1))
                case "send":
                    results.append(self._send(call, arguments))
                case _:
                    results.append(self._call_unknown(one, call, owners, arguments))
        return NOTHING.union(*results)

    def _ask(self, asked: Value, owners: Values, arguments: list[_Argument], *, is_certain: bool) -> Values:
        """Add the call of an operation, and return the answer: data, if it is not a future of data."""
        self._note(Answer.OTHER)
        for _, node, values in arguments:
            self._escape(node, values - CONTAINERS)
        proxy, _, name = asked.name.partition(".")
        if name:
            (self.effects.calls if is_certain else self.effects.possible).add(ProxyCall(proxy, name))
        if name in SAME_PROXY:
            return frozenset({Value("proxy", proxy)})
        is_direct = not name or all(each.kind == "proxy" for each in owners)
        is_data = owners and is_direct and proxy not in self._definitions.arriving
        return frozenset({DATA}) if is_data else UNSURE

    def _call_unknown(self, called: Value, call: ast.Call, owners: Values, given: list[_Argument]) -> Values:
        """Add a call that is not followed: what it gets escapes, unless it only computes with it."""
        if called.kind == "local":
            return self._call_local(called, call, given)
        self._give_away(call, frozenset({called}))
        is_text = are_plain(owners)
        self._note(self._definitions.answer_of_call(call, is_of_text=is_text))
        self._give_away(call, owners & {DATA})
        if finder := self._definitions.finder(call.func):
            for _, _, values in given if finder == "attrgetter" else given[:1]:
                self._reflect(call, not are_texts(values))
                for name in ".".join(texts_of(values)).split("."):
                    self._attribute(UNSURE, name, call)
        name = call.func.id if isinstance(call.func, ast.Name) else ""
        if name not in _HARMLESS or call.keywords or not self._definitions.is_builtin(name):
            keeps = not self._definitions.is_pure(call, is_of_text=is_text)
            for _, node, values in given:
                if keeps:
                    self._give_away(node, values - CONTAINERS if self._is_log(call) else values)
                else:
                    self._escape(node, values - CONTAINERS if name in ("len", "isinstance") else values)
        results = [values for _, _, values in given]
        method = call.func.attr if isinstance(call.func, ast.Attribute) and not given else ""
        if method in _OF_TEXTS and are_texts(owners) and not self._definitions.is_opaque:
            return as_values(getattr(each, method)() for each in texts_of(owners))
        return self._definitions.result_of(call, is_of_text=is_text, arguments=results)

    def _call_local(self, called: Value, call: ast.Call, given: list[_Argument]) -> Values:
        """Add a call of a nested function, and the values of its parameters; return what it returns."""
        self._note(UNKNOWN)
        parameters = self._code.parameters.get(called.name, {})
        names = dict(enumerate(parameters))
        for place, node, values in given:
            name = names.get(place, "") if isinstance(place, int) else place
            if name in parameters:
                add_values(parameters, name, values)
            else:
                self._escape(call, frozenset({called}))
                self._give_away(node, values)
        effects = self._code.local.get(called.name, Effects())
        self.effects.add(effects, call)
        return effects.returned

    def _send(self, call: ast.Call, arguments: list[_Argument]) -> Values:
        self._note(UNKNOWN)
        events: list[str] = []
        for place, node, values in arguments:
            if place in (0, "name"):
                events = shapes_of(values)  # the runtime refuses what is no text
                for event in events:
                    known = (
                        [event]
                        if ANY not in event
                        else (each for each in self._code.waited if matches(event, each))
                    )
                    for each in known:
                        self.effects.events.setdefault(each, set()).add(node)
            else:
                self._escape(node, values)
        if not events:
            self.effects.any_event.append(call)
        return NUMBER

    def _call_function(self, value: Value, call: ast.Call, arguments: list[_Argument]) -> Values:
        """Add the effects of a call of a function of the document with these arguments."""
        function = self._definitions.functions[value.name]
        parameters: dict[int | str | None, str] = {}
        parameters.update(enumerate(parameters_of(function)[0 if is_static(function) else 1 :]))
        parameters.update((each.arg, each.arg) for each in (*function.args.args, *function.args.kwonlyargs))
        is_followed = not yields(function) and not any(place is None for place, _, _ in arguments)
        passed: Names = {}
        for place, node, values in arguments:
            if is_followed and place in parameters:
                add_values(passed, parameters[place], values)
            else:
                self._give_away(node, values)
        if is_followed:
            called = self._code.called(value.name, passed)
            self.effects.add(called, call)
            return called.returned
        self._escape(call, frozenset({value}))
        return UNSURE

    def _items(self, node: ast.expr) -> Items:
        """Return the items of a literal that nothing changes; none of anything else."""
        items: Items = []
        match node:
            case ast.Name(id=name) if items := self._code.literals.get(name, []):
                self._note(self._definitions.answer_of_name(name))
            case ast.Attribute(value=owner, attr=name) if items := self._code.literals.get(f".{name}", []):
                if self._identity(owner) != COMPONENT or SELF in self._code.escaped:
                    return []
                self._note(self._definitions.answer_of_attribute(name, self._automaton))
        return [] if self._definitions.is_opaque else items

    def _known_elements(self, node: ast.expr) -> list[ast.expr]:
        """Return the elements of something to loop over: of such a literal, or of a range."""
        match node:
            case ast.Call(func=ast.Attribute(value=owner, attr=name), args=[], keywords=[]):
                items = self._items(owner)
                if name == "items":
                    return [ast.Tuple([key, value], ast.Load()) for key, value in items]
                return [key if name == "keys" else value for key, value in items]
            case ast.Call(func=ast.Name(id=name), args=[inner, *_] as given, keywords=[]):
                elements: list[ast.expr] = []
                if name == "enumerate" and len(given) == 1:
                    inside = _elements(inner) or self._known_elements(inner)
                    elements = [ast.Tuple([ast.Constant(0), each], ast.Load()) for each in inside]
                elif name == "range" and all(are_plain(self.value(each)) for each in given):
                    elements = [ast.Constant(0)]
                return elements if self._definitions.is_builtin(name) else []
        items = self._items(node)
        are_places = all(getattr(key, "value", None) == place for place, (key, _) in enumerate(items))
        return [value if are_places else key for key, value in items]

    def _is_log(self, call: ast.Call) -> bool:
        return dotted(call.func)[:2] == ["self", "log"] and self._definitions.defined.isdisjoint(["log"])

    def _taken(self, call: ast.Call) -> Values:
        """Return what a call gives that only takes something out of containers or puts it in, or nothing."""
        match call:
            case ast.Call(func=ast.Attribute(value=owner, attr="get"), args=[key, *default], keywords=[]) if (
                items := self._items(owner)
            ):
                self._operand(key)
                others = [self.value(each) for each in default] or [NUMBER]
                return NOTHING.union(*others, *[self.value(each) for _, each in items])
            case ast.Call(func=ast.Attribute(value=ast.Name(), attr="choice"), args=[given], keywords=[]):
                if self._definitions.is_random_choice(call):
                    self._note(Answer.OTHER)
                    items = self._items(given)
                    if items:
                        return NOTHING.union(*[self.value(each) for _, each in items])
                    values = self.value(given)
                    self._give_away(given, values - CONTAINERS)
                    return self._item(values)
            case ast.Call(func=ast.Attribute(value=owner, attr=name), keywords=keywords) if (
                name in _OF_CONTAINERS
            ):
                values = self.value(owner) if isinstance(owner, ast.Name | ast.Attribute) else NOTHING
                if values and values <= CONTAINERS and (not keywords or name == "sort"):
                    return self._of_container(call, name)
            case ast.Call(func=ast.Name(id=name), args=[_, *_] as given) if name in _MAKING | _TAKING_ONE:
                is_known = self._definitions.is_builtin(name) and not any(
                    isinstance(each, ast.Starred) for each in given
                )
                if is_known and not (name in ("max", "min") and len(given) > 1):
                    return self._made(call, name)
        return NOTHING

    def _of_container(self, call: ast.Call, name: str) -> Values:
        """Return what a method of a container gives."""
        self._note(self._definitions.answer_of_call(call, is_of_text=False))
        for named in call.keywords:
            self._give_away(named, self.value(named.value))
        given = NOTHING
        for each in call.args:
            values = self.value(each)
            given |= values
            self._put(each, self._item(values) if name in ("extend", "update") else values)
        if name in ("pop", "popleft", "get", "setdefault"):
            return self._code.contents | given | NUMBER
        return CONTAINER if name in ("copy", "items", "keys", "popitem", "values") else NUMBER

    def _made(self, call: ast.Call, name: str) -> Values:
        """Return what a function of Python makes of containers, or takes out of them."""
        self._note(self._definitions.answer_of_call(call, is_of_text=False))
        for named in call.keywords:
            match named.value:
                case ast.Attribute(value=owner, attr="count" | "get" | "index") if (
                    owners := self.value(owner)
                ) and owners <= CONTAINERS:
                    pass  # it only reads
                case value:
                    self._give_away(named, self.value(value))
                    if name == "dict":
                        self._put(named, self.value(value))
        first, *others = [self.value(each) for each in call.args]
        self._escape(call, first - CONTAINERS)
        if name in _TAKING_ONE:
            return self._item(first).union(*others)
        for values in (first, *others) if name == "zip" else (first,):
            self._put(call, self._item(values))
        for values in others if name != "zip" else ():
            self._give_away(call, values)
        if name == "enumerate":
            self._put(call, WHOLE)
        if name == "dict":
            self._put(call, self._item(self._item(first)))
        return CONTAINER

    def _getattr(self, call: ast.Call) -> Values:
        self._note(UNKNOWN)
        owners, names, *default = [self.value(each) for each in call.args]
        found = NOTHING.union(*default)
        if texts := texts_of(names):
            return found.union(*[self._attribute(owners, text, call) for text in texts])
        if not names or are_plain(owners):
            return found | (PLAIN if names else NOTHING)
        ends = ["", ""]
        match call.args[1]:
            case ast.JoinedStr(values=[first, *_, last]) | ast.BinOp(op=ast.Add(), left=first, right=last):
                ends = [str(each.value) if isinstance(each, ast.Constant) else "" for each in (first, last)]
        start, end = ends
        if not (start or end) or start.startswith("_") or end.endswith("_"):
            self._definitions.is_opaque = True  # it may be a special attribute
            self._escape(call, owners | COMPONENT)
            return UNSURE
        self._escape(call, owners - COMPONENT)
        if OTHER in owners and FAILED_ON.startswith(start) and FAILED_ON.endswith(end):
            self._escape(call, COMPONENT)
        if SELF in owners:
            self.effects.any_call.append(call)
            for name in self._code.names_of_component():
                if name.startswith(start) and name.endswith(end):
                    values = self._attribute(COMPONENT, name, call)
                    self._give_away(call, frozenset(each for each in values if each.kind != "proxy"))
                    found |= values
        return found | UNSURE


def _is_plain_part(node: ast.AST) -> bool:
    """Return whether a part of `try` or `match` binds no name: `except ValueError` and `case _`."""
    match node:
        case ast.ExceptHandler(type=ast.Name(), name=None) | ast.MatchAs(pattern=None, name=None):
            return True
    return False


def _is_followed(node: ast.AST) -> bool:
    """Return whether a nested function gets its arguments one by one, and has no others."""
    match node:
        case ast.FunctionDef(decorator_list=[], args=given) | ast.Lambda(args=given):
            has_others = (
                given.vararg or given.kwarg or given.defaults or given.kw_defaults or given.posonlyargs
            )
            return not has_others and not yields(node)
    return False


def ends(body: list[ast.stmt]) -> bool:
    """Return whether code certainly returns, or raises."""
    match body:
        case [*_, ast.Return() | ast.Raise()]:
            return True
        case [*_, ast.If(body=one, orelse=other)]:
            return ends(one) and ends(other)
    return False


def _elements(node: ast.expr) -> list[ast.expr]:
    """Return the elements of a literal tuple, list or set; none for any other expression."""
    return node.elts if isinstance(node, ast.Tuple | ast.List | ast.Set) else []
