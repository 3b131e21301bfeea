"""Follow the names of a piece of code in the order in which Python comes to them.

What counts is whether a name *may* have been assigned when it is read: each branch counts, and so does what
the passes of a loop before may have done. A read is `exposed` when nothing before it in the piece assigns the
name. One that a flag guards, as in `if seen: use(x)`, is not: whoever sets the flag may assign the name, too.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import pairwise

from ..code.trees import own_nodes

__all__ = ["Assignments", "assignments_of"]

_COMPREHENSIONS = ast.ListComp | ast.SetComp | ast.DictComp | ast.GeneratorExp
_MISSING_NAME = frozenset({"NameError", "UnboundLocalError", "Exception", "BaseException"})


@dataclass(slots=True)
class Assignments:
    """What a piece of code does with names: the first exposed read of each, and those that it may assign."""

    exposed: dict[str, ast.Name] = field(default_factory=dict)
    assigned: set[str] = field(default_factory=set)


def assignments_of(statements: Iterable[ast.stmt], flags: Collection[str] = ()) -> Assignments:
    """Return what statements do with names; `flags` are those that guard a read when a condition has them."""
    walker = _Walker(frozenset(flags))
    walker.statements(statements)
    return Assignments(walker.exposed, walker.assigned)


class _Walker:
    def __init__(self, flags: frozenset[str]) -> None:
        self.exposed: dict[str, ast.Name] = {}
        self.assigned: set[str] = set()
        self._flags = flags
        self._guarded = 0
        self._hidden: list[set[str]] = []

    def statements(self, statements: Iterable[ast.stmt]) -> None:
        for statement in statements:
            self._statement(statement)

    def _statement(self, node: ast.stmt) -> None:
        match node:
            case ast.If(test=test, body=body, orelse=orelse):
                self._expression(test)
                self._branches([lambda: self.statements(body), lambda: self.statements(orelse)], test)
            case ast.While(test=test, body=body, orelse=orelse):
                self._expression(test)
                self._loop(body, test)
                self.statements(orelse)
            case ast.For(target=target, iter=iterable, body=body, orelse=orelse):
                self._expression(iterable)
                self._store(target)
                self._loop(body)
                self.statements(orelse)
            case ast.Try() | ast.TryStar():
                self._try(node)
            case ast.Match(subject=subject, cases=cases):
                self._expression(subject)
                self._branches([partial(self._case, case) for case in cases], subject)
            case ast.With(items=items, body=body):
                for item in items:
                    self._expression(item.context_expr)
                    if item.optional_vars is not None:
                        self._store(item.optional_vars)
                self.statements(body)
            case ast.Assign(targets=targets, value=value):
                self._expression(value)
                for target in targets:
                    self._store(target)
            case ast.AugAssign(target=target, value=value):
                if isinstance(target, ast.Name):
                    self._read(target)
                self._expression(value)
                self._store(target)
            case ast.AnnAssign(target=target, value=value):
                if value is not None:
                    self._expression(value)
                    self._store(target)
            case ast.Assert(test=test, msg=message):
                self._expression(test)
                if message is not None:
                    self._expression(message)
            case ast.Import(names=names) | ast.ImportFrom(names=names):
                self.assigned |= {alias.asname or alias.name.split(".")[0] for alias in names}
            case ast.FunctionDef() | ast.AsyncFunctionDef() | ast.ClassDef():
                self._definition(node)
            case ast.Delete():
                pass
            case _:
                for child in ast.iter_child_nodes(node):
                    if isinstance(child, ast.expr):
                        self._expression(child)

    def _definition(self, node: ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef) -> None:
        """Take a definition for what it does at once; its body reads names when it is called."""
        for decorator in node.decorator_list:
            self._expression(decorator)
        if isinstance(node, ast.ClassDef):
            for base in (*node.bases, *(keyword.value for keyword in node.keywords)):
                self._expression(base)
        else:
            for default in (*node.args.defaults, *node.args.kw_defaults):
                if default is not None:
                    self._expression(default)
            for inner in ast.walk(node):
                if isinstance(inner, ast.Nonlocal):
                    self.assigned.update(inner.names)
        self.assigned.add(node.name)

    def _try(self, node: ast.Try | ast.TryStar) -> None:
        is_caught = any(_catches_missing_name(handler) for handler in node.handlers)
        self._guarded += is_caught
        self.statements(node.body)
        self._guarded -= is_caught
        handlers = [partial(self._handler, handler) for handler in node.handlers]
        self._branches([lambda: self.statements(node.orelse), *handlers])
        self.statements(node.finalbody)

    def _handler(self, handler: ast.ExceptHandler) -> None:
        if handler.name:
            self.assigned.add(handler.name)
        self.statements(handler.body)

    def _case(self, case: ast.match_case) -> None:
        for node in ast.walk(case.pattern):
            match node:
                case ast.MatchAs(name=str(name)) | ast.MatchStar(name=str(name)):
                    self.assigned.add(name)
                case ast.MatchMapping(rest=str(name)):
                    self.assigned.add(name)
        if case.guard is not None:
            self._expression(case.guard)
        self.statements(case.body)

    def _loop(self, body: Sequence[ast.stmt], test: ast.expr | None = None) -> None:
        guarded = test is not None and self._is_flag(test)
        self._guarded += guarded
        self.assigned |= {name for statement in body for name in _stored(statement)}
        self.statements(body)
        self._guarded -= guarded

    def _branches(self, branches: Iterable[Callable[[], None]], test: ast.expr | None = None) -> None:
        """Walk branches, each from the same start; afterwards all that one of them assigns is assigned."""
        start = set(self.assigned)
        result = set(start)
        guarded = test is not None and self._is_flag(test)
        self._guarded += guarded
        for branch in branches:
            self.assigned = set(start)
            branch()
            result |= self.assigned
        self._guarded -= guarded
        self.assigned = result

    def _is_flag(self, test: ast.expr) -> bool:
        """Return whether a condition asks a variable, or an attribute of `self`, what happened before."""
        return any(
            (isinstance(node, ast.Name) and node.id in self._flags)
            or (isinstance(node, ast.Attribute) and ast.unparse(node.value) == "self")
            for node in ast.walk(test)
        )

    def _expression(self, node: ast.expr) -> None:
        match node:
            case ast.Name(ctx=ast.Load()):
                self._read(node)
            case ast.NamedExpr(target=target, value=value):
                self._expression(value)
                self._store(target)
            case ast.BoolOp(values=values):
                self._expression(values[0])
                guarded = 0
                for previous, value in pairwise(values):
                    is_flag = self._is_flag(previous)
                    guarded += is_flag
                    self._guarded += is_flag
                    self._expression(value)
                self._guarded -= guarded
            case ast.IfExp(test=test, body=body, orelse=orelse):
                self._expression(test)
                self._branches([lambda: self._expression(body), lambda: self._expression(orelse)], test)
            case ast.ListComp() | ast.SetComp() | ast.DictComp() | ast.GeneratorExp():
                self._comprehension(node)
            case ast.Lambda(args=arguments):
                for default in (*arguments.defaults, *arguments.kw_defaults):
                    if default is not None:
                        self._expression(default)
            case _:
                for child in ast.iter_child_nodes(node):
                    if isinstance(child, ast.expr):
                        self._expression(child)
                    elif isinstance(child, ast.keyword):
                        self._expression(child.value)

    def _comprehension(self, node: _COMPREHENSIONS) -> None:
        self._expression(node.generators[0].iter)
        targets = {
            name.id
            for generator in node.generators
            for name in ast.walk(generator.target)
            if isinstance(name, ast.Name)
        }
        self._hidden.append(targets)
        for place, generator in enumerate(node.generators):
            if place:
                self._expression(generator.iter)
            for condition in generator.ifs:
                self._expression(condition)
        elements = [node.key, node.value] if isinstance(node, ast.DictComp) else [node.elt]
        for element in elements:
            self._expression(element)
        self._hidden.pop()

    def _store(self, target: ast.expr) -> None:
        match target:
            case ast.Name(id=name):
                self.assigned.add(name)
            case ast.Tuple(elts=elements) | ast.List(elts=elements):
                for element in elements:
                    self._store(element)
            case ast.Starred(value=value):
                self._store(value)
            case _:
                for child in ast.iter_child_nodes(target):
                    if isinstance(child, ast.expr):
                        self._expression(child)

    def _read(self, node: ast.Name) -> None:
        name = node.id
        hidden = any(name in names for names in self._hidden)
        if not hidden and not self._guarded and name not in self.assigned:
            self.exposed.setdefault(name, node)


def _catches_missing_name(handler: ast.ExceptHandler) -> bool:
    if handler.type is None:
        return True
    caught = handler.type.elts if isinstance(handler.type, ast.Tuple) else [handler.type]
    return any(isinstance(name, ast.Name) and name.id in _MISSING_NAME for name in caught)


def _stored(statement: ast.stmt) -> Iterator[str]:
    """Yield the names that a statement assigns somewhere, most of them at least."""
    for node in (statement, *own_nodes(statement)):
        match node:
            case ast.Name(id=name, ctx=ast.Store()):
                yield name
            case ast.FunctionDef(name=name) | ast.AsyncFunctionDef(name=name) | ast.ClassDef(name=name):
                yield name
            case ast.alias(name=name, asname=alias):
                yield alias or name.split(".")[0]
