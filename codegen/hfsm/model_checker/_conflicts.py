"""Find automata that run side by side and command the same servant: the robot obeys the last command."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import combinations
from typing import Final

from ...diagnostics import Diagnostics, Location, Note
from ...messages import Message
from .._effects import CodeEffects
from ..codes import Code
from ..document import Interface, RosInterface, Text
from ..known_interfaces import DescriptionError, KnownInterfaces
from ._counterexample import Counterexample, counterexample
from ._exploration import Budget, find
from ._fireability import Fireability
from ._reachability import Reached
from .model import AutomatonModel, Model, condition_of
from .transition_system import ACTIVE, RUNNING, Configuration, TransitionSystem

_COMMANDS: Final = re.compile(r"(set|send|play|stop|start|move|turn|walk|go|do|reset|say|command)(?![a-z])")
_READS: Final = re.compile(r"(get|is|has|read|list|find|ice)(?![a-z])")
_ROS: Final = {"publish": True, "send": True, "latest": False, "next": False, "value": False, "wait": False}
"""Operations of ROS interfaces, true for those that command something, as a call of a service may."""
Operations = Mapping[str, Mapping[str, bool]]
"""Operations, true for those that command something, by the attribute of `self` that holds the proxy."""


@dataclass(frozen=True, slots=True)
class Command:
    """A command to the servant `identity`, by an operation of `self.<interface>`."""

    identity: str
    interface: str
    operation: str


def is_command(operation: str, idempotent: bool | None = None) -> bool | None:
    """Return whether an operation changes something, by its name and whether it is `idempotent` in the IDL.

    None if that is not known.
    """
    if _COMMANDS.match(operation):
        return True
    if _READS.match(operation):
        return False
    return None if idempotent is None else not idempotent


def read_operations(
    interfaces: Iterable[Interface], known: KnownInterfaces, diagnostics: Diagnostics
) -> dict[str, dict[str, bool]]:
    """Return the operations of a document's interfaces, as their packages describe them.

    A description that cannot be read is reported as an error. Hand-written proxies have none.
    """
    found: dict[str, dict[str, bool]] = {}
    for interface in interfaces:
        candidates = known.find(interface.type)
        try:
            operations = known.operations(candidates[0]) if len(candidates) == 1 else None
        except DescriptionError as error:
            path = error.place.path
            if path.is_file():
                diagnostics.add_source(path, path.read_text(encoding="utf-8", errors="replace"))
            message = Message(
                "the description of package `{package}` {problem}",
                package=path.parent.name,
                problem=error.message,
            )
            advice = Message("the model checker needs it: undo a failed merge, or generate the package again")
            note = Note(advice)
            diagnostics.error(Code.BAD_DESCRIPTION, message, error.place, [note])
        else:
            if operations is not None:
                found[interface.name] = {
                    name: is_command(name, each.is_idempotent) is True for name, each in operations.items()
                }
    return found


class Commands:
    """The commands in the code of a document."""

    def __init__(self, effects: CodeEffects, operations: Operations | None = None) -> None:
        document = effects.analysis.document
        self._effects = effects
        self._operations = operations or {}
        self._interfaces: dict[str, Interface | RosInterface] = {
            each.name: each for each in document.all_interfaces
        }
        self._ros = {each.name for each in document.ros}
        for alias, name in document.proxy_aliases.items():
            self._interfaces.setdefault(alias, self._interfaces[name])

    def of(self, text: Text) -> tuple[set[Command], set[Command]]:
        """Return the commands of a text of the document: the certain and the possible ones."""
        effects = self._effects.of(text)
        certain, possible = set[Command](), set[Command]()
        for call in effects.calls | effects.possible:
            interface = self._interfaces[call.proxy]
            described = _ROS if interface.name in self._ros else self._operations.get(interface.name, {})
            changes = described.get(call.operation, is_command(call.operation))
            if changes is not False:
                is_certain = changes is True and call in effects.calls
                command = Command(interface.identity, *call)
                (certain if is_certain else possible).add(command)
        return certain, possible

    def unclear(self, text: Text) -> Location | None:
        """Return the first place where code may command any servant, or None."""
        piece = self._effects.analysis.piece(text)
        effects = self._effects.of(text)
        return piece.place(effects.any_call[0]) if piece is not None and effects.any_call else None


@dataclass(frozen=True, slots=True)
class Use:
    """A command of an automaton in a state; if it is not `certain`, it is possible.

    `piece` is the kind of the code: `code`, `entry`, `exit`, `argument`, or `guard` or `transition` with the
    index of the `transition`; `place` is its location. Code that cannot be followed has the command
    `ANYTHING`.
    """

    automaton: int
    state: int
    command: Command
    piece: str
    place: Location
    transition: int | None = None
    certain: bool = True


@dataclass(frozen=True, slots=True)
class Conflict:
    """Two automata that command one servant at the same time.

    If it is `nested`, the first is an ancestor of the second. The `counterexample` leads to a configuration
    in which both may do so. If it is not `certain`, it may be impossible: the search did not finish.
    """

    first: Use
    second: Use
    nested: bool
    certain: bool = True
    counterexample: Counterexample | None = None


ANYTHING: Final = Command("", "", "")


def uses_of(model: Model, commands: Commands) -> list[list[Use]]:
    """Return the commands of each automaton, state by state."""
    if len(model.automata) < 2:
        return [[] for _ in model.automata]
    return [list(_uses(model, automaton, commands)) for automaton in model.automata]


def _uses(model: Model, automaton: AutomatonModel, commands: Commands) -> Iterator[Use]:
    for state in automaton.states:
        source = state.source
        texts: list[tuple[str, Text, int | None]] = [
            ("entry", source.entry, None),
            ("exit", source.exit, None),
        ]
        texts += [] if source.final else [("code", source.code, None)]
        texts += [("argument", argument.value, None) for argument in source.arguments]
        for transition in state.outgoing:
            item = transition.source
            texts += [
                ("guard", condition_of(item), transition.index),
                ("transition", item.code, transition.index),
            ]
        for piece, text, number in texts:
            path = (source if number is None else automaton.source.transitions[number]).path or model.path
            place = Location(path, max(1, text.line), max(1, text.column))
            certain, possible = commands.of(text)
            for command in sorted(certain | possible, key=repr):
                is_certain = command in certain
                yield Use(automaton.index, state.index, command, piece, place, number, is_certain)
            unclear = commands.unclear(text)
            if unclear is not None:
                yield Use(automaton.index, state.index, ANYTHING, piece, unclear, number, certain=False)


def find_conflicts(
    uses: list[list[Use]], fireability: Fireability, reached: Reached, budget: Budget
) -> tuple[list[Conflict], list[Note]]:
    """Return the conflicts of a document, one for each pair of automata and servant.

    The notes name code that cannot be followed and may cause more conflicts.
    """
    possible = [[use for use in of_one if _is_possible(use, fireability)] for of_one in uses]
    pairs: list[tuple[list[Use], list[Use]]] = []
    unclear: list[tuple[list[Use], list[Use]]] = []
    for of_one, of_other in combinations(possible, 2):
        for servant in sorted({use.command.identity for use in of_one if use.command is not ANYTHING}):
            second = _of_servant(of_other, servant)
            pairs += [(_of_servant(of_one, servant), second)] if second else []
        one, other = (_of_servant(uses, ANYTHING.identity) for uses in (of_one, of_other))
        unclear += [(one, of_other)] if one and of_other else []
        unclear += [(of_one, other)] if of_one and other else []
    conflicts: list[Conflict] = []
    notes: dict[Location, Note] = {}
    for done, (first, second) in enumerate([*pairs, *unclear]):
        share = budget.share(len(pairs) + len(unclear) - done)
        conflict = _conflict(first, second, fireability, reached, share)
        if conflict is not None and done < len(pairs):
            conflicts.append(conflict)
        elif conflict is not None:
            for use in (first[0], second[0]):
                if use.command is ANYTHING:
                    notes.setdefault(use.place, Note(Message("this code may command any servant"), use.place))
    return conflicts, list(notes.values())


def _of_servant(uses: list[Use], identity: str) -> list[Use]:
    """Return the uses of a servant, certain ones first."""
    return sorted((use for use in uses if use.command.identity == identity), key=lambda use: not use.certain)


def _is_possible(use: Use, fireability: Fireability) -> bool:
    if use.piece == "transition" and use.transition not in fireability.transitions[use.automaton]:
        return False
    return use.state in fireability.states[use.automaton]


def _conflict(
    first: list[Use], second: list[Use], fireability: Fireability, reached: Reached, budget: Budget
) -> Conflict | None:
    """Return the conflict of two automata over a servant, or None; `first` comes first in the model."""
    model = fireability.model
    a = first[0].automaton
    b = second[0].automaton
    owners = {above.index: owner.index for above, owner in model.ancestors(b)}
    if a in owners:
        return _nested([use for use in first if use.state == owners[a]], second, reached)
    for above, owner in model.ancestors(a):
        if above.index in owners:
            together = owners[above.index] == owner.index
            system = TransitionSystem([a, b], fireability)
            return _side_by_side(system, first, second, budget) if together else None
    return None


def _nested(above: list[Use], below: list[Use], reached: Reached) -> Conflict | None:
    # only the cyclic code and guards of the state above overlap with the automata below
    above = [use for use in above if use.piece in ("code", "guard")]
    index = below[0].automaton
    seen = [use for use in below if use.state in reached.states[index]]
    if not above or not (seen or index in reached.unknown):
        return None
    one, other = above[0], (seen or below)[0]
    return Conflict(one, other, nested=True, certain=bool(seen) and one.certain and other.certain)


def _side_by_side(
    system: TransitionSystem, first: list[Use], second: list[Use], budget: Budget
) -> Conflict | None:
    a, b = first[0].automaton, second[0].automaton
    one, other = system.position[a], system.position[b]
    of_one, of_other = _by_state(first), _by_state(second)

    def both(configuration: Configuration) -> bool:
        return (
            configuration[one][1] & RUNNING == ACTIVE
            and configuration[other][1] & RUNNING == ACTIVE
            and configuration[one][0] in of_one
            and configuration[other][0] in of_other
        )

    outcome = find(system, both, budget, watched=(a, b), lasting=True)
    run = outcome.run
    if run is None:
        return None if outcome.complete else Conflict(first[0], second[0], nested=False, certain=False)
    last = run.moves[-1].configuration if run.moves else run.start
    uses = of_one[last[one][0]], of_other[last[other][0]]
    certain = all(use.certain for use in uses)
    return Conflict(*uses, nested=False, certain=certain, counterexample=counterexample(run))


def _by_state(uses: list[Use]) -> dict[int, Use]:
    """Return the first use in each state."""
    return {use.state: use for use in reversed(uses)}
