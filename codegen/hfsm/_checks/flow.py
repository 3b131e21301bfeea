"""Find variables that may be read before they are assigned, on the paths through the states.

A name that the variables do not assign has no value until some code assigns one. The analysis follows every
path through the states, in the order of a cycle: conditions, exit code, code of the transition, entry code,
arguments, code. A name that a path may assign counts as assigned. A transition whose condition reads a
variable counts as prepared by the code that sets the variable.

Within a piece of code every branch and every earlier iteration of a loop counts. A read is `exposed` if
nothing before it in the piece assigns the name. A read that is guarded by a flag, as in `if seen: use(x)`, is
not exposed: the code that sets the flag may assign the name, too.
"""

from __future__ import annotations

import ast
from collections.abc import Collection, Iterable, Iterator, Sequence
from functools import lru_cache
from itertools import pairwise

from ...diagnostics import Note
from ...messages import Message
from ..analysis import AutomatonCode, Piece
from ..code.text import bound_names, evaluated_at_once
from ..codes import Code
from ..document import State, Transition
from ..report import Report
from .scope import Above

_MISSING_NAME = frozenset({"NameError", "UnboundLocalError", "Exception", "BaseException"})


class _Assignments:
    """The names that a piece of code uses: the first exposed read of each, and those that it may assign.

    `flags` are names that guard a read if a condition contains them. The code is walked in the order of
    evaluation.
    """

    def __init__(self, statements: Iterable[ast.stmt], flags: Collection[str] = ()) -> None:
        self.exposed: dict[str, ast.Name] = {}
        self.assigned: set[str] = set()
        self._flags = frozenset(flags)
        self._guarded = 0
        self._hidden: list[set[str]] = []
        self._walk(*statements)

    def _walk(self, *nodes: ast.AST) -> None:
        for node in nodes:
            self._node(node)

    def _node(self, node: ast.AST) -> None:
        match node:
            case ast.Name(ctx=ast.Load()):
                self._read(node)
            case ast.Name(id=name, ctx=ast.Store()):
                self.assigned.add(name)
            case ast.alias(name=name, asname=alias):
                self.assigned.add(alias or name.split(".")[0])
            case ast.Assign(targets=targets, value=value):
                self._walk(value, *targets)
            case ast.AugAssign(target=target, value=value):
                if isinstance(target, ast.Name):
                    self._read(target)
                self._walk(value, target)
            case ast.AnnAssign(target=target, value=value):
                self._walk(*([] if value is None else [value, target]))
            case ast.NamedExpr(target=target, value=value):
                self._walk(value, target)
            case ast.If(test=test, body=body, orelse=orelse):
                self._walk(test)
                self._branches(body, orelse, test=test)
            case ast.IfExp(test=test, body=value, orelse=other):
                self._walk(test)
                self._branches([value], [other], test=test)
            case ast.Match(subject=subject, cases=cases):
                self._walk(subject)
                self._branches(*([case] for case in cases), test=subject)
            case ast.While(test=test, body=body, orelse=orelse):
                self._walk(test)
                self._loop(body, test)
                self._walk(*orelse)
            case ast.For(target=target, iter=iterable, body=body, orelse=orelse):
                self._walk(iterable, target)
                self._loop(body)
                self._walk(*orelse)
            case ast.Try(body, handlers, orelse, last) | ast.TryStar(body, handlers, orelse, last):
                is_caught = any(map(_catches_missing_name, handlers))
                self._guarded += is_caught
                self._walk(*body)
                self._guarded -= is_caught
                self._branches(orelse, *([handler] for handler in handlers))
                self._walk(*last)
            case ast.ExceptHandler(name=caught, body=body):
                self.assigned |= {caught} if caught else set()
                self._walk(*body)
            case ast.MatchAs(name=captured) | ast.MatchStar(name=captured) | ast.MatchMapping(rest=captured):
                self.assigned |= {captured} if captured else set()
                self._walk(*ast.iter_child_nodes(node))
            case ast.BoolOp(values=values):
                self._operands(values)
            case ast.ListComp() | ast.SetComp() | ast.DictComp() | ast.GeneratorExp():
                self._comprehension(node)
            case ast.FunctionDef() | ast.AsyncFunctionDef() | ast.ClassDef() | ast.Lambda():
                self._definition(node)
            case ast.Delete():
                pass
            case _:
                self._walk(*ast.iter_child_nodes(node))

    def _definition(self, node: ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef | ast.Lambda) -> None:
        """Walk what a definition evaluates at once; its body reads names when it is called."""
        self._walk(*evaluated_at_once(node))
        for inner in ast.walk(node):
            if isinstance(inner, ast.Nonlocal):
                self.assigned.update(inner.names)
        if not isinstance(node, ast.Lambda):
            self.assigned.add(node.name)

    def _loop(self, body: Sequence[ast.stmt], test: ast.expr | None = None) -> None:
        guarded = test is not None and self._is_flag(test)
        self._guarded += guarded
        self.assigned |= bound_names(ast.Module([*body], []))
        self._walk(*body)
        self._guarded -= guarded

    def _branches(self, *branches: Sequence[ast.AST], test: ast.expr | None = None) -> None:
        """Walk branches from the same start; names that one of them assigns are assigned afterwards."""
        start = self.assigned
        result = set(start)
        guarded = test is not None and self._is_flag(test)
        self._guarded += guarded
        for branch in branches:
            self.assigned = set(start)
            self._walk(*branch)
            result |= self.assigned
        self._guarded -= guarded
        self.assigned = result

    def _operands(self, values: Sequence[ast.expr]) -> None:
        """Walk the operands of `and` or `or`; each is a condition for the following ones."""
        self._walk(values[0])
        guarded = 0
        for previous, value in pairwise(values):
            is_flag = self._is_flag(previous)
            guarded += is_flag
            self._guarded += is_flag
            self._walk(value)
        self._guarded -= guarded

    def _is_flag(self, test: ast.expr) -> bool:
        """Return whether a condition reads a variable or an attribute of `self` that records the past."""
        return any(
            (isinstance(node, ast.Name) and node.id in self._flags)
            or (
                isinstance(node, ast.Attribute)
                and isinstance(node.value, ast.Name)
                and node.value.id == "self"
            )
            for node in ast.walk(test)
        )

    def _comprehension(self, node: ast.ListComp | ast.SetComp | ast.DictComp | ast.GeneratorExp) -> None:
        first, *others = node.generators
        self._walk(first.iter)
        targets = (name for each in node.generators for name in ast.walk(each.target))
        self._hidden.append({name.id for name in targets if isinstance(name, ast.Name)})
        self._walk(*first.ifs)
        for generator in others:
            self._walk(generator.iter, *generator.ifs)
        self._walk(*([node.key, node.value] if isinstance(node, ast.DictComp) else [node.elt]))
        self._hidden.pop()

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


