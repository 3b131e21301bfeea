"""The tree of automata: the path of current states, and when an automaton became active."""

from msgspec.structs import replace

from interfaces.hfsm import AutomatonStructure
from tests.support.component import dance_and_follow, snapshot, state_structure, transition_structure
from visualhfsm._monitor.realm.automata import Automata


def test_the_path_of_current_states_goes_down_to_the_innermost_running_automaton():
    automata = Automata(dance_and_follow())
    assert automata.current_path(snapshot(9.0)) == ["followBall", "green", "follow"]
    assert automata.current_path(snapshot(12.0)) == ["dance", "right"]


def test_where_a_state_owns_several_automata_the_path_branches():
    structure = dance_and_follow()
    structure.automata[0].states[0].children = [2, 5]
    structure.automata[4].owner = 1
    automata = Automata(structure)
    assert list(automata.current_paths(snapshot(9.0))) == [
        ["followBall", "green", "follow"], ["followBall", "right"]
    ]  # fmt: skip
    assert automata.current_path(snapshot(9.0)) == ["followBall", "green", "follow"]


def test_a_final_state_ends_the_path():
    structure = dance_and_follow()
    structure.automata[0].states[1].final = True
    assert list(Automata(structure).current_paths(snapshot(12.0))) == [["dance"]]


def test_the_name_of_an_event_does_not_command_the_terminal():
    structure = dance_and_follow()
    structure.automata[2].transitions = [transition_structure(3, "", 1, 2, event="\x1b[2J")]
    found = Automata(structure).transition(3, 3)
    assert found is not None
    assert found.event == " [2J"


def test_ids_that_the_structure_does_not_have_get_a_name_that_shows_them():
    automata = Automata(dance_and_follow())
    assert automata.state_name(1, 7) == "state 7"
    assert automata.automaton_name(9) == "automaton 9"
    assert automata.destination_name(1, 7) == "transition 7"


def test_a_structure_that_is_no_tree_ends():
    structure = dance_and_follow()
    structure.automata[4].states[0].children = [1]
    structure.automata[0].parent = 5
    automata = Automata(structure)
    assert list(automata.ancestors(1)) == [5]
    assert automata.current_path(snapshot(12.0)) == []

    structure = dance_and_follow()
    structure.automata[4].states[0].children = [1]
    assert Automata(structure).current_path(snapshot(12.0)) == ["dance", "right"]


def test_a_structure_deeper_than_the_stack_is_shown_as_far_as_anybody_looks():
    automata = [
        AutomatonStructure(
            id=number,
            name=f"s{number}",
            parent=number - 1,
            owner=1 if number > 1 else 0,
            period=0.1,
            source="",
            states=[state_structure(1, "s", initial=True, children=[number + 1])],
            transitions=[],
        )
        for number in range(1, 2001)
    ]
    structure = replace(dance_and_follow(), name="deep", automata=automata)
    root = snapshot(12.0).automata[0]
    now = replace(snapshot(12.0), automata=[replace(root, id=number, state=1) for number in range(1, 2001)])
    assert len(Automata(structure).current_path(now)) == 64
