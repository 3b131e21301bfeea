"""Find code that makes something larger and larger, and loops whose body extends what they go through.

Names are those of variables, parameters, attributes (with a dot) and functions, wherever they stand. What
a name gets is *bounded* if it comes from itself at most with a part that is added, as in `n = n + 1`. A float
is never larger. All else may double whenever code runs, and takes longer each time.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from typing import Final

from ..code.text import all_nodes, binds, child_nodes
from ._quick import CALCULATING, KEEPING, STORING, gives_float, is_quick_name

Function = ast.FunctionDef | ast.Lambda
_Given = Iterator[tuple[str, ast.expr | None]]
_SAME_SIZE: Final = (ast.Div, ast.FloorDiv, ast.BitAnd, ast.BitOr, ast.BitXor, ast.RShift)
_COPIES: Final = frozenset({"list", "range", "sorted", "tuple"})
_ADDING: Final = frozenset({"add", "append", "appendleft", "insert", "setdefault"})
SMALL: Final = 100


class Values:
    """What code gives to names; `full` returns the full name of a function of Python or of a library."""

    def __init__(
        self,
        nodes: Sequence[ast.AST],
        of_class: Collection[ast.AST],
        given: Mapping[str, list[ast.expr | None]],
        full: Callable[[ast.AST], str],
        asks: Callable[[ast.Call], bool],
    ) -> None:
        self._full, self._asks = full, asks
        self.given: dict[str, list[ast.expr | None]] = {name: [*values] for name, values in given.items()}
        """The expressions from which the values of a name come; None for those that are unknown."""
        self.functions: dict[str, list[Function]] = {}
        """Functions, by names that nothing else has."""
        self.parents = {child: node for node in nodes for child in child_nodes(node)}
        self.uses: dict[str, list[ast.AST]] = {}
        """Where names are read."""
        calls: dict[str, list[ast.Call]] = {}
        put: dict[str, list[ast.expr | None]] = {}
        for node in nodes:
            scope = "." if node in of_class else ""
            for name, value in _given_by(node):
                known = name if name.startswith(".") else f"{scope}{name}"
                self.given.setdefault(known, []).append(value)
                if _puts(node):
                    put.setdefault(known, []).append(value)
            match node:
                case ast.FunctionDef(name=name):
                    self.functions.setdefault(f"{scope}{name}", []).append(node)
                case ast.Assign(targets=[ast.Name(id=name)], value=ast.Lambda() as value):
                    self.functions.setdefault(f"{scope}{name}", []).append(value)
                case ast.Call(func=function):
                    calls.setdefault(last_name(function), []).append(node)
                case ast.Name(ctx=ast.Load()) | ast.Attribute(ctx=ast.Load()):
                    self.uses.setdefault(last_name(node), []).append(node)
        for name in [*self.functions]:
            if not all(isinstance(each, ast.Lambda) for each in self.given.get(name, ())):
                del self.functions[name]
        followed = {each: name for name, functions in self.functions.items() for each in functions}
        for node in nodes:
            if isinstance(node, Function):
                name = followed.get(node, "")
                called = calls.get(name, [])
                is_followed = bool(name) and len(called) == len(self.uses.get(name, ()))
                for parameter, value in _passed(node, called, is_method=name.startswith(".")):
                    self.given.setdefault(parameter, []).append(value)
                # who else has a function may call it with anything
                for each in ast.walk(node.args) if not is_followed else ():
                    if isinstance(each, ast.arg) and each.arg != "self":
                        self.given.setdefault(each.arg, []).append(None)
        for name, functions in self.functions.items():
            self.given[name] = [each for function in functions for each in _returned(function)]
        self._share(put)
        self._floats = {*self.given}
        while unlike := [name for name in self._floats if not all(map(self.is_float, self.given[name]))]:
            self._floats.difference_update(unlike)
        self._bounded = {False: set[str](), True: set[str]()}
        for flat, names in self._bounded.items():
            while more := [
                each for each in self.given.keys() - names if self._is_bounded_name(each, flat=flat)
            ]:
                names.update(more)

    def _share(self, put: dict[str, list[ast.expr | None]]) -> None:
        """Give what is put into the object of a name also to all names from which the object may come."""
        for name in (waiting := [*put]):  # grows
            given = [each for each in self.given[name] if each is not None and each not in put[name]]
            sources = {last_name(one) for each in given for one in ast.walk(each)}
            for other in sources & self.given.keys() - {name}:
                if new := [each for each in put[name] if each not in self.given[other]]:
                    self.given[other].extend(new)
                    put.setdefault(other, []).extend(new)
                    waiting.append(other)

    def is_float(self, node: ast.AST | None) -> bool:
        """Return whether a value is a float, or an array of them of the same size."""
        match node:
            case ast.Constant(value=float() | complex()) | ast.BinOp(op=ast.Div()):
                return True
            case ast.Name() | ast.Attribute(value=ast.Name("self")) if last_name(node) in self.given:
                return last_name(node) in self._floats
            case ast.Attribute(value=value, attr="real" | "imag") | ast.BinOp(left=value, op=ast.Mod()):
                return self.is_float(value)
            case ast.UnaryOp(op=ast.USub(), operand=value):
                return self.is_float(value)
            case ast.BinOp(left=left, op=ast.Add() | ast.Sub() | ast.Mult() | ast.Pow(), right=right):
                return self.is_float(left) or self.is_float(right)
            case ast.Call(func=function, args=[_, *_] as given):
                is_one = self._full(function) in ("abs", "max", "min") and all(map(self.is_float, given))
                return is_one or gives_float(self._full(function))
            case ast.Call(func=function):
                return gives_float(self._full(function))
        return False

    def _is_bounded_name(self, name: str, *, flat: bool) -> bool:
        return all(each is not None and self._adds_to(name, each, flat=flat) for each in self.given[name])

    def _adds_to(self, name: str, node: ast.expr, *, flat: bool) -> bool:
        """Return whether a value is what a name has and a bounded part, or bounded."""
        match node:
            case ast.Name() | ast.Attribute(value=ast.Name("self")) if last_name(node) == name:
                return True
            case ast.BinOp(left=left, op=ast.Add() | ast.Sub() | ast.Mod(), right=right):
                return self._adds_to(name, left, flat=flat) and self.is_bounded(right, flat=flat)
        return self.is_bounded(node, flat=flat)

    def is_bounded(self, node: ast.AST, *, flat: bool = False) -> bool:
        """Return whether a value does not come from itself, or grows only by a part.

        If it is to be `flat`, a part of it may come from itself: what is put into a tuple and taken from it.
        """
        match node:
            case ast.Constant() | ast.Compare() | ast.Lambda() | ast.UnaryOp(op=ast.Not()):
                return True
            case ast.Subscript() if flat:
                return True
            case ast.Call(func=ast.Name("getattr" | "next")) | ast.Yield() | ast.YieldFrom():
                return False
            case ast.Call(func=function) if self._asks(node) or self._full(function).startswith(CALCULATING):
                return True
            case ast.Name() | ast.Attribute() if (name := last_name(node)) in self.given or name == ".data":
                is_so = name in self._bounded[flat]
                return is_so and all(self.is_bounded(each, flat=flat) for each in _expressions(node))
        return self.is_float(node) or all(self.is_bounded(each, flat=flat) for each in _expressions(node))

    def explodes(self, node: ast.AST) -> bool:
        """Return whether a node may make something much larger than what it is made of."""
        match node:
            case ast.AugAssign(target=left, op=op, value=right) | ast.BinOp(left=left, op=op, right=right):
                if self.is_float(left) or self.is_float(right):
                    return isinstance(op, ast.Mod) and not self.is_float(left) and not self.is_bounded(left)
                match op:
                    case ast.Add() | ast.Sub():
                        return not (self.is_bounded(left) or self.is_bounded(right))
                    case ast.Pow():
                        is_short = isinstance(right, ast.Constant) and right.value in (2, 3)
                        return not (is_short and self.is_bounded(left))
                    case ast.Mod() if isinstance(left, ast.BinOp) and _has_number(left):
                        return False
                    case ast.Mult() if isinstance(self.parents.get(node), ast.Compare) and _has_number(node):
                        return False  # nothing keeps it
                    case ast.Mult() if _is_repeated(left, right) or _is_repeated(right, left):
                        return True
                    case ast.Mult() | ast.Mod():
                        inside = [each for one in (left, right) for each in ast.walk(one)]
                        is_one = not any(isinstance(each, ast.Mult) for each in inside)
                        return not (is_one and self.is_bounded(left) and self.is_bounded(right))
                return not isinstance(op, _SAME_SIZE)
            case ast.Assign(targets=targets, value=value) if any(
                isinstance(each, ast.Subscript) for each in targets
            ):
                return not self.is_bounded(value, flat=True)
            case ast.Tuple() if self._is_spread(node):
                return False  # its parts get names
            case ast.Tuple(elts=parts) | ast.List(elts=parts) | ast.Set(elts=parts) | ast.Dict(values=parts):
                return not isinstance(getattr(node, "ctx", None), ast.Store) and self._are_several(parts)
            case ast.JoinedStr(values=parts):
                return not all(map(self.is_bounded, parts))
            case ast.ListComp() | ast.SetComp() | ast.GeneratorExp() | ast.DictComp():
                return len(node.generators) > 1 and not self.is_bounded(node)
            case ast.Call(func=function) if last_name(function) not in self.functions:
                given, name, full = given_to(node), last_name(function).strip("."), self._full(function)
                if name in _ADDING:
                    return not all(self.is_bounded(each, flat=True) for each in given)
                if name in KEEPING or full.startswith(CALCULATING) or gives_float(full):
                    return name == "sum" and len(given) > 1 and not all(map(self.is_bounded, given))
                is_changed = is_quick_name(full) or name in ("extend", "update")
                if isinstance(function, ast.Attribute) and not is_changed:
                    given = [*given, function.value]
                return not all(map(self.is_bounded, given))
        return False

    def _is_spread(self, node: ast.Tuple) -> bool:
        parent = self.parents.get(node)
        return isinstance(parent, ast.Assign) and all(isinstance(each, ast.Tuple) for each in parent.targets)

    def _are_several(self, parts: Iterable[ast.expr]) -> bool:
        parts = [*parts]
        is_nested = any(isinstance(each, ast.Tuple | ast.List | ast.Dict) for each in parts)
        return sum(not self.is_bounded(each, flat=not is_nested) for each in parts) > 1

    def extends_itself(self, node: ast.AST) -> bool:
        """Return whether what goes through something may extend that: a loop may be over a copy instead."""
        match node:
            case ast.For(iter=through, body=body):
                return not self._is_copy(through) and self._extends(body)
            case ast.ListComp() | ast.SetComp() | ast.GeneratorExp() | ast.DictComp():
                return self._extends([node])
            case ast.AugAssign(value=value):
                return self._extends([node]) and not self._is_copy(value)
            case ast.Call(func=function, args=given):
                if last_name(function) in (".extend", ".update"):
                    return not all(map(self._is_copy, given))
                has_function = self._full(function) in ("filter", "map", "max", "min", "sorted")
                return has_function and self._extends(given_to(node))
        return False

    def _is_copy(self, node: ast.expr) -> bool:
        """Return whether an iterable is new, spelled out, or a text: no other name has it."""
        match node:
            case ast.Call(func=function):
                full = self._full(function)
                return full in _COPIES or full.startswith(CALCULATING) or self._asks(node)
            case ast.Subscript(value=value) | ast.Attribute(value=value):
                return isinstance(getattr(node, "slice", None), ast.Slice) or self._is_copy(value)
            case ast.List(elts=parts) | ast.Tuple(elts=parts) | ast.Set(elts=parts):
                return not any(isinstance(each, ast.Starred) for each in parts)
        return isinstance(node, ast.Constant)

    def _extends(self, body: Iterable[ast.AST], known: frozenset[str] = frozenset()) -> bool:
        """Return whether code may extend something, with the functions that it names."""
        for node in (each for one in body for each in ast.walk(one)):
            match node:
                case ast.Call(func=ast.Attribute(attr=name)) if name in STORING:
                    return True
                case ast.Subscript(ctx=ast.Store() | ast.Del()):
                    return True
                case ast.AugAssign(target=target, value=value) if not (
                    self.is_float(value) or last_name(target) in self._floats
                ):
                    is_number = isinstance(value, ast.Constant) and not isinstance(value.value, str)
                    if not is_number and not all(map(_is_plain, self.given.get(last_name(target), [None]))):
                        return True
                case ast.Name(id=name) | ast.Attribute(attr=name) if (
                    name in self.functions and name not in known
                ):
                    if self._extends(self.functions[name], known | {name}):
                        return True
        return False


def last_name(node: ast.AST) -> str:
    """Return the name of a variable, or of the last attribute after a dot; nothing for other expressions."""
    match node:
        case ast.Name(id=name):
            return name
        case ast.Attribute(attr=name):
            return f".{name}"
    return ""


def given_to(call: ast.Call) -> list[ast.expr]:
    """Return the arguments of a call."""
    return [*call.args, *(each.value for each in call.keywords)]


def _given_by(node: ast.AST) -> _Given:
    """Yield the names to which a node gives values, or parts of them."""
    match node:
        case ast.Assign(targets=targets, value=value):
            for target in targets:
                yield from _stored(target, value)
        case ast.AugAssign(target=target, op=op, value=value):
            yield from _stored(target, ast.BinOp(target, op, value))
        case (
            ast.AnnAssign(target=target, value=ast.expr() as value)
            | ast.NamedExpr(target=target, value=value)
            | ast.For(target=target, iter=value)
            | ast.comprehension(target=target, iter=value)
            | ast.withitem(context_expr=value, optional_vars=ast.expr() as target)
        ):
            yield from _stored(target, value)
        case ast.Call(func=ast.Attribute(attr=name, value=owner)) if name in STORING:
            for each in given_to(node):
                yield from _stored(owner, each)
        case ast.FunctionDef() | ast.Name() | ast.alias():
            pass
        case _:
            yield from ((name, None) for name in binds(node))


def _puts(node: ast.AST) -> bool:
    """Return whether a node changes an object, which may have other names."""
    match node:
        case ast.Assign(targets=targets):
            return any(isinstance(each, ast.Subscript) for each in targets)
        case ast.AugAssign(value=ast.Constant(value=int() | float())):
            return False
    return isinstance(node, ast.Call | ast.AugAssign)


def _stored(target: ast.expr, value: ast.expr) -> _Given:
    match target, value:
        case (ast.Tuple(elts=targets), ast.Tuple(elts=parts)) if len(targets) == len(parts):
            for one, part in zip(targets, parts, strict=True):
                yield from _stored(one, part)
        case ((ast.Tuple(elts=targets) | ast.List(elts=targets)), _):
            for one in targets:
                yield from _stored(one, ast.Subscript(value, ast.Constant(0)))
        case ((ast.Starred(value=inner) | ast.Subscript(value=inner)), _):
            yield from _stored(inner, value)
        case _:
            yield last_name(target), value


def _passed(function: Function, calls: Iterable[ast.Call], *, is_method: bool) -> _Given:
    """Yield the parameters of a function, each with what calls and its definition give it."""
    arguments = [*function.args.posonlyargs, *function.args.args][is_method:]
    others = [each for each in ast.walk(function.args) if isinstance(each, ast.arg)]
    for call in calls:
        is_plain = not any(isinstance(each, ast.Starred) for each in call.args) and len(call.args) <= len(
            arguments
        )
        for each in others if not is_plain or any(each.arg is None for each in call.keywords) else ():
            yield from ((each.arg, value) for value in given_to(call))
        yield from ((each.arg, value) for each, value in zip(arguments, call.args, strict=False))
        yield from ((each.arg, each.value) for each in call.keywords if each.arg)
    for default in (each for each in child_nodes(function.args) if isinstance(each, ast.expr)):
        yield from ((each.arg, default) for each in others)


def _is_repeated(one: ast.expr, other: ast.expr) -> bool:
    """Return whether a list or a text is repeated as often as something else says."""
    return isinstance(one, ast.List | ast.Tuple | ast.JoinedStr) and not isinstance(other, ast.Constant)


def _has_number(node: ast.AST) -> bool:
    """Return whether one side of an operation is a small whole number, or a float."""
    sides = (getattr(node, name, None) for name in ("left", "right"))
    return any(
        isinstance(each, ast.Constant) and isinstance(each.value, int | float) and abs(each.value) <= SMALL
        for each in sides
    )


def _returned(function: Function) -> list[ast.expr | None]:
    if isinstance(function, ast.Lambda):
        return [function.body]
    found = (each for each in all_nodes(function) if isinstance(each, ast.Return | ast.Yield | ast.YieldFrom))
    return [each.value or ast.Constant(None) for each in found]


def _is_plain(node: ast.expr | None) -> bool:
    """Return whether a value is a number or a text, to which others are added in place: it is no list."""
    is_added = isinstance(node, ast.BinOp) and isinstance(getattr(node.left, "ctx", None), ast.Store)
    return is_added or isinstance(node, ast.Constant)


def _expressions(node: ast.AST) -> Iterator[ast.AST]:
    return (
        each for each in child_nodes(node) if isinstance(each, ast.expr | ast.comprehension | ast.keyword)
    )
