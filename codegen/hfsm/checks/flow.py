"""Find variables that are read before anything can have assigned them, along the ways through the states.

A name that the variables do not assign has no value until some code assigns one. The analysis follows every
way through the states, in the order of a cycle: conditions, exit code, code of the transition, entry code,
arguments, code. Where a way may assign a name, it counts as assigned; a transition whose condition asks a
variable counts as having been prepared by the code that sets the variable.

Within a piece of code each branch counts, and so does what the passes of a loop before may have done. A read
is `exposed` when nothing before it in the piece assigns the name. One that a flag guards, as in
`if seen: use(x)`, is not: whoever sets the flag may assign the name, too.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial
from itertools import pairwise

from ...diagnostics import Note
from ..analysis import AutomatonCode, Piece
from ..code.text import own_nodes
from ..codes import Code
from ..document import Automaton, State, Transition
from .report import Report

__all__ = ["assignments_of", "check_flow"]

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


class Graph:
    """The states of an automaton and how they follow one another.

    It is `sound` when ids tell its states apart and its transitions join them; nothing can be said of
    what comes after what in one that is not.
    """

    def __init__(self, automaton: Automaton) -> None:
        self.automaton = automaton
        self.states = {state.id: state for state in automaton.states}
        self.sound = len(self.states) == len(automaton.states) and all(
            {transition.origin, transition.destination} <= self.states.keys()
            for transition in automaton.transitions
        )
        self._outgoing = automaton.all_outgoing()

    @cached_property
    def initial(self) -> State | None:
        """The state in which the automaton begins: the first that says so, or else the first."""
        states = self.automaton.states
        return next((state for state in states if state.initial), states[0] if states else None)

    def outgoing(self, state: State) -> tuple[Transition, ...]:
        """Return what may fire in a state, in the order in which it is tried."""
        return () if state.final else self._outgoing.get(state.id, ())


_Names = frozenset[str]


def check_flow(code: AutomatonCode, report: Report) -> None:
    """Check one automaton."""
    graph = Graph(code.automaton)
    if graph.sound and graph.initial is not None and not code.broken:
        _Flow(graph, code, report).check()


class _Flow:
    def __init__(self, graph: Graph, code: AutomatonCode, report: Report) -> None:
        self._graph = graph
        self._code = code
        self._report = report
        plain = {piece: assignments_of(piece.tree.body) for piece in code.running()}
        bound: set[str] = set().union(*(found.assigned for found in plain.values()))
        self._pieces: dict[Piece, Assignments] = {
            piece: assignments_of(piece.tree.body, bound) for piece in plain
        }
        first = assignments_of(code.variables.tree.body).assigned if code.variables else set()
        self._declared = frozenset(item.name for item in code.automaton.inputs).union(first)
        self._late: _Names = frozenset(bound) - self._declared
        """The names that have no value at first."""
        self._set_with: dict[str, _Names] = {}
        """The names that are assigned by whatever assigns one."""
        for found in self._pieces.values():
            assigned = frozenset(found.assigned)
            for name in assigned:
                self._set_with[name] = self._set_with.get(name, assigned) & assigned
        self._before: dict[Piece, _Names] = {}
        """The names that every way to a piece may have assigned."""

    def check(self) -> None:
        if not self._late:
            return
        self._follow()
        for piece, before in self._before.items():
            for name, node in self._pieces[piece].exposed.items():
                if name in self._late and name not in before:
                    self._tell(piece, name, node)

    def _tell(self, piece: Piece, name: str, node: ast.Name) -> None:
        stores = (
            (other, target)
            for other, found in self._pieces.items()
            if name in found.assigned
            for target in ast.walk(other.tree)
            if isinstance(target, ast.Name) and target.id == name and isinstance(target.ctx, ast.Store)
        )
        first = next(stores, None)
        notes = [Note("give it a first value in the variables")]
        if first is not None:
            notes.insert(0, Note("it gets a value here", first[0].place(first[1], len(name))))
        message = f"`{name}` may be read before anything has assigned it"
        self._report.warning(Code.UNSET_VARIABLE, message, piece.place(node, len(name)), notes)

    def _follow(self) -> None:
        initial = self._graph.initial
        assert initial is not None
        known: dict[int, _Names] = {}
        pending: list[State] = []
        # In its first cycle an automaton has not run the code of its state yet.
        ends = self._one_cycle(initial, self._enter(initial, self._declared), is_first=True)
        while True:
            for state, names in ends:
                before = known.get(state.id)
                after = names if before is None else before & names
                if after != before:
                    known[state.id] = after
                    pending.append(state)
            if not pending:
                return
            state = pending.pop()
            ends = self._one_cycle(state, known[state.id], is_first=False)

    def _one_cycle(self, state: State, names: _Names, *, is_first: bool) -> Iterator[tuple[State, _Names]]:
        """Yield the states in which the next cycle may begin, with the names that are assigned then."""
        for transition in self._graph.outgoing(state):
            if is_first and transition.type != "condition":
                continue  # nothing has happened yet, and no time has passed
            asked = self._run(self._code.condition_of(transition), names)
            if transition.type == "condition":
                names = asked
            fired = asked | self._prepared(transition)
            target = self._graph.states[transition.destination]
            fired = self._run(self._code.exit.get(state.id), fired)
            fired = self._run(self._code.fired_by(transition), fired)
            fired = self._enter(target, fired)
            yield target, fired if target.final else self._run(self._code.code.get(target.id), fired)
        if not state.final:
            yield state, self._run(self._code.code.get(state.id), names)

    def _prepared(self, transition: Transition) -> _Names:
        """Return the names that are assigned wherever a variable is set that the condition asks."""
        piece = self._code.condition_of(transition)
        condition = None if piece is None else piece.expression
        if condition is None:
            return frozenset()
        asked = {node.id for node in ast.walk(condition) if isinstance(node, ast.Name)}
        return frozenset().union(*(self._set_with.get(name, frozenset()) for name in asked))

    def _enter(self, state: State, names: _Names) -> _Names:
        names = self._run(self._code.entry.get(state.id), names)
        for argument in self._code.arguments.get(state.id, {}).values():
            names = self._run(argument, names)
        return names

    def _run(self, piece: Piece | None, names: _Names) -> _Names:
        """Return the names that are assigned after a piece; what was before it is remembered."""
        if piece is None:
            return names
        self._before[piece] = self._before.get(piece, names) & names
        return names | self._pieces[piece].assigned
