"""Find code that makes something larger and larger whenever it runs.

Names are those of variables, parameters, attributes (with a dot) and functions, wherever they stand. A name
*comes from itself* if what it gets mentions it, or a name that comes from it. Then what it gets may mention
one such name, once, and only take something out of it or add to it: `n = n + 1`, `xs.append(2)`,
`xs = xs[1:]`. All else may double whenever it runs: `xs + xs`, `n * n`, `(x, 1)`. Floats and what servants
answer come from nothing, and what does not come from itself is as large as the document spells out.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from itertools import chain
from typing import Final

from ...graphs import reached
from .._calls import ADDING, KEEPING, STORING, gives_float, has_fixed_size
from .._definitions import is_static
from ..code.text import all_nodes, binds, child_nodes

_Function = ast.FunctionDef | ast.Lambda
_Gift = tuple[ast.expr | None, ast.AST, bool]
"""What a name gets, None if that is unknown; by which node; whether that changes the object of the name."""
_NEW: Final = (ast.Dict, ast.JoinedStr, ast.List, ast.Set, ast.Tuple, ast.comprehension)
_ANYTHING: Final = "*"
"""The name of what may come from all names."""


class Values:
    """What code gives to names; `full` returns the full name of a function of Python or of a library."""

    def __init__(
        self,
        nodes: Sequence[ast.AST],
        of_class: Collection[ast.AST],
        given: Mapping[str, ast.expr | None],
        full: Callable[[ast.AST], str],
        asks: Callable[[ast.Call], bool],
    ) -> None:
        self._full, self._asks = full, asks
        self.functions: dict[str, list[_Function]] = {}
        """Functions, by names that nothing else has."""
        self._gifts: dict[str, list[_Gift]] = {each: [(given[each], ast.Pass(), False)] for each in given}
        for node in nodes:
            scope = "." if node in of_class else ""
            for name, gift in _gifts_of(node):
                self._gifts.setdefault(name if name.startswith(".") else f"{scope}{name}", []).append(gift)
            match node:
                case ast.FunctionDef(name=name) as function:
                    self.functions.setdefault(f"{scope}{name}", []).append(function)
                case ast.Assign(targets=[ast.Name(id=name)], value=ast.Lambda() as function):
                    self.functions.setdefault(f"{scope}{name}", []).append(function)
        for name in [*self.functions]:
            if not all(isinstance(each, ast.Lambda) for each in self.given(name)):
                del self.functions[name]
        self._pass_arguments(nodes)
        for name, functions in self.functions.items():
            self._gifts[name] = [
                (each, each, False) for function in functions for each in _returned(function)
            ]
        self._floats = {*self._gifts}
        while unlike := [name for name in self._floats if not all(map(self._is_float, self.given(name)))]:
            self._floats.difference_update(unlike)
        sources = self._sources()
        self._from = {name: reached([name], lambda each: sources.get(each, ())) for name in sources}
        self._growing = {
            node
            for name, gifts in self._gifts.items()
            for value, node, _ in gifts
            if self._doubles(name, value)
        }

    def given(self, name: str) -> list[ast.expr | None]:
        """Return the expressions from which the values of a name come; None for those that are unknown."""
        return [value for value, *_ in self._gifts.get(name, ())]

    def come_from(self, value: ast.expr, names: Collection[str]) -> bool:
        """Return whether a value may come from some names."""
        return any(not self._from.get(each, {each}).isdisjoint(names) for each in self._names(value))

    def _pass_arguments(self, nodes: Sequence[ast.AST]) -> None:
        """Give the parameters of functions what calls pass: anything, if others have the function."""
        calls = [each for each in nodes if isinstance(each, ast.Call)]
        uses = {each for each in nodes if isinstance(getattr(each, "ctx", None), ast.Load)}
        others = {last_name(each) for each in uses.difference(each.func for each in calls)}
        names = {each: name for name, functions in self.functions.items() for each in functions}
        for function in (each for each in nodes if isinstance(each, _Function)):
            name = names.get(function, "")
            is_bound = name.startswith(".") and not (
                isinstance(function, ast.FunctionDef) and is_static(function)
            )
            positional = [each.arg for each in (*function.args.posonlyargs, *function.args.args)][is_bound:]
            every = [each.arg for each in ast.walk(function.args) if isinstance(each, ast.arg)]
            gifts: list[tuple[str, ast.expr | None]] = [
                (each, default) for default in _arguments(function.args) for each in every
            ]
            for call in (each for each in calls if last_name(each.func) == name):
                gifts += [*zip(positional, call.args, strict=False)]
                gifts += [(each.arg, each.value) for each in call.keywords if each.arg]
                is_spread = any(isinstance(each, ast.Starred) for each in call.args)
                is_spread |= len(call.args) > len(positional) or any(not each.arg for each in call.keywords)
                gifts += [(each, None) for each in every if is_spread]
            gifts += [(each, None) for each in every if not name or name in others]
            for parameter, value in gifts:
                if parameter != "self":
                    self._gifts.setdefault(parameter, []).append((value, value or function, False))

    def _sources(self) -> dict[str, set[str]]:
        """Return what each name gets; what changes an object is got by all names that may have the object."""
        sources = {name: {*self._names(*self.given(name))} for name in self._gifts}
        sources[_ANYTHING] = {*self._gifts}
        changed = [(name, False) for name, gifts in self._gifts.items() if any(each for *_, each in gifts)]
        for name, is_part in changed:  # grows: what has a changed part may have got it by a change
            values = [value for value, _, changes in self._gifts[name] if is_part or not changes]
            for other in {*self._names(*values)} & self._gifts.keys() - {name}:
                sources[other].add(name)
                changed += [(other, True)] * ((other, True) not in changed)
        return sources

    def _doubles(self, name: str, value: ast.expr | None) -> bool:
        """Return whether a name gets more than one that comes from it, or that within something new."""

        def own(node: ast.AST | None) -> int:
            return sum(name in self._from.get(each, ()) for each in self._names(node))

        return own(value) > 1 or any(map(own, filter(self._makes, self._parts(value))))

    def _makes(self, node: ast.AST | None) -> bool:
        """Return whether a value may be much larger than what it is made of."""
        if isinstance(node, ast.Call):
            name = last_name(node.func)
            return name not in self.functions and name.strip(".") not in KEEPING
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Mult | ast.Pow):
            return not ast.unparse(node).endswith("* -1")
        return isinstance(node, _NEW)

    def _names(self, *values: ast.AST | None) -> Iterator[str]:
        """Yield the names of which values may have something, as often as they are mentioned."""
        for node in (each for value in values for each in self._parts(value)):
            if node is None or isinstance(node, ast.Name | ast.Attribute):
                yield last_name(node) if node else _ANYTHING

    def _parts(self, value: ast.AST | None) -> Iterator[ast.AST | None]:
        """Yield a value and those that it may have in it."""
        yield value
        inside: Iterable[ast.AST | None] = child_nodes(value) if value else ()
        match value:
            case ast.Call(func=function) if last_name(function) in self.functions or self._is_fixed(value):
                yield function
                inside = ()
            case ast.Call(func=ast.Name("range")):
                inside = [each for one in ast.walk(value) for each in getattr(one, "args", ())]
            case ast.Call(func=ast.Name(name)) if name != "open":
                inside = [None] if name == "getattr" else _arguments(value)
            case ast.Subscript(value=inner):
                inside = [inner]
            case ast.ListComp(ast.Name(name) as inner, [ast.comprehension(ast.Name(same))]) if name == same:
                inside = [inner]
            case ast.Compare() | ast.Lambda() | ast.UnaryOp(op=ast.Not()):
                inside = ()
            case ast.expr() if self._is_float(value):
                inside = ()
        for each in inside:
            yield from self._parts(each)

    def _is_fixed(self, call: ast.Call) -> bool:
        full = self._full(call.func)
        return self._asks(call) or has_fixed_size(full or last_name(call.func)) or self._is_float(call)

    def _is_float(self, node: ast.AST | None) -> bool:
        """Return whether a value is a float, or an array of them of the same size."""
        match node:
            case ast.Constant(value=float() | complex()) | ast.BinOp(op=ast.Div()):
                return True
            case ast.Name() | ast.Attribute(value=ast.Name("self")):
                return last_name(node) in self._floats
            case ast.BinOp(left=value, op=ast.Mod()) | ast.UnaryOp(op=ast.USub(), operand=value):
                return self._is_float(value)
            case ast.BinOp(left=left, op=ast.Add() | ast.Sub() | ast.Mult() | ast.Pow(), right=right):
                return self._is_float(left) or self._is_float(right)
            case ast.Call(func=function, args=[_, *_] as given) if self._full(function) in (
                "abs",
                "max",
                "min",
            ):
                return all(map(self._is_float, given))
        return isinstance(node, ast.Call) and gives_float(self._full(node.func))

    def grows(self, node: ast.AST) -> bool:
        """Return whether a node may make something much larger, now or whenever it runs."""
        match node:
            case ast.AugAssign(left, op, right) | ast.BinOp(left, op, right) if isinstance(
                op, ast.Mult | ast.Pow
            ):
                is_float = self._is_float(left) or self._is_float(right)
                is_power = isinstance(op, ast.Pow) and getattr(right, "value", None) not in (2, 3)
                inside = [each for one in (left, right) for each in ast.walk(one)]
                is_nested = any(isinstance(each, ast.Mult | ast.Pow) for each in inside)
                is_repeated = self._is_repeated(left, right) or self._is_repeated(right, left)
                return node in self._growing or (not is_float and (is_power or is_nested or is_repeated))
        return node in self._growing

    def _is_repeated(self, one: ast.expr, other: ast.expr) -> bool:
        """Return whether a list or a text is repeated as often as something else says."""
        found = [one, *self.given(last_name(one))]
        is_text = any(isinstance(getattr(each, "value", None), str) for each in found)
        is_list = any(isinstance(each, ast.List | ast.Tuple | ast.JoinedStr) for each in found)
        return (is_text or is_list) and not isinstance(other, ast.Constant)

    def changes(self, nodes: Iterable[ast.AST]) -> bool:
        """Return whether code may change an object in place, with the functions that it names."""
        return any(map(self._changes, self.running(nodes)))

    def multiplies(self, through: ast.expr, body: Iterable[ast.AST]) -> bool:
        """Return whether code that runs for each part of something may add to that."""
        running = {*self.running(body)}
        added = {
            name
            for name, gifts in self._gifts.items()
            for value, node, changes in gifts
            if node in running and isinstance(value, ast.BinOp)
            if changes or not isinstance(value.right, ast.Constant)  # no number that counts
        }
        return self.come_from(through, added)

    def running(self, nodes: Iterable[ast.AST]) -> Iterator[ast.AST]:
        """Yield the nodes of code, with those of the functions that it names."""
        return chain.from_iterable(map(ast.walk, reached(nodes, self._named)))

    def _named(self, node: ast.AST) -> list[_Function]:
        return [one for each in ast.walk(node) for one in self.functions.get(named(each), ())]

    def _changes(self, node: ast.AST) -> bool:
        match node:
            case ast.Call(func=ast.Attribute(attr=name)):
                return name in STORING
            case ast.AugAssign(target=target) if not self._is_float(target):  # numbers and texts are replaced
                first = [value for value, _, changes in self._gifts.get(last_name(target), ()) if not changes]
                return not first or not all(isinstance(each, ast.Constant | ast.BinOp) for each in first)
        return isinstance(node, ast.Subscript) and not isinstance(node.ctx, ast.Load)


def last_name(node: ast.AST) -> str:
    """Return the name of a variable, or of the last attribute after a dot; nothing for other expressions."""
    match node:
        case ast.Name(id=name):
            return name
        case ast.Attribute(attr=name):
            return f".{name}"
    return ""


def named(node: ast.AST) -> str:
    """Return the name of what a node may run: that of a variable or an attribute, or a text for `getattr`."""
    return last_name(node) or f".{getattr(node, 'value', '')}"


def _gifts_of(node: ast.AST) -> Iterator[tuple[str, _Gift]]:
    """Yield the names to which a node gives values, or parts of them."""
    match node:
        case ast.Assign(targets=targets, value=value):
            for target in targets:
                yield from _stored(target, value, node)
        case ast.AugAssign(target=target, op=op, value=value):
            is_number = isinstance(value, ast.Constant) and not isinstance(value.value, str)
            yield from _stored(target, ast.BinOp(target, op, value), node, changes=not is_number)
        case (
            ast.AnnAssign(target=target, value=ast.expr() as value)
            | ast.NamedExpr(target=target, value=value)
            | ast.For(target=target, iter=value)
            | ast.comprehension(target=target, iter=value)
            | ast.withitem(context_expr=value, optional_vars=ast.expr() as target)
        ):
            yield from _stored(target, value, node)
        case ast.Call(func=ast.Attribute(attr=name, value=owner), args=given) if name in STORING:
            for each in given or [ast.Constant(None)]:
                more = ast.BinOp(owner, ast.Add(), each)
                yield from _stored(owner, more if name in ADDING else owner, node, changes=True)
        case ast.Call(func=ast.Attribute(value=ast.Name("self"), attr="send"), args=[_, data, *_]):
            yield ".data", (data, node, False)
        case ast.FunctionDef() | ast.Name() | ast.alias():
            pass
        case _:
            yield from ((name, (None, node, False)) for name in binds(node))


def _stored(
    target: ast.expr, value: ast.expr, node: ast.AST, *, changes: bool = False
) -> Iterator[tuple[str, _Gift]]:
    match target, value:
        case (ast.Tuple(elts=targets), ast.Tuple(elts=parts)) if len(targets) == len(parts):
            for one, part in zip(targets, parts, strict=True):
                yield from _stored(one, part, node)
        case ((ast.Tuple(elts=targets) | ast.List(elts=targets)), _):
            for one in targets:
                yield from _stored(one, ast.Subscript(value, ast.Constant(0)), node)
        case ast.Starred(value=inner), _:
            yield from _stored(inner, value, node)
        case ast.Subscript(value=inner), _:
            is_added = isinstance(value, ast.BinOp) and ast.dump(value.left) == ast.dump(target)
            yield from _stored(inner, value if is_added else ast.List([value]), node, changes=True)
        case _:
            yield from ((last_name(target), (each, node, changes)) for each in _either(value))


def _returned(function: _Function) -> list[ast.expr]:
    found = [each for each in all_nodes(function) if isinstance(each, ast.Return | ast.Yield | ast.YieldFrom)]
    values = (
        [function.body] if isinstance(function, ast.Lambda) else [each.value for each in found if each.value]
    )
    return [inner for each in values for inner in _either(each)]


def _either(value: ast.expr) -> list[ast.expr]:
    """Return the expressions of which a value is one."""
    match value:
        case ast.IfExp(body=one, orelse=other):
            return [*_either(one), *_either(other)]
        case ast.BoolOp(values=values):
            return [inner for each in values for inner in _either(each)]
    return [value]


def _arguments(node: ast.AST) -> list[ast.expr]:
    """Return what a call passes, or what a definition takes by default."""
    if isinstance(node, ast.Call):
        return [*node.args, *(each.value for each in node.keywords)]
    return [each for each in child_nodes(node) if isinstance(each, ast.expr)]
