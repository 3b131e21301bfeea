"""Each command of the editor, on valid and on odd documents."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import msgspec
import pytest

from codegen.hfsm import write_document
from codegen.hfsm.document import (
    Argument,
    Automaton,
    Document,
    Parameter,
    State,
    Text,
    Transition,
)
from tests.support.editing import tree
from visualhfsm.editing.commands import COMMANDS, Command, decode_command
from visualhfsm.editing.commands.automata import (
    AddAutomaton,
    AddRoot,
    RepairNumbers,
    SetAutomatonCode,
    SetImport,
    SetPeriod,
)
from visualhfsm.editing.commands.component import (
    AddEntry,
    ChangeEntry,
    RemoveEntry,
    ReorderEntry,
    SetComponentText,
)
from visualhfsm.editing.commands.items import (
    AlignStates,
    DeleteItems,
    DistributeStates,
    MoveItems,
    PlaceItems,
    Placement,
    ResetHandles,
)
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
from visualhfsm.editing.commands.text import ReplaceText
from visualhfsm.editing.commands.transitions import (
    AddTransition,
    RenameTransition,
    ReorderTransition,
    RetargetTransition,
    SetPriority,
    SetTransitionCode,
    SetTransitionType,
)
from visualhfsm.editing.places import Place
from visualhfsm.editing.serialization import parse
from visualhfsm.errors import EditError


def automaton(document: Document, id: int = 1) -> Automaton:
    found = document.automaton(id)
    assert found is not None
    return found


def state(document: Document, id: int, of: int = 1) -> State:
    found = automaton(document, of).state(id)
    assert found is not None
    return found


def transition(document: Document, id: int, of: int = 1) -> Transition:
    return next(each for each in automaton(document, of).transitions if each.id == id)


def names(document: Document, of: int = 1) -> list[str]:
    return [each.name for each in automaton(document, of).states]


def test_a_first_state_is_initial_and_all_get_numbers_and_names_of_their_own() -> None:
    document = AddRoot().apply(Document())
    for x in (0.0, 50.123456):
        document = AddState(automaton=1, x=x, y=-1).apply(document)
    first, second = automaton(document).states
    assert (first.id, first.name, first.initial) == (1, "state 1", True)
    assert (second.id, second.name, second.initial, second.x) == (2, "state 2", False, 50.12)


def test_a_state_is_drawn_with_a_transition_to_it_in_one_step() -> None:
    command = AddState(automaton=1, x=300, y=0, origin=1)
    document = command.apply(tree())
    drawn = automaton(document).transitions[-1]
    assert (drawn.origin, drawn.destination) == (1, automaton(document).states[-1].id)
    assert command.title(tree()) == "Add a state and a transition to it"
    with pytest.raises(EditError, match="state 99"):
        AddState(automaton=1, x=0, y=0, origin=99).apply(tree())


def test_the_number_of_a_deleted_state_does_not_come_back_while_a_transition_names_it() -> None:
    document = Document(automata=(Automaton(id=1, transitions=(Transition(id=1, origin=5, destination=5),)),))
    assert state(AddState(automaton=1, x=0, y=0).apply(document), 6).name == "state 6"


def test_a_state_is_renamed_and_its_pieces_of_code_are_set() -> None:
    document = RenameState(automaton=1, state=1, name="<rest>").apply(tree())
    for part in ("entry", "code", "exit"):
        document = SetStateCode(automaton=1, state=1, part=part, text=f"{part} = 1\n").apply(document)
    changed = state(document, 1)
    assert (changed.name, changed.entry.text, changed.code.text, changed.exit.text) == (
        "<rest>", "entry = 1\n", "code = 1\n", "exit = 1\n"
    )  # fmt: skip


def test_only_one_state_is_initial() -> None:
    document = MarkInitial(automaton=1, state=2).apply(tree())
    assert [each.initial for each in automaton(document).states] == [False, True]


def test_a_state_is_final_and_no_more() -> None:
    document = MarkFinal(automaton=1, state=1, final=True).apply(tree())
    assert state(document, 1).final
    assert not state(MarkFinal(automaton=1, state=1, final=False).apply(document), 1).final


def test_the_history_of_a_state_is_set() -> None:
    assert (
        state(SetHistory(automaton=1, state=2, history="restart").apply(tree()), 2).history.text == "restart"
    )


def test_arguments_are_added_changed_and_removed() -> None:
    document = SetArgument(automaton=1, state=2, name="times", value="3", child=2).apply(tree())
    document = SetArgument(automaton=1, state=2, name="times", value="4", child=2).apply(document)
    assert state(document, 2).arguments == (Argument(name="times", child=2, value=Text("4")),)
    assert (
        state(RemoveArgument(automaton=1, state=2, name="times", child=2).apply(document), 2).arguments == ()
    )
    with pytest.raises(EditError, match="it has no name"):
        SetArgument(automaton=1, state=2, name=" ", value="").apply(document)


def test_a_transition_is_added_with_a_handle_of_its_own() -> None:
    document = AddTransition(automaton=1, origin=1, destination=2, type="time").apply(tree())
    document = AddTransition(automaton=1, origin=1, destination=2).apply(document)
    document = AddTransition(automaton=1, origin=1, destination=1).apply(document)
    new = automaton(document).transitions[2:]
    assert [(each.id, each.type) for each in new] == [(3, "time"), (4, "condition"), (5, "condition")]
    handles = {(each.x, each.y) for each in automaton(document).transitions}
    assert len(handles) == 5
    assert (new[2].x, new[2].y) == (100.0, 10.0)


def test_a_transition_needs_its_states() -> None:
    with pytest.raises(EditError, match="state 9 of automaton 1: it does not exist"):
        AddTransition(automaton=1, origin=1, destination=9).apply(tree())


def test_an_end_of_a_transition_is_led_elsewhere_and_its_place_in_the_order_stays() -> None:
    document = RetargetTransition(automaton=1, transition=1, destination=1).apply(tree())
    assert [each.id for each in automaton(document).transitions] == [1, 2]
    moved = transition(document, 1)
    assert (moved.origin, moved.destination, moved.x, moved.y) == (1, 1, 100.0, 10.0)


def test_a_condition_goes_on_as_a_guard_and_comes_back() -> None:
    document = SetTransitionType(automaton=1, transition=1, type="event", trigger="call").apply(tree())
    changed = transition(document, 1)
    assert (changed.type, changed.trigger.text, changed.guard.text) == ("event", "call", "x > 1")
    back = transition(SetTransitionType(automaton=1, transition=1, type="condition").apply(document), 1)
    assert (back.type, back.trigger.text, back.guard.text) == ("condition", "x > 1", "")
    finished = transition(SetTransitionType(automaton=1, transition=1, type="finished").apply(document), 1)
    assert (finished.trigger.text, finished.guard.text) == ("", "x > 1")


def test_a_time_is_one_second_at_first_and_stays_as_it_was_set() -> None:
    document = SetTransitionType(automaton=1, transition=1, type="time").apply(tree())
    assert (transition(document, 1).trigger.text, transition(document, 1).guard.text) == ("1000", "x > 1")
    document = SetTransitionCode(automaton=1, transition=1, part="trigger", text="250").apply(document)
    again = SetTransitionType(automaton=1, transition=1, type="time").apply(document)
    assert transition(again, 1).trigger.text == "250"


def test_the_texts_of_a_transition_are_set() -> None:
    document = RenameTransition(automaton=1, transition=1, name="on").apply(tree())
    for part in ("trigger", "guard", "fired"):
        document = SetTransitionCode(automaton=1, transition=1, part=part, text=part).apply(document)
    document = SetPriority(automaton=1, transition=1, priority="2").apply(document)
    new = transition(document, 1)
    assert (new.name, new.trigger.text, new.guard.text, new.code.text, new.priority.text) == (
        "on", "trigger", "guard", "fired", "2"
    )  # fmt: skip


def test_transitions_change_places_where_none_has_a_priority() -> None:
    document = tree()
    for _ in range(2):
        document = AddTransition(automaton=1, origin=1, destination=2).apply(document)
    document = ReorderTransition(automaton=1, transition=4, index=0).apply(document)
    assert [each.id for each in automaton(document).transitions] == [4, 2, 1, 3]
    assert [each.id for each in automaton(document).outgoing(1)] == [4, 1, 3]


def test_transitions_get_priorities_where_one_has_one() -> None:
    document = AddTransition(automaton=1, origin=1, destination=2).apply(tree())
    document = SetPriority(automaton=1, transition=3, priority="7").apply(document)
    document = ReorderTransition(automaton=1, transition=1, index=0).apply(document)
    assert [(each.id, each.priority.text) for each in automaton(document).transitions] == [
        (1, "1"), (2, ""), (3, "2")
    ]  # fmt: skip


def test_deleting_a_state_takes_all_that_hangs_on_it() -> None:
    document = DeleteItems(automaton=1, states=(2,)).apply(tree())
    assert [each.id for each in document.automata] == [1]
    assert names(document) == ["wait"]
    assert automaton(document).transitions == ()


def test_deleting_leaves_an_automaton_that_another_state_owns_too() -> None:
    document = tree()
    root = automaton(document)
    shared = replace(root, states=(replace(root.states[0], children=(3,)), root.states[1]))
    document = replace(document, automata=(shared, *document.automata[1:]))
    assert [each.id for each in DeleteItems(automaton=1, states=(2,)).apply(document).automata] == [1, 3]


def test_deleting_in_a_tree_that_bites_its_tail_keeps_what_is_above() -> None:
    document = Document(
        automata=(
            Automaton(id=1, states=(State(id=1, name="a", children=(2,)),)),
            Automaton(id=2, father=1, states=(State(id=1, name="b", children=(1, 2)),)),
        )
    )
    assert [each.id for each in DeleteItems(automaton=2, states=(1,)).apply(document).automata] == [1, 2]


def test_a_state_gets_further_automata() -> None:
    document = AddAutomaton(automaton=1, state=2).apply(tree())
    assert state(document, 2).children == (2, 3, 5)
    assert automaton(document, 5) == Automaton(id=5, father=1)


def test_moving_takes_handles_along() -> None:
    document = MoveItems(automaton=1, states=(1,), dx=10, dy=20).apply(tree())
    assert (state(document, 1).x, state(document, 1).y) == (110.0, 120.0)
    assert (transition(document, 1).x, transition(document, 1).y) == (205.0, 90.0)
    both = MoveItems(automaton=1, states=(1, 2), transitions=(1,), dx=10, dy=20).apply(tree())
    assert [(each.x, each.y) for each in automaton(both).transitions] == [(210.0, 100.0), (210.0, 140.0)]


def test_nothing_moves_off_the_canvas() -> None:
    for dx in (1e9, float("nan"), float("inf")):
        with pytest.raises(EditError, match="Cannot move that far"):
            MoveItems(automaton=1, states=(1,), dx=dx, dy=0).apply(tree())


@pytest.mark.parametrize(
    ("to", "places"),
    [
        ("left", [(100, 100), (100, 100)]),
        ("right", [(300, 100), (300, 100)]),
        ("center", [(200, 100), (200, 100)]),
        ("bottom", [(100, 100), (300, 100)]),
    ],
)
def test_states_are_aligned(to: Any, places: list[tuple[int, int]]) -> None:
    document = AlignStates(automaton=1, states=(1, 2), to=to).apply(tree())
    assert [(each.x, each.y) for each in automaton(document).states] == places


def test_states_are_distributed_between_the_outermost() -> None:
    document = tree()
    for x in (110.0, 120.0):
        document = AddState(automaton=1, x=x, y=100).apply(document)
    document = DistributeStates(automaton=1, states=(1, 2, 3, 4), along="x").apply(document)
    assert [each.x for each in automaton(document).states] == [100.0, 300.0, 166.67, 233.33]


def test_a_layout_places_many_and_handles_stand_by_themselves() -> None:
    placements = (
        Placement(automaton=1, states=((1, 0.0, 0.0), (2, 0.0, 200.0)), transitions=((2, 5.0, 6.0),)),
        Placement(automaton=2, states=((1, 7.0, 8.0),)),
    )
    document = PlaceItems(placements=placements).apply(tree())
    assert [(each.x, each.y) for each in automaton(document).states] == [(0.0, 0.0), (0.0, 200.0)]
    assert [(each.x, each.y) for each in automaton(document).transitions] == [(0.0, 100.0), (5.0, 6.0)]
    assert state(document, 1, of=2).y == 8.0


def test_a_layout_leaves_the_handles_between_states_that_it_does_not_place() -> None:
    document = AddState(automaton=1, x=0, y=0).apply(tree())
    placed = PlaceItems(placements=(Placement(automaton=1, states=((3, 50.0, 50.0),)),)).apply(document)
    assert automaton(placed).transitions == automaton(document).transitions


def test_handles_go_back_where_they_stand_by_themselves() -> None:
    document = ResetHandles(automaton=1, transitions=(1, 2)).apply(tree())
    assert [(each.x, each.y) for each in automaton(document).transitions] == [(200.0, 100.0), (200.0, 150.0)]


def test_a_handle_keeps_away_from_those_that_stand_still() -> None:
    document = ResetHandles(automaton=1, transitions=(1,)).apply(tree())
    assert [(each.x, each.y) for each in automaton(document).transitions] == [(200.0, 150.0), (200.0, 120.0)]


def test_the_data_of_an_automaton_is_set() -> None:
    document = SetPeriod(automaton=2, period="50").apply(tree())
    document = SetAutomatonCode(automaton=2, part="variables", text="n = 0").apply(document)
    document = SetAutomatonCode(automaton=2, part="functions", text="def f(self): pass").apply(document)
    new = automaton(document, 2)
    assert (new.iteration_time.text, new.variables.text, new.functions.text) == (
        "50",
        "n = 0",
        "def f(self): pass",
    )


def with_balls() -> Document:
    """A document with a word in all kinds of code, and in names."""
    document = SetArgument(automaton=1, state=2, name="ball", value="ball", child=3).apply(tree())
    for part in ("entry", "code", "exit"):
        text = "Ball = ball\nfootball += ball"
        document = SetStateCode(automaton=1, state=1, part=part, text=text).apply(document)
    for where in ("trigger", "guard", "fired"):
        document = SetTransitionCode(automaton=1, transition=1, part=where, text="ball").apply(document)
    for which in ("variables", "functions"):
        document = SetAutomatonCode(automaton=4, part=which, text="ball").apply(document)
    return RenameState(automaton=3, state=1, name="ball").apply(document)


def test_a_word_is_replaced_in_all_code_and_in_nothing_else() -> None:
    command = ReplaceText(text="ball", by=r"\1 b", whole=True)
    before = with_balls()
    assert command.title(before) == r"Replace “ball” by “\1 b” (12 times)"
    document = command.apply(before)
    first, second = automaton(document).states
    assert {first.entry.text, first.code.text, first.exit.text} == {"Ball = \\1 b\nfootball += \\1 b"}
    assert second.arguments == (Argument(name="ball", child=3, value=Text(r"\1 b")),)
    go = automaton(document).transitions[0]
    deep = automaton(document, 4)
    texts = {go.trigger.text, go.guard.text, go.code.text, deep.variables.text, deep.functions.text}
    assert texts == {r"\1 b"}
    assert automaton(document, 3) is automaton(before, 3)


def test_a_text_is_replaced_in_one_line_of_one_place_in_any_case() -> None:
    place = Place(kind="state", automaton=1, id=1, part="exit")
    command = ReplaceText(text="BALL", by="it", place=place, line=2)
    assert command.title(with_balls()) == "Replace “BALL” by “it” (2 times)"
    document = command.apply(with_balls())
    assert automaton(document).states[0].exit.text == "Ball = ball\nfootit += it"
    rest = SetStateCode(automaton=1, state=1, part="exit", text="Ball = ball\nfootball += ball").apply(
        document
    )
    assert rest == with_balls()


@pytest.mark.parametrize(
    ("text", "by", "why"),
    [
        ("", "x", "no code has"),
        ("nowhere", "x", "no code has “nowhere”"),
        ("a", "x" * 1000, "more than 12 MiB"),
    ],
)
def test_a_replacement_of_nothing_or_of_too_much_is_refused(text: str, by: str, why: str) -> None:
    document = SetAutomatonCode(automaton=1, part="functions", text="a" * 20_000).apply(tree())
    with pytest.raises(EditError, match=why):
        ReplaceText(text=text, by=by).apply(document)


def test_an_empty_automaton_imports_and_no_more() -> None:
    document = AddAutomaton(automaton=1, state=1).apply(tree())
    document = SetImport(automaton=5, file="search.xml", source=2).apply(document)
    document = SetImport(automaton=5, file="other.xml").apply(document)
    imported = automaton(document, 5).imported
    assert imported is not None
    assert (imported.file.text, imported.automaton) == ("other.xml", 0)
    with pytest.raises(EditError, match="comes from another file"):
        AddState(automaton=5, x=0, y=0).apply(document)
    assert automaton(SetImport(automaton=5, file="").apply(document), 5).imported is None
    with pytest.raises(EditError, match="states, transitions or inputs"):
        SetImport(automaton=2, file="search.xml").apply(document)
    with pytest.raises(EditError, match="it is the root"):
        SetImport(automaton=1, file="search.xml").apply(document)


def test_a_renamed_input_takes_its_arguments_along() -> None:
    document = AddEntry(
        list="inputs", automaton=2, fields={"name": "times", "type": "int", "default": "1"}
    ).apply(tree())
    for child in (0, 2, 3):
        document = SetArgument(automaton=1, state=2, name="times", value="2", child=child).apply(document)
    document = ChangeEntry(list="inputs", automaton=2, index=0, fields={"name": "rounds"}).apply(document)
    assert automaton(document, 2).inputs == (Parameter(name="rounds", type=Text("int"), default=Text("1")),)
    assert [each.name for each in state(document, 2).arguments] == ["rounds", "rounds", "times"]


def test_the_data_of_a_component_is_set() -> None:
    document = tree()
    texts: Any = (
        ("description", "waits"),
        ("onError", "continue"),
        ("onRefused", "error"),
        ("world", "soccer"),
        ("language", "C++"),
    )
    for part, text in texts:
        document = SetComponentText(part=part, text=text).apply(document)
    assert (document.description.text, document.on_error.text) == ("waits", "continue")
    assert (document.world.text, document.language.text) == ("soccer", "C++")


@pytest.mark.parametrize(
    ("add", "change", "list_name"),
    [
        (
            AddEntry(list="parameters"),
            ChangeEntry(list="parameters", index=0, fields={"name": "speed", "default": "1.0"}),
            "parameters",
        ),
        (
            AddEntry(list="events"),
            ChangeEntry(list="events", index=0, fields={"name": "go home", "description": "x"}),
            "events",
        ),
        (
            AddEntry(list="properties"),
            ChangeEntry(
                list="properties", index=0, fields={"kind": "never", "within": "5", "expression": "wait"}
            ),
            "properties",
        ),
        (
            AddEntry(list="libraries", fields={"name": "cv2"}),
            ChangeEntry(list="libraries", index=0, fields={"name": "numpy as np"}),
            "libraries",
        ),
        (
            AddEntry(list="interfaces"),
            ChangeEntry(
                list="interfaces", index=0, fields={"name": "head", "proxy": "Head", "type": "PoseHead"}
            ),
            "interfaces",
        ),
        (
            AddEntry(list="ros"),
            ChangeEntry(
                list="ros",
                index=0,
                fields={
                    "name": "scan",
                    "kind": "publish",
                    "target": "/scan",
                    "qos": "latched",
                    "stop": "true",
                },
            ),
            "ros",
        ),
    ],
    ids=["parameter", "event", "property", "library", "interface", "topic"],
)
def test_entries_are_added_changed_moved_and_removed(add: Command, change: Command, list_name: Any) -> None:
    document = add.apply(add.apply(tree()))
    added = getattr(document, list_name)
    assert len({each.name for each in added}) == (1 if list_name == "libraries" else 2)
    document = change.apply(document)
    first, second = getattr(document, list_name)
    assert first != added[0]
    assert second == added[1]
    document = ReorderEntry(list=list_name, index=0, to=1).apply(document)
    assert getattr(document, list_name) == (second, first)
    document = RemoveEntry(list=list_name, index=0).apply(document)
    assert getattr(document, list_name) == (first,)
    with pytest.raises(EditError, match="there are 1"):
        RemoveEntry(list=list_name, index=1).apply(document)
    assert parse(write_document(document), "Cannot read") == document


def test_numbers_that_two_share_are_reported_and_repaired() -> None:
    twins = (State(id=1, name="a"), State(id=1, name="b"))
    arrows = (Transition(id=1, origin=1, destination=1), Transition(id=1, origin=1, destination=1))
    document = Document(automata=(Automaton(id=1, states=twins, transitions=arrows), Automaton(id=1)))
    with pytest.raises(EditError, match="Repair numbers"):
        RenameState(automaton=1, state=1, name="c").apply(document)
    repaired = RepairNumbers().apply(document)
    assert [each.id for each in repaired.automata] == [1, 2]
    assert [each.id for each in repaired.automata[0].states] == [1, 2]
    assert [each.id for each in repaired.automata[0].transitions] == [1, 2]
    assert state(RenameState(automaton=1, state=1, name="c").apply(repaired), 1).name == "c"


def test_text_that_no_file_can_hold_is_refused_with_its_line() -> None:
    with pytest.raises(EditError, match=r"line 2 has the control character U\+001B"):
        SetStateCode(automaton=1, state=1, part="code", text="a\n\x1b").apply(tree())
    with pytest.raises(EditError, match="more than"):
        SetStateCode(automaton=1, state=1, part="code", text="x" * (1 << 21)).apply(tree())


def test_a_command_that_changes_nothing_returns_the_document_itself() -> None:
    document = tree()
    for command in (
        RenameState(automaton=1, state=1, name="wait"),
        MoveItems(automaton=1, states=(1,), dx=0, dy=0),
        MarkInitial(automaton=1, state=1),
        RetargetTransition(automaton=1, transition=1, destination=2),
        RemoveArgument(automaton=1, state=1, name="x"),
    ):
        assert command.apply(document) is document, command


def test_commands_come_as_json() -> None:
    command = decode_command('{"command": "addState", "automaton": 1, "x": 10, "y": 20}')
    assert command == AddState(automaton=1, x=10.0, y=20.0)
    assert decode_command(msgspec.json.encode(command)) == command
    assert len({each.__struct_config__.tag for each in COMMANDS}) == len(COMMANDS)


@pytest.mark.parametrize(
    "content",
    [
        "{}",
        "[]",
        "{",
        '{"command": "formatDisk"}',
        '{"command": "addState", "automaton": -1, "x": 0, "y": 0}',
        '{"command": "addState", "automaton": 1, "x": "0", "y": 0}',
        '{"command": "addState", "automaton": 1, "x": 0, "y": 0, "z": 0}',
        '{"command": "addState", "automaton": 1, "x": NaN, "y": 0}',
        '{"command": "setStateCode", "automaton": 1, "state": 1, "part": "id", "text": "7"}',
        '{"command": "renameState", "automaton": 1, "state": 1, "name": "\\ud800"}',
        b"\xff",
    ],
)
def test_json_that_is_no_command_is_refused(content: str | bytes) -> None:
    with pytest.raises(EditError, match="Cannot understand the command"):
        decode_command(content)


def test_an_entry_has_the_fields_of_its_list_alone() -> None:
    with pytest.raises(EditError, match="it has only name, description"):
        AddEntry(list="events", fields={"type": "int"}).apply(tree())
    document = AddEntry(list="properties", fields={"kind": "never"}).apply(tree())
    with pytest.raises(EditError, match="one of always, eventually, never"):
        ChangeEntry(list="properties", index=0, fields={"kind": "mostly"}).apply(document)
    with pytest.raises(EditError, match="one of publish, subscribe, service, action"):
        AddEntry(list="ros", fields={"kind": "always"}).apply(document)


def test_every_command_is_named_by_what_it_does() -> None:
    document = tree()
    for command, title in (
        (RenameState(automaton=1, state=1, name="x"), "Rename “wait”"),
        (DeleteItems(automaton=1, states=(1, 2), transitions=(1,)), "Delete 2 states and 1 transition"),
        (AddTransition(automaton=1, origin=1, destination=2), "Add a transition from “wait” to “work”"),
        (SetStateCode(automaton=1, state=1, part="entry", text=""), "Edit the entry code of “wait”"),
        (AddEntry(list="interfaces"), "Add an interface"),
        (RemoveEntry(list="properties", index=0), "Remove a property"),
    ):
        assert command.title(document) == title