_Names = frozenset[str]


@lru_cache(maxsize=8192)
def _assignments(piece: Piece, flags: _Names = frozenset()) -> _Assignments:
    return _Assignments(piece.tree.body, flags)


def check_flow(code: AutomatonCode, report: Report, above: Above) -> None:
    """Check one automaton, unless its states and transitions are inconsistent."""
    automaton = code.automaton
    states = {state.id for state in automaton.states}
    is_sound = len(states) == len(automaton.states) and all(
        {transition.origin, transition.destination} <= states for transition in automaton.transitions
    )
    if states and is_sound and not code.broken:
        _Flow(code, report, above).check()


class _Flow:
    def __init__(self, code: AutomatonCode, report: Report, above: Above) -> None:
        self._code = code
        self._report = report
        self._above = above
        self._states = {state.id: state for state in code.automaton.states}
        self._outgoing = code.automaton.all_outgoing()
        plain = {piece: _assignments(piece) for piece in code.running()}
        bound = frozenset[str]().union(*(found.assigned for found in plain.values()))
        self._pieces = {piece: _assignments(piece, bound) for piece in plain}
        first = _Assignments(code.variables.tree.body).assigned if code.variables else set()
        self._declared = code.automaton.declared.union(first)
        self._late = bound - self._declared
        """The names without an initial value."""
        self._set_with: dict[str, _Names] = {}
        """The names that are assigned by all code that assigns one name."""
        for found in self._pieces.values():
            assigned = frozenset(found.assigned)
            for name in assigned:
                self._set_with[name] = self._set_with.get(name, assigned) & assigned
        self._before: dict[Piece, _Names] = {}
        """The names that every path to a piece may have assigned."""

    def check(self) -> None:
        if not self._late:
            return
        self._follow()
        for piece, before in self._before.items():
            for name, node in self._pieces[piece].exposed.items():
                if name in self._late and name not in before:
                    self._report_read(piece, name, node)

    def _report_read(self, piece: Piece, name: str, node: ast.Name) -> None:
        if self._above.report(name, piece.place(node, len(name)), self._report):
            return
        stores = (
            piece.place_of_store(name) for piece, found in self._pieces.items() if name in found.assigned
        )
        notes = [Note(Message("give it an initial value in the variables"))]
        if (first := next(filter(None, stores), None)) is not None:
            notes.insert(0, Note(Message("it gets a value here"), first))
        message = Message("`{name}` may be read before it is assigned", name=name)
        self._report.warning(Code.UNSET_VARIABLE, message, piece.place(node, len(name)), notes)

    def _follow(self) -> None:
        states = self._code.automaton.states
        initial = next((state for state in states if state.initial), states[0])
        known: dict[int, _Names] = {}
        pending: list[State] = []
        # In its first cycle an automaton has not yet run the code of its state.
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
        """Yield the states in which the next cycle may start, with the names that are assigned by then."""
        for transition in () if state.final else self._outgoing.get(state.id, ()):
            if is_first and transition.type != "condition":
                continue  # no event has been sent yet, and no time has passed
            asked = self._run(self._code.of("guard", transition), names)
            if transition.type == "condition":
                names = asked
            fired = asked | self._prepared(transition)
            target = self._states[transition.destination]
            fired = self._run(self._code.of("exit", state), fired)
            fired = self._run(self._code.of("fired", transition), fired)
            fired = self._enter(target, fired)
            yield target, fired if target.final else self._run(self._code.of("code", target), fired)
        if not state.final:
            yield state, self._run(self._code.of("code", state), names)

    def _prepared(self, transition: Transition) -> _Names:
        """Return the names that are assigned wherever a variable of the condition is set."""
        piece = self._code.of("guard", transition)
        condition = None if piece is None else piece.expression
        if condition is None:
            return frozenset()
        asked = {node.id for node in ast.walk(condition) if isinstance(node, ast.Name)}
        return frozenset().union(*(self._set_with.get(name, frozenset()) for name in asked))

    def _enter(self, state: State, names: _Names) -> _Names:
        names = self._run(self._code.of("entry", state), names)
        for argument in state.arguments:
            names = self._run(self._code.of("argument", argument), names)
        return names

    def _run(self, piece: Piece | None, names: _Names) -> _Names:
        """Return the names that are assigned after a piece, and remember those before it."""
        if piece is None:
            return names
        self._before[piece] = self._before.get(piece, names) & names
        return names | self._pieces[piece].assigned
