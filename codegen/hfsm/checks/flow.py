"""Find variables that are read before anything can have assigned them, along the ways through the states.

A name that the variables do not assign has no value until some code assigns one. The analysis follows every
way through the states, in the order of a cycle: conditions, exit code, code of the transition, entry code,
arguments, code. Where a way may assign a name, it counts as assigned; a transition whose condition asks a
variable counts as having been prepared by the code that sets the variable.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator

from ...diagnostics import Note
from ..analysis import AutomatonCode, Piece
from ..document import State, Transition
from .assignments import Assignments, assignments_of
from .graph import Graph
from .report import Report

__all__ = ["check_flow"]

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
        self._report.warning("W522", message, piece.place(node, len(name)), notes)

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
        for argument in self._code.arguments.get(state.id, ()):
            names = self._run(argument, names)
        return names

    def _run(self, piece: Piece | None, names: _Names) -> _Names:
        """Return the names that are assigned after a piece; what was before it is remembered."""
        if piece is None:
            return names
        self._before[piece] = self._before.get(piece, names) & names
        return names | self._pieces[piece].assigned
