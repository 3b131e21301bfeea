"""Documents and commands at random, for the tests of the editor."""

from __future__ import annotations

from random import Random

from codegen.hfsm.document import Automaton, Document, State, Text, Transition
from visualhfsm.editing.commands import COMMANDS, Command
from visualhfsm.editing.commands.automata import (
    AddAutomaton,
    AddRoot,
    DeleteAutomaton,
    ExtractAutomaton,
    ReorderAutomaton,
    RepairNumbers,
    SetAutomatonCode,
    SetImport,
    SetPeriod,
)
from visualhfsm.editing.commands.component import (
    AddEvent,
    AddInterface,
    AddLibrary,
    AddParameter,
    AddProperty,
    ChangeEvent,
    ChangeInterface,
    ChangeLibrary,
    ChangeParameter,
    ChangeProperty,
    SetComponentText,
)
from visualhfsm.editing.commands.entries import RemoveEntry, ReorderEntry
from visualhfsm.editing.commands.items import (
    AlignStates,
    DeleteItems,
    DistributeStates,
    MoveItems,
    PlaceItems,
    Placement,
    ResetHandles,
)
from visualhfsm.editing.commands.paste import FillAutomaton, PasteStates, ReplaceDocument
from visualhfsm.editing.commands.states import (
    AddState,
    MarkFinal,
    MarkInitial,
    RemoveArgument,
    RenameState,
    SetArgument,
    SetHistory,
    SetStateCode,
)
from visualhfsm.editing.commands.transitions import (
    AddTransition,
    RenameTransition,
    ReorderTransition,
    RetargetTransition,
    SetPriority,
    SetTransitionCode,
    SetTransitionType,
)
from visualhfsm.editing.errors import EditError
from visualhfsm.editing.fragments import copy_states, written

__all__ = ["choose_command", "large_document", "tree"]

TEXTS = (
    "",
    "wait",
    "wait 2",
    "x += 1",
    "a < b and c > d & e",
    '\n\tif x:\n    return "]]>"\r\n',
    "  ",
    "\x00",
    's = "<state>&amp;"',
    "äöü 😀",
    "1",
    "100",
)
NAMES = ("", "go", "wait", "wait 2", "<b>", "a\nb", "\x1b")


_GROWING = (
    AddState,
    AddTransition,
    AddAutomaton,
    PasteStates,
    AddParameter,
    AddEvent,
    AddLibrary,
    AddInterface,
)
_SHRINKING = (DeleteAutomaton, DeleteItems, ExtractAutomaton, FillAutomaton, ReplaceDocument, RemoveEntry)


def tree() -> Document:
    """A root with two states, one of which owns two automata, one of which owns a third."""
    return Document(
        automata=(
            Automaton(
                id=1,
                states=(
                    State(id=1, name="wait", initial=True, x=100.0, y=100.0, code=Text("x = 1")),
                    State(id=2, name="work", x=300.0, y=100.0, children=(2, 3)),
                ),
                transitions=(
                    Transition(
                        id=1, name="go", origin=1, destination=2, x=200.0, y=80.0, trigger=Text("x > 1")
                    ),
                    Transition(id=2, name="back", origin=2, destination=1, x=200.0, y=120.0, type="finished"),
                ),
            ),
            Automaton(
                id=2,
                father=1,
                states=(
                    State(id=1, name="in", initial=True, children=(4,)),
                    State(id=2, name="out", final=True, x=200.0),
                ),
                transitions=(
                    Transition(id=1, name="t", origin=1, destination=2, type="time", trigger=Text("5")),
                ),
            ),
            Automaton(id=3, father=1, states=(State(id=1, name="blink", initial=True),)),
            Automaton(id=4, father=2, states=(State(id=1, name="deep", initial=True),)),
        )
    )


