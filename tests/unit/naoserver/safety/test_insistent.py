"""Clients that command on after a stop, and those that command anew."""

import pytest

from hfsm_runtime._limits import LIMITS
from naoserver.safety import _insistent
from naoserver.safety._insistent import SILENCE, Insistent


@pytest.fixture
def insistent():
    return Insistent()


def many():
    return [f"client {number}" for number in range(_insistent._MOST)]


def test_the_silence_is_the_one_that_the_documentation_names():
    assert SILENCE == 1.0


def test_a_component_that_tries_again_was_silent_before():
    assert LIMITS.retry >= SILENCE


def test_who_commands_a_stopped_robot_insists_until_a_silence(insistent):
    assert insistent.insists("a", 0.0, stopped=True)
    assert insistent.insists("a", 0.999, stopped=False)
    assert insistent.insists("a", 1.998, stopped=False)
    assert not insistent.insists("a", 2.998, stopped=False)
    assert not insistent.insists("a", 2.999, stopped=False)


def test_who_never_commanded_a_stopped_robot_does_not_insist(insistent):
    insistent.insists("a", 0.0, stopped=True)
    assert not insistent.insists("b", 0.5, stopped=False)
    assert not insistent.insists("b", 0.6, stopped=False)


def test_each_needs_its_own_silence(insistent):
    insistent.insists("a", 0.0, stopped=True)
    insistent.insists("b", 0.5, stopped=True)
    assert not insistent.insists("a", 1.0, stopped=False)
    assert insistent.insists("b", 1.0, stopped=False)


def test_the_order_in_which_they_began_does_not_matter(insistent):
    insistent.insists("a", 0.0, stopped=True)
    insistent.insists("b", 0.1, stopped=True)
    insistent.insists("a", 0.9, stopped=False)
    assert not insistent.insists("b", 1.1, stopped=False)
    assert insistent.insists("a", 1.1, stopped=False)


def test_all_are_forgotten_when_a_person_lets_them_go_on(insistent):
    for client in ("a", "b"):
        insistent.insists(client, 0.0, stopped=True)
    insistent.let_go_on()
    assert not insistent.insists("a", 0.1, stopped=False)
    assert not insistent.insists("b", 0.1, stopped=False)


def test_the_first_are_named(insistent):
    for client in ("", "two\nlines", "x" * 70, "d", "e"):
        insistent.insists(client, 0.0, stopped=True)
    assert insistent.names() == f"others, two lines, {'x' * 61}... and 2 more"


def test_strangers_who_make_up_names_take_no_more_memory(insistent):
    for client in (*many(), *(f"further {number}" for number in range(1000))):
        assert insistent.insists(client, 0.0, stopped=True)
    assert len(insistent._newest) == _insistent._MOST + 1


def test_beyond_the_bound_all_others_count_as_one(insistent):
    for client in many():
        insistent.insists(client, 0.0, stopped=True)
    assert not insistent.insists("who came later", 0.1, stopped=False)
    insistent.insists("one more", 0.2, stopped=True)
    assert insistent.insists("who came later", 0.3, stopped=False)
    assert insistent.insists("who came later", 1.29, stopped=False)
    assert not insistent.insists("who came later", 2.29, stopped=False)


def test_at_the_bound_those_that_are_known_stay_known(insistent):
    for client in many():
        insistent.insists(client, 0.0, stopped=True)
    assert insistent.insists(many()[0], 0.5, stopped=False)
    assert insistent.insists(many()[0], 1.4, stopped=False)
    assert not insistent.insists("who came later", 1.4, stopped=False)


def test_those_who_are_silent_make_room(insistent):
    for client in many():
        insistent.insists(client, 0.0, stopped=True)
    assert insistent.insists("late", 1.0, stopped=True)
    assert insistent.names() == "late"
