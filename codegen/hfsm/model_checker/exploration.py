"""Search the configurations of automata, within a budget: by time, or straight to a goal.

Automata that a question does not depend on are left out of the search.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable, Collection, Iterable
from dataclasses import dataclass, field, replace
from typing import Final

from .expressions import Holds
from .fireability import Fireability
from .model import Model
from .transition_system import ACTIVE, Choice, Configuration, Node, TransitionSystem

__all__ = ["Budget", "Move", "Run", "cone_of", "find_avoiding", "search"]


def cone_of(model: Model, automata: Iterable[int], fireability: Fireability) -> frozenset[int]:
    """Return some automata with all that influence them.

    These are the automata above, and those below a state that is left when they have finished.
    """
    cone: set[int] = set()
    new = list(automata)
    while new:
        index = new.pop()
        if index in cone:
            continue
        cone.add(index)
        automaton = model.automata[index]
        if automaton.parent >= 0:
            new.append(automaton.parent)
        for transition in automaton.transitions:
            if transition.finished and fireability.may_fire(index, transition):
                new.extend(automaton.states[transition.origin].children)
    return frozenset(cone)


_WORK_OF_A_NODE: Final = 4


@dataclass(slots=True)
class Budget:
    """How much work is left; one node takes as much as the automata in it, and a little more."""

    left: int
    spent: int = 0

    def take(self, system: TransitionSystem) -> bool:
        """Count one node of a system; false when there is nothing left."""
        if self.left <= 0:
            return False
        work = len(system.cone) + _WORK_OF_A_NODE
        self.left -= work
        self.spent += work
        return True

    def share(self, limit: int) -> Budget:
        """Return a budget of at most `limit`, which `give_back` settles."""
        return Budget(min(self.left, max(0, limit)))

    def give_back(self, share: Budget) -> None:
        """Count what a share has spent."""
        self.left -= share.spent
        self.spent += share.spent


@dataclass(frozen=True, slots=True)
class Move:
    """The cycle of `node` at `time` ns, what it came to, and the configuration after it."""

    time: int
    node: Node
    choice: Choice
    configuration: Configuration


@dataclass(frozen=True, slots=True)
class Run:
    """A run of the automata: `start`, then the moves.

    When it goes on for ever by repeating itself, `repeats` is the place of the first move to be repeated:
    their number when nothing need happen any more. Else nothing happens after `ends`, or nothing that matters
    until then; in ns.
    """

    start: Configuration
    moves: tuple[Move, ...]
    ends: int
    repeats: int | None = None


@dataclass(slots=True)
class Outcome:
    """What a search came to: a run, or none because there is `complete`ly none, or because it had to stop."""

    run: Run | None
    complete: bool
    explored: int
    until: int
    """The time in ns up to which everything was seen."""


@dataclass(slots=True)
class _Search:
    """The nodes seen so far, with the way to each."""

    system: TransitionSystem
    start: Configuration = ()
    came: dict[Node, tuple[Node, Choice, Configuration] | None] = field(default_factory=dict)
    times: dict[Node, int] = field(default_factory=dict)

    def run_to(self, node: Node, last: tuple[Choice, Configuration] | None, ends: int) -> Run:
        """Return the run to the cycle of a node, and through it with its `last` choice."""
        moves: list[Move] = []
        if last is not None:
            moves.append(Move(self.times[node], node, *last))
        way = self.came[node]
        while way is not None:
            node, choice, configuration = way
            moves.append(Move(self.times[node], node, choice, configuration))
            way = self.came[node]
        return Run(self.start, tuple(reversed(moves)), ends)


def find(
    system: TransitionSystem,
    bad: Holds,
    within: int | None,
    budget: Budget,
    distance: Callable[[Configuration], int] = lambda _: 0,
    *,
    lasting: bool = False,
) -> Outcome:
    """Search a configuration that is `bad`, in the first `within` ns; one that `lasting` time passes in.

    It is the earliest unless there is a `distance`: then those with the smallest are looked at first, and
    `within` must be None.
    """
    search = _Search(system)
    search.start, node, elapsed = system.start()
    if bad(search.start) and (elapsed or node.position < 0 or not lasting):
        return Outcome(Run(search.start, (), 0), True, 1, 0)
    search.came[node] = None
    search.times[node] = elapsed
    waiting = [(0, elapsed, 0, node)]
    pushed, explored = 0, 0
    while waiting:
        _, time, _, node = heapq.heappop(waiting)
        if search.times[node] != time or node.position < 0:
            continue
        if within is not None and time > within:
            break
        if not budget.take(system):
            return Outcome(None, False, explored, time)
        explored += 1
        for choice, configuration, following, elapsed in system.successors(node):
            lasts = elapsed > 0 or following.position < 0
            if bad(configuration) and (lasts or not lasting):
                return Outcome(search.run_to(node, (choice, configuration), time), True, explored, time)
            known = search.times.get(following)
            if known is None or time + elapsed < known:
                search.times[following] = time + elapsed
                search.came[following] = node, choice, configuration
                pushed += 1
                heapq.heappush(waiting, (distance(configuration), time + elapsed, pushed, following))
    return Outcome(None, True, explored, within or 0)


def find_avoiding(system: TransitionSystem, good: Holds, within: int | None, budget: Budget) -> Outcome:
    """Search a run in which nothing `good` comes: for ever, or in the first `within` ns."""
    search = _Search(system)
    search.start, first, elapsed = system.start()
    if good(search.start):
        return Outcome(None, True, 1, 0)
    if system.may_rest(search.start):
        return Outcome(Run(search.start, (), 0, repeats=0), True, 1, 0)
    search.came[first] = None
    search.times[first] = elapsed
    edges: dict[Node, list[tuple[Choice, Configuration, Node, int]]] = {}
    waiting = [(elapsed, 0, first)]
    pushed, complete, until = 0, True, 0
    while waiting:
        time, _, node = heapq.heappop(waiting)
        if node in edges:
            continue
        if node.position < 0 or (within is not None and time > within):
            ends = search.times[node] if within is None else max(within, 0)
            return Outcome(search.run_to(node, None, ends), True, len(edges), time)
        until = time
        if not budget.take(system):
            complete = False
            break
        edges[node] = [edge for edge in system.successors(node) if not good(edge[1])]
        for choice, configuration, following, elapsed in edges[node]:
            if system.may_rest(configuration):
                run = search.run_to(node, (choice, configuration), time)
                return Outcome(replace(run, repeats=len(run.moves)), True, len(edges), time)
            if following not in search.times:
                search.times[following] = time + elapsed
                search.came[following] = node, choice, configuration
                pushed += 1
                heapq.heappush(waiting, (time + elapsed, pushed, following))
    order, loop = _order(first, edges)
    if loop is not None:
        return Outcome(_repeating(search, loop, edges), True, len(edges), until)
    if within is not None:
        longest = _longest(search, order, edges, within)
        if longest is not None:
            return Outcome(longest, True, len(edges), until)
    return Outcome(None, complete, len(edges), until)


_Edges = dict[Node, list[tuple[Choice, Configuration, Node, int]]]


def _order(first: Node, edges: _Edges) -> tuple[list[Node], list[Node] | None]:
    """Return the nodes, each after those that follow it, or the nodes of a loop."""
    order: list[Node] = []
    place: dict[Node, int] = {first: 0}
    path = [first]
    finished: set[Node] = set()
    ways = [iter(edges.get(first, ()))]
    while path:
        edge = next(ways[-1], None)
        if edge is None:
            node = path.pop()
            ways.pop()
            finished.add(node)
            order.append(node)
        elif edge[2] in finished:
            continue
        elif edge[2] in place:
            return order, path[place[edge[2]] :]
        else:
            place[edge[2]] = len(path)
            path.append(edge[2])
            ways.append(iter(edges.get(edge[2], ())))
    return order, None


def _repeating(search: _Search, loop: list[Node], edges: _Edges) -> Run:
    """Return the run to a loop and once through it."""
    turn = min(range(len(loop)), key=lambda place: search.times[loop[place]])
    loop = loop[turn:] + loop[:turn]
    run = search.run_to(loop[0], None, 0)
    moves = list(run.moves)
    time = search.times[loop[0]]
    for node, following in zip(loop, [*loop[1:], loop[0]], strict=True):
        choice, configuration, _, elapsed = next(edge for edge in edges[node] if edge[2] == following)
        moves.append(Move(time, node, choice, configuration))
        time += elapsed
    return Run(run.start, tuple(moves), time, repeats=len(run.moves))


def _longest(search: _Search, order: list[Node], edges: _Edges, within: int) -> Run | None:
    """Return a run without a loop that lasts longer than `within` ns, or None."""
    lasts: dict[Node, int] = {}
    for node in order:
        lasts[node] = max(
            (elapsed + lasts[following] for _, _, following, elapsed in edges.get(node, ())), default=0
        )
    node = order[-1]
    time = search.times[node]
    if time + lasts[node] <= within:
        return None
    moves: list[Move] = []
    while time <= within:
        choice, configuration, following, elapsed = max(
            edges[node], key=lambda edge: edge[3] + lasts[edge[2]]
        )
        moves.append(Move(time, node, choice, configuration))
        node, time = following, time + elapsed
    return Run(search.start, tuple(moves), within)


Goal = tuple[int, int]
"""An automaton and the state that a configuration should have it in, -1 for any."""


@dataclass(frozen=True, slots=True)
class Searched:
    """What a search came to, and the system that the run belongs to."""

    system: TransitionSystem
    outcome: Outcome


def search(
    model: Model,
    cone: Collection[int],
    fireability: Fireability,
    holds: Callable[[dict[int, int]], Holds],
    *,
    budget: Budget,
    within: int | None = None,
    goals: Collection[Goal] = (),
    lasting: bool = False,
) -> Searched:
    """Search a configuration of the automata in a cone, in the first `within` ns.

    `holds` takes the positions of the automata. `goals` are where it is likely to be found. A `lasting` one
    is not over at the moment at which it comes. The run is the earliest there is, unless that takes more than
    half of the budget.
    """
    system = TransitionSystem(model, cone, fireability)
    wanted = holds(system.position)
    if within is not None:
        return Searched(system, find(system, wanted, within, budget, lasting=lasting))
    first = budget.share(budget.left // 2 if goals else budget.left)
    outcome = find(system, wanted, None, first, lasting=lasting)
    budget.give_back(first)
    if not outcome.complete and goals:
        explored = outcome.explored
        outcome = find(system, wanted, None, budget, _distance(model, system, goals), lasting=lasting)
        outcome.explored += explored
    return Searched(system, outcome)


def _distance(
    model: Model, system: TransitionSystem, goals: Collection[Goal]
) -> Callable[[Configuration], int]:
    """Return how far a configuration is from the goals, in transitions and levels."""
    steps: list[list[tuple[int, dict[int, int]]]] = []
    for automaton, state in goals:
        chain = [(above.index, owner.index) for above, owner in model.ancestors(automaton)][::-1]
        chain += [(automaton, state)] if state >= 0 else []
        steps.append([(system.position[index], _hops(model, index, target)) for index, target in chain])
    far = 1000

    def distance(configuration: Configuration) -> int:
        total = 0
        for chain in steps:
            for level, (position, hops) in enumerate(chain):
                state, flags, _ = configuration[position]
                left = hops.get(state, far // 2) if flags & ACTIVE else far // 2
                if left:
                    total += left + far * (len(chain) - level)
                    break
        return total

    return distance


def _hops(model: Model, automaton: int, target: int) -> dict[int, int]:
    """Return how many transitions it is from each state to one."""
    into: dict[int, set[int]] = {}
    for transition in model.automata[automaton].transitions:
        into.setdefault(transition.target, set()).add(transition.origin)
    hops = {target: 0}
    new = [target]
    for state in new:  # grows
        for origin in into.get(state, ()):
            if origin not in hops:
                hops[origin] = hops[state] + 1
                new.append(origin)
    return hops
