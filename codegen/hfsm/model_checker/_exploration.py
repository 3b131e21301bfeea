"""Explore the nodes of a transition system within a budget: all of them, or until a run is found.

`Exploration` is the only search: in the order of time, or new configurations first. `find` searches for a run
to a configuration, `find_avoiding` for a run in which no such configuration occurs.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from graphlib import CycleError, TopologicalSorter
from typing import Final

from .transition_system import ACTIVE, Choice, Configuration, Holds, Move, Node, TransitionSystem

_WORK_OF_A_NODE: Final = 4


class Budget:
    """A limit of work; a node costs the number of its automata and a little more."""

    def __init__(self, limit: int) -> None:
        self._limit = limit
        self._spent = 0
        self._shares: list[Budget] = []

    @property
    def spent(self) -> int:
        """The work that was done."""
        return self._spent + sum(share.spent for share in self._shares)

    def share(self, parts: int) -> Budget:
        """Return a part of the rest, to be spent before the next share is taken."""
        self._shares.append(Budget(max(0, self._limit - self.spent) // parts))
        return self._shares[-1]

    def spend(self, system: TransitionSystem) -> bool:
        """Count one node of a system; return False if the budget is spent."""
        if self._spent >= self._limit:
            return False
        self._spent += len(system.cone) + _WORK_OF_A_NODE
        return True


@dataclass(frozen=True, slots=True)
class Run:
    """A run of the automata of a system: `start`, then the moves.

    If it continues forever by repeating itself, `repeats` is the index of the first move that repeats, or the
    number of moves if nothing more has to happen. Otherwise the run ends at `ends`, in ns.
    """

    system: TransitionSystem
    start: Configuration
    moves: tuple[Move, ...]
    ends: int
    repeats: int | None = None


@dataclass(slots=True)
class SearchOutcome:
    """The outcome of a search: a run, or None. If it is `complete` and None, no such run exists."""

    run: Run | None
    complete: bool
    explored: int
    until: int
    """The time in ns up to which the search was complete."""


class Exploration:
    """The nodes of a system that are reached in the first `within` ns.

    They are in the order of time or, with `is_new`, first those that follow a new configuration.
    """

    def __init__(
        self,
        system: TransitionSystem,
        budget: Budget,
        within: int | None = None,
        is_new: Callable[[Configuration], bool] | None = None,
    ) -> None:
        self.system = system
        self.start, self.first, self.elapsed = system.start()
        self.explored = 0
        self.complete = True
        """False once the budget ended before all nodes were explored."""
        self.until = 0
        """The time in ns up to which the search was complete."""
        self._budget = budget
        self._within = within
        self._is_new = is_new
        start = Move(0, self.first, Choice(None, frozenset()), self.start, self.first, self.elapsed)
        self._came = {self.first: start}
        """The move that leads to each node; in the order of time, the earliest."""

    def time_of(self, node: Node) -> int:
        """Return the time of the cycle of a node, in ns."""
        came = self._came[node]
        return came.time + came.elapsed

    def moves(self, avoided: Holds | None = None) -> Iterator[Move]:
        """Yield every move except those to `avoided` configurations."""
        waiting = [(0, self.elapsed, 0, self.first)]
        pushed = 0
        came = self._came
        is_new = self._is_new
        while waiting:
            steps, time, _, node = heapq.heappop(waiting)
            if node.position < 0 or self.time_of(node) != time:
                continue
            if self._within is not None and time > self._within:
                break
            self.until = time
            if not self._budget.spend(self.system):
                self.complete = False
                return
            self.explored += 1
            for move in self.system.moves(node, time):
                if avoided is not None and avoided(move.configuration):
                    continue
                yield move
                comes = time + move.elapsed
                known = came.setdefault(move.following, move)
                if known is not move and is_new is None and comes < known.time + known.elapsed:
                    known = came[move.following] = move
                if known is move:
                    since = 0 if is_new is None or is_new(move.configuration) else steps + 1
                    pushed += 1
                    heapq.heappush(waiting, (since, comes, pushed, move.following))

    def run_to(self, node: Node, *last: Move) -> Run:
        """Return the run to the cycle of a node, and through its `last` move if one is given."""
        moves = [*last]
        while node != self.first:
            moves.append(self._came[node])
            node = moves[-1].node
        moves.reverse()
        ends = moves[-1].time + (0 if last else moves[-1].elapsed) if moves else self.elapsed
        return Run(self.system, self.start, tuple(moves), ends)

    def came_to(self, run: Run | None) -> SearchOutcome:
        """Return the outcome of the exploration with a run, or without one."""
        return SearchOutcome(run, self.complete or run is not None, self.explored, self.until)


def find(
    system: TransitionSystem,
    bad: Holds,
    budget: Budget,
    *,
    within: int | None = None,
    watched: Iterable[int] = (),
    lasting: bool = False,
) -> SearchOutcome:
    """Search for a `bad` configuration in the first `within` ns; with `lasting`, one in which time passes.

    The run is the earliest. If that takes more than half of the budget, the search continues with
    configurations that follow new ones, especially of the `watched` automata.
    """
    if within is not None:
        return _find(Exploration(system, budget.share(1), within), bad, lasting=lasting)
    outcome = _find(Exploration(system, budget.share(2)), bad, lasting=lasting)
    if outcome.complete:
        return outcome
    curious = Exploration(system, budget.share(1), is_new=newness(system, set(), watched))
    found = _find(curious, bad, lasting=lasting)
    return replace(found, explored=outcome.explored + found.explored, until=outcome.until)


def _find(exploration: Exploration, bad: Holds, *, lasting: bool) -> SearchOutcome:
    start, first = exploration.start, exploration.first
    if bad(start) and (not lasting or exploration.elapsed or first.position < 0):
        return exploration.came_to(Run(exploration.system, start, (), 0))
    for move in exploration.moves():
        lasts = move.elapsed > 0 or move.following.position < 0
        is_bad = bad(move.configuration) if lasting else any(map(bad, (move.configuration, *move.during)))
        if is_bad and (lasts or not lasting):
            return exploration.came_to(exploration.run_to(move.node, move))
    return exploration.came_to(None)


def newness(
    system: TransitionSystem, seen: set[tuple[int, ...]], watched: Iterable[int] = ()
) -> Callable[[Configuration], bool]:
    """Return a function that returns whether a configuration is new, and adds it to `seen`.

    It is new if an automaton is active in a state that was not seen, or the `watched` automata are in a new
    combination of states.
    """
    places = [system.position[automaton] for automaton in watched]

    def is_new(configuration: Configuration) -> bool:
        before = len(seen)
        for automaton, (state, flags, _) in zip(system.cone, configuration, strict=True):
            if flags & ACTIVE:
                seen.add((automaton, state))
        if len(places) > 1:
            seen.add((-1, *(configuration[place][0] for place in places)))
        return len(seen) > before

    return is_new


def find_avoiding(system: TransitionSystem, good: Holds, budget: Budget, within: int | None) -> SearchOutcome:
    """Search for a run without a `good` configuration: forever, or in the first `within` ns."""
    exploration = Exploration(system, budget, within)
    start, first = exploration.start, exploration.first
    if good(start):
        return exploration.came_to(None)
    may_stop = system.model.slow or system.model.ends
    if may_stop or first.position < 0 or system.may_rest(start):
        return exploration.came_to(Run(system, start, (), 0, repeats=0))
    if within is not None and exploration.elapsed > within:
        return exploration.came_to(Run(system, start, (), within))
    moves: dict[Node, list[Move]] = {first: []}
    for move in exploration.moves(good):
        if move.following.position < 0 or system.may_rest(move.configuration):
            run = exploration.run_to(move.node, move)
            return exploration.came_to(replace(run, repeats=len(run.moves)))
        if within is not None and move.time + move.elapsed > within:
            return exploration.came_to(replace(exploration.run_to(move.node, move), ends=within))
        moves.setdefault(move.node, []).append(move)
    try:
        graph = {node: [move.following for move in of_node] for node, of_node in moves.items()}
        order = [*TopologicalSorter(graph).static_order()]
    except CycleError as error:
        return exploration.came_to(_repeating(exploration, error.args[1][:0:-1], moves))
    return exploration.came_to(None if within is None else _longest(exploration, order, moves, within))


def _repeating(exploration: Exploration, loop: list[Node], moves: dict[Node, list[Move]]) -> Run:
    """Return the run to a loop and once through it."""
    begin = min(range(len(loop)), key=lambda place: exploration.time_of(loop[place]))
    loop = loop[begin:] + loop[:begin]
    run = exploration.run_to(loop[0])
    time, found = run.ends, [*run.moves]
    for node, following in zip(loop, [*loop[1:], loop[0]], strict=True):
        move = next(move for move in moves[node] if move.following == following)
        found.append(move._replace(time=time))
        time += move.elapsed
    return Run(run.system, run.start, tuple(found), time, repeats=len(run.moves))


def _longest(
    exploration: Exploration, order: list[Node], moves: dict[Node, list[Move]], within: int
) -> Run | None:
    """Return a run without a loop that lasts longer than `within` ns, or None; `order` begins at its end."""
    lasts: dict[Node, int] = {}
    for node in order:
        lasts[node] = max((move.elapsed + lasts[move.following] for move in moves.get(node, ())), default=0)
    node, time = exploration.first, exploration.elapsed
    if time + lasts[node] <= within:
        return None
    found: list[Move] = []
    while time <= within:
        move = max(moves[node], key=lambda each: each.elapsed + lasts[each.following])
        found.append(move._replace(time=time))
        node, time = move.following, time + move.elapsed
    return Run(exploration.system, exploration.start, tuple(found), within)
