"""Names of automata, states and transitions on the command line."""

import contextlib

import pytest
from hypothesis import given, settings
from msgspec.structs import replace

from tests.support.any_text import any_text
from tests.support.component import dance_and_follow
from tests.support.examples import examples
from visualhfsm._base.errors import VisualHfsmError
from visualhfsm._monitor.target import Address, Addresses


@pytest.fixture
def addresses() -> Addresses:
    return Addresses(dance_and_follow())


@pytest.mark.parametrize(
    ("text", "automaton"),
    [("dance_and_follow", 1), ("followBall", 2), ("followBall/red", 3), ("red", 3), ("4", 4), ("dance", 5)],
)
def test_automata_are_called_by_the_states_above_them(
    addresses: Addresses, text: str, automaton: int
) -> None:
    assert addresses.automaton(text).automaton == automaton


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("dance", (1, 2)), ("dance_and_follow/dance", (1, 2)), ("followBall/green", (2, 2)), ("green", (2, 2)),
        ("followBall/red/search", (3, 2)), ("red/search", (3, 2)), ("4/1", (4, 1)), ("4/follow", (4, 1)),
        ("dance/left", (5, 2)), ("left", (5, 2)),
    ],
)  # fmt: skip
def test_states_are_called_by_their_automaton_and_their_name(
    addresses: Addresses, text: str, found: tuple[int, int]
) -> None:
    address = addresses.state(text)
    assert (address.automaton, address.state, address.transition) == (*found, 0)


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("to dance", (1, 1)), ("followBall -> dance", (1, 1)), ("followBall->dance", (1, 1)), ("1/2", (1, 2)),
        ("followBall/to green", (2, 1)), ("to green", (2, 1)), ("red/to search", (3, 1)),
        ("followBall/green/search -> follow", (4, 2)), ("4/to follow", (4, 2)),
    ],
)  # fmt: skip
def test_transitions_are_called_by_their_name_or_their_states(
    addresses: Addresses, text: str, found: tuple[int, int]
) -> None:
    address = addresses.transition(text)
    assert (address.automaton, address.transition, address.state) == (*found, 0)


def test_a_name_that_resembles_nothing_brings_the_names_that_there_are(addresses: Addresses) -> None:
    with pytest.raises(VisualHfsmError, match="no transition nosuch; there are "):
        addresses.transition("nosuch")


def test_a_name_that_several_have_is_reported_with_all_of_them(addresses: Addresses) -> None:
    with pytest.raises(VisualHfsmError) as error:
        addresses.state("search")
    assert str(error.value) == (
        "search may be followBall/red/search (3/2), followBall/green/search (4/2): name one in full, or by its ids"
    )


def test_a_full_name_wins_over_the_same_name_elsewhere() -> None:
    structure = dance_and_follow()
    structure.automata[0].states[1].name = "red"
    assert Addresses(structure).state("red") == Address("red", 1, state=2)


def test_a_name_that_is_spelled_wrong_is_put_right(addresses: Addresses) -> None:
    with pytest.raises(VisualHfsmError, match="no state gren; did you mean green"):
        addresses.state("gren")
    with pytest.raises(
        VisualHfsmError, match=r"no transition zzz; there are dance/to left, .*to followBall$"
    ):
        addresses.transition("zzz")
    with pytest.raises(VisualHfsmError, match="no automaton followBal; did you mean followBall"):
        addresses.automaton("followBal")


def test_an_element_is_a_state_or_a_transition(addresses: Addresses) -> None:
    assert addresses.element("green").state == 2
    assert addresses.element("to green").transition == 1
    with pytest.raises(VisualHfsmError, match="may be"):
        addresses.element("1/1")


def test_names_with_slashes_and_without_a_name_are_found() -> None:
    structure = dance_and_follow()
    structure.automata[0].transitions[0].name = "follow dance/10 s"
    structure.automata[0].transitions[1].name = " "
    addresses = Addresses(structure)
    assert addresses.transition("follow dance/10 s").transition == 1
    assert addresses.transition("dance -> followBall").name == "dance -> followBall"


def test_full_names_lead_back() -> None:
    addresses = Addresses(dance_and_follow())
    assert addresses.named(4) == "followBall/green"
    assert addresses.named(4, state=2) == "followBall/green/search"
    assert addresses.named(2, transition=1) == "followBall/to green"
    assert addresses.named(9, state=9) == "9/9"


def test_full_names_that_several_have_come_with_ids() -> None:
    structure = dance_and_follow()
    for automaton in structure.automata:
        automaton.name = "both"
        automaton.parent = 0
    addresses = Addresses(structure)
    assert addresses.named(4) == "both (4)"
    assert addresses.automaton("both (4)").automaton == 4


def test_a_structure_that_is_no_tree_ends() -> None:
    structure = dance_and_follow()
    structure.automata[0].parent = 5
    assert Addresses(structure).automaton("5").automaton == 5


@settings(max_examples=examples(40), deadline=None)
@given(any_text(max_size=30), any_text(max_size=10))
def test_no_name_breaks_it(text: str, name: str) -> None:
    structure = dance_and_follow()
    structure.automata[0].states[0].name = name
    addresses = Addresses(replace(structure, name=name))
    for find in (addresses.automaton, addresses.state, addresses.transition, addresses.element):
        with contextlib.suppress(VisualHfsmError):
            assert isinstance(find(text), Address)
