"""The command that groups states into a sub-automaton."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable
from collections.abc import Set as AbstractSet
from dataclasses import replace
from typing import Final, NamedTuple

from codegen.hfsm.code.text import bound_names
from codegen.hfsm.document import Automaton, Document, State, Text, Transition
from codegen.messages import Message
from codegen.parsing import parse_python
from visualhfsm._base.errors import EditError

from .. import nodes
from ..geometry import with_default_handles
from ..subtrees import owners
from .base import Command, Id, Ids, Language, made_up
from .items import describe

_WORD: Final = re.compile(r"[^\W\d]\w*")
_LINE: Final = re.compile(r"[^\r\n]*(?:\r\n|\r|\n)|[^\r\n]+")  # as Python's parser counts them


class GroupStates(Command, frozen=True, kw_only=True):
    """Move states into a new automaton below a new state that takes their place.

    Transitions among them move with them; those that lead in or out lead to or from the new state. The new
    automaton begins in the initial state if that is one of them, else where the first transition leads in,
    and restarts at each entry: that is closest to the behavior before. Variables that nothing else uses move
    with them, too.
    """

    automaton: Id
    states: Ids
    name: str = ""
    language: Language = ""

    def apply(self, document: Document) -> Document:
        source = nodes.find_automaton(document, self.automaton)
        chosen = [nodes.find_state(source, number) for number in dict.fromkeys(self.states)]
        if not chosen:
            raise EditError("Cannot group", "no state is selected", "select states first")
        nodes.require_room(document, 1, Message("Cannot group"))
        number = next(nodes.automaton_ids(document))
        group = State(
            id=next(nodes.state_ids(source)),
            name=nodes.checked(self.name, Message("the name"))
            or nodes.free_name(
                made_up(Message("group"), self.language), {state.name for state in source.states}
            ),
            initial=any(state.initial for state in chosen),
            children=(number,),
            history=Text("restart"),
            x=nodes.coordinate(sum(state.x for state in chosen) / len(chosen)),
            y=nodes.coordinate(sum(state.y for state in chosen) / len(chosen)),
        )
        inside = {state.id for state in chosen}
        within = tuple(each for each in source.transitions if {each.origin, each.destination} <= inside)
        grouped = _grouped(source, group, inside)
        kept, taken = source.variables.text, ""
        if document.language.is_blank:
            kept, taken = split_variables(kept, _words([*chosen, *within]), _words(_parts(grouped)))
        child = Automaton(
            id=number,
            father=source.id,
            states=_with_initial(chosen, source.transitions),
            transitions=within,
            iteration_time=source.iteration_time,
            variables=Text(taken),
        )
        former = _moving(document, source, chosen)
        automata = tuple(
            replace(each, father=number) if each.id in former else each
            for each in nodes.swapped(document.automata, source, nodes.changed(grouped, variables=kept))
        )
        return replace(document, automata=(*automata, child))

    def title(self, document: Document) -> Message:
        return Message("Group {describe}", describe=describe(document, self.automaton, self.states))


def _grouped(source: Automaton, group: State, inside: set[int]) -> Automaton:
    """Return an automaton in which one state replaces several, also as an end of their transitions."""
    states = [state for state in source.states if state.id not in inside]
    first = next(index for index, state in enumerate(source.states) if state.id in inside)
    states.insert(first, group)
    transitions = []
    crossing = set()
    for each in source.transitions:
        leaves, enters = each.origin in inside, each.destination in inside
        if leaves and enters:
            continue
        if leaves or enters:
            crossing.add(each.id)
        transitions.append(
            nodes.changed(
                each,
                origin=group.id if leaves else each.origin,
                destination=group.id if enters else each.destination,
            )
        )
    made = nodes.changed(source, states=tuple(states), transitions=tuple(transitions))
    return with_default_handles(made, frozenset(crossing))


def _parts(automaton: Automaton) -> list[State | Transition]:
    return [*automaton.states, *automaton.transitions]


def _words(parts: Iterable[State | Transition]) -> set[str]:
    """Return the words in all code of some states and transitions."""
    texts: list[Text] = []
    for part in parts:
        if isinstance(part, State):
            texts += (part.entry, part.code, part.exit, *(argument.value for argument in part.arguments))
            texts += (result.variable for result in part.results)
        else:
            texts += (part.trigger, part.guard, part.code)
    return {word for text in texts for word in _WORD.findall(text.text)}


def _with_initial(states: list[State], transitions: tuple[Transition, ...]) -> tuple[State, ...]:
    """Return states of which one is initial."""
    if any(state.initial for state in states):
        return tuple(states)
    ids = {state.id for state in states}
    entering = [
        each.destination for each in transitions if each.destination in ids and each.origin not in ids
    ]
    first = entering[0] if entering else states[0].id
    return tuple(nodes.changed(state, initial=state.id == first) for state in states)


def _moving(document: Document, source: Automaton, states: list[State]) -> set[int]:
    """Return the ids of the automata that only these states own, and that move with them."""
    moving = {id(state) for state in states}
    return {
        child
        for child, owned_by in owners(document).items()
        if child != source.id and all(id(state) in moving for _, state in owned_by)
    }


def split_variables(text: str, inside: AbstractSet[str], outside: AbstractSet[str]) -> tuple[str, str]:
    """Return the lines of variables that stay, and those that only code with the words `inside` uses.

    A line moves if it assigns only names that are in `inside`, not in `outside`, and not used by a line that
    stays, and if it uses no name of a line that stays. Lines that are not Python stay.
    """
    try:
        statements = parse_python(text).body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return text, ""
    names = [_names(each) for each in statements]
    going = {
        index
        for index, each in enumerate(names)
        if each.given and each.given <= inside and not each.given & outside and _is_alone(statements, index)
    }
    while True:
        staying = [each for index, each in enumerate(names) if index not in going]
        needed = {name for each in staying for name in each.used | each.given}
        bound = {name for each in staying for name in each.given | each.bound}
        held = {index for index in going if names[index].given & needed or names[index].used & bound}
        if not held:
            break
        going -= held
    lines = _LINE.findall(text)
    gone = {
        line
        for index in going
        for line in range(statements[index].lineno, (statements[index].end_lineno or 0) + 1)
    }
    taken = "".join(line for number, line in enumerate(lines, 1) if number in gone)
    return "".join(line for number, line in enumerate(lines, 1) if number not in gone), taken.rstrip("\r\n")


class _Names(NamedTuple):
    given: set[str]
    """Names that a plain assignment sets; empty for any other statement."""
    bound: set[str]
    """Names that any other statement binds, such as an import."""
    used: set[str]


def _names(statement: ast.stmt) -> _Names:
    names = (each for each in ast.walk(statement) if isinstance(each, ast.Name))
    used = {each.id for each in names if isinstance(each.ctx, ast.Load)}
    bound = set(bound_names(ast.Module([statement], [])))
    match statement:
        case ast.Assign(targets=targets) if all(isinstance(each, ast.Name) for each in targets):
            return _Names(bound, set(), used)  # not several at once, nor members of something
        case ast.AnnAssign(target=ast.Name()):
            return _Names(bound, set(), used)
    return _Names(set(), bound, used)


def _is_alone(statements: list[ast.stmt], index: int) -> bool:
    """Return whether a statement shares its lines with no other."""
    first, last = statements[index].lineno, statements[index].end_lineno or 0
    others = statements[:index] + statements[index + 1 :]
    return not any(each.lineno <= last and (each.end_lineno or 0) >= first for each in others)