def large_document(states: int, automata: int = 1) -> Document:
    """A document with so many states, as many transitions, and the automata in one chain below the root."""
    each = states // automata
    return Document(
        automata=tuple(
            Automaton(
                id=number,
                father=number - 1,
                states=tuple(
                    State(
                        id=index,
                        name=f"state {index}",
                        initial=index == 1,
                        x=100.0 * (index % 40),
                        y=100.0 * (index // 40),
                        code=Text(f"counter += 1\nself.log.info('%d', {index})"),
                        children=(number + 1,) if index == 1 and number < automata else (),
                    )
                    for index in range(1, each + 1)
                ),
                transitions=tuple(
                    Transition(
                        id=index,
                        name=f"transition {index}",
                        origin=index,
                        destination=index % each + 1,
                        type="condition",
                        trigger=Text("counter > 10 and self.ready"),
                    )
                    for index in range(1, each + 1)
                ),
            )
            for number in range(1, automata + 1)
        )
    )


def choose_command(random: Random, document: Document) -> Command:
    """Choose a command, mostly one that can be applied, sometimes one about what is not there."""
    draw = random.choice
    kind = draw(COMMANDS)
    if kind in _SHRINKING and random.random() < 0.7:
        kind = draw(_GROWING)
    automata = [automaton.id for automaton in document.automata]
    automaton_id = draw([*automata * 6, 99])
    automaton = document.automaton(automaton_id) or Automaton(id=99)
    state_ids = [state.id for state in automaton.states] or [1]
    transition_ids = [each.id for each in automaton.transitions] or [1]
    state = [*state_ids * 8, 77]
    transition = [*transition_ids * 8, 77]
    text = TEXTS
    name = NAMES
    maybe = lambda options: [None, *options]  # noqa: E731
    number = [0.0, 10.5, -300.0, 1e5, 0.1 + 0.2]
    some = lambda ids: tuple(random.sample(ids, min(random.randint(1, 4), len(ids))))  # noqa: E731
    small = range(4)
    index = range(2)
    types = ["time", "condition", "event", "finished"]
    at = {"automaton": automaton_id}
    if kind is AddState:
        return AddState(**at, x=draw(number), y=draw(number), name=draw(name))
    if kind in (AddAutomaton, MarkInitial):
        return kind(**at, state=draw(state))
    if kind is RenameState:
        return RenameState(**at, state=draw(state), name=draw(name))
    if kind is SetStateCode:
        part = draw(["entry", "code", "exit"])
        return SetStateCode(**at, state=draw(state), part=part, text=draw(text))
    if kind is MarkFinal:
        return MarkFinal(**at, state=draw(state), final=draw([False, True]))
    if kind is SetHistory:
        return SetHistory(**at, state=draw(state), history=draw(["", "resume", "restart"]))
    if kind is SetArgument:
        return SetArgument(**at, state=draw(state), name=draw(name), value=draw(text), child=draw(small))
    if kind is RemoveArgument:
        return RemoveArgument(**at, state=draw(state), name=draw(name), child=draw(small))
    if kind is AddTransition:
        x = draw(maybe(number))
        return AddTransition(**at, origin=draw(state), destination=draw(state), type=draw(types), x=x)
    if kind is RenameTransition:
        return RenameTransition(**at, transition=draw(transition), name=draw(name))
    if kind is RetargetTransition:
        ends = {"origin": draw(maybe(state)), "destination": draw(maybe(state))}
        return RetargetTransition(**at, transition=draw(transition), **ends)
    if kind is SetTransitionType:
        return SetTransitionType(
            **at, transition=draw(transition), type=draw(types), trigger=draw(maybe(text))
        )
    if kind is SetTransitionCode:
        part = draw(["trigger", "guard", "fired"])
        return SetTransitionCode(**at, transition=draw(transition), part=part, text=draw(text))
    if kind is SetPriority:
        return SetPriority(**at, transition=draw(transition), priority=draw(text))
    if kind is ReorderTransition:
        return ReorderTransition(**at, transition=draw(transition), index=draw(index))
    if kind in (DeleteAutomaton,):
        return DeleteAutomaton(**at)
    if kind is ExtractAutomaton:
        return ExtractAutomaton(**at, file=draw(["lib.xml", "\x00"]))
    if kind is ReorderAutomaton:
        return ReorderAutomaton(**at, index=draw(index))
    if kind is SetPeriod:
        return SetPeriod(**at, period=draw(text))
    if kind is SetAutomatonCode:
        return SetAutomatonCode(**at, part=draw(["variables", "functions"]), text=draw(text))
    if kind is SetImport:
        return SetImport(**at, file=draw(["", "a.xml", "b & c.xml"]), source=draw(small))
    if kind in (AddRoot, RepairNumbers):
        return kind()
    if kind is DeleteItems:
        return DeleteItems(**at, states=some(state_ids)[:1], transitions=some(transition_ids))
    if kind is MoveItems:
        shift = {"dx": draw(number), "dy": draw(number)}
        return MoveItems(**at, states=some(state_ids), transitions=some(transition_ids), **shift)
    if kind is AlignStates:
        to = draw(["left", "center", "right", "top", "middle", "bottom"])
        return AlignStates(**at, states=some(state_ids), to=to)
    if kind is DistributeStates:
        return DistributeStates(**at, states=some(state_ids), along=draw(["x", "y"]))
    if kind is ResetHandles:
        return ResetHandles(**at, transitions=some(transition_ids))
    if kind is PlaceItems:
        places = tuple((each, draw(number), draw(number)) for each in some(state_ids))
        return PlaceItems(placements=(Placement(automaton=automaton_id, states=places),))
    if kind is SetComponentText:
        return SetComponentText(part=draw(["description", "onError", "language"]), text=draw(text))
    if kind is AddParameter:
        return AddParameter(automaton=draw([0, automaton_id]), name=draw(name))
    if kind in (AddEvent, AddProperty, AddInterface, AddLibrary):
        return kind(name=draw(name))
    if kind is ChangeParameter:
        names = {"name": draw(maybe(name)), "default": draw(maybe(text))}
        return ChangeParameter(automaton=draw([0, automaton_id]), index=draw(index), **names)
    if kind is ChangeEvent:
        return ChangeEvent(index=draw(index), name=draw(maybe(name)), description=draw(maybe(text)))
    if kind is ChangeProperty:
        return ChangeProperty(index=draw(index), name=draw(maybe(name)), expression=draw(maybe(text)))
    if kind is ChangeLibrary:
        return ChangeLibrary(index=draw(index), name=draw(maybe(name)))
    if kind is ChangeInterface:
        return ChangeInterface(index=draw(index), name=draw(maybe(name)), proxy=draw(maybe(name)))
    lists = ["parameters", "events", "properties", "libraries", "interfaces", "inputs"]
    if kind is RemoveEntry:
        return RemoveEntry(list=draw(lists), index=draw(index), automaton=automaton_id)
    if kind is ReorderEntry:
        return ReorderEntry(list=draw(lists), index=draw(index), to=draw(index), automaton=automaton_id)
    content = _copied(document, automaton_id, some(state_ids))
    if kind is PasteStates:
        return PasteStates(automaton=draw(automata or [1]), content=content, x=draw(maybe(number)))
    if kind is FillAutomaton:
        return FillAutomaton(**at, content=content)
    assert kind is ReplaceDocument, kind
    small_enough = len(document.automata) < 20
    return ReplaceDocument(
        content=written(tree()) if draw([False, True]) and small_enough else written(document)
    )


def _copied(document: Document, automaton: int, states: tuple[int, ...]) -> str:
    try:
        return copy_states(document, automaton, states)
    except EditError:
        return "<VisualHFSM/>"
