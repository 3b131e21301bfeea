"""Clients that commanded a robot before or beside a stop, and those that did not."""

import pytest

from naoserver.safety import _commanders
from naoserver.safety._commanders import Commanders


@pytest.fixture
def commanders():
    return Commanders()


def test_nobody_is_ended_without_a_stop(commanders):
    assert not commanders.note("a", stopped=False)
    assert not commanders.note("a", stopped=False)


def test_who_commands_a_stopped_robot_is_ended(commanders):
    assert commanders.note("a", stopped=True)
    assert commanders.note("a", stopped=False)
    assert commanders.note("a", stopped=False)


def test_who_commanded_before_a_stop_is_ended_though_it_commands_nothing_beside_it(commanders):
    commanders.note("a", stopped=False)
    commanders.stop()
    assert commanders.note("a", stopped=False)
    assert commanders.note("a", stopped=False)


def test_who_commands_first_after_a_stop_is_not(commanders):
    commanders.note("a", stopped=False)
    commanders.stop()
    assert not commanders.note("b", stopped=False)
    assert not commanders.note("b", stopped=False)


def test_callers_without_a_name_are_the_same(commanders):
    commanders.note("", stopped=True)
    assert commanders.note("", stopped=False)
    assert not commanders.note("a", stopped=False)


def test_a_person_lets_all_go_on(commanders):
    for client in ("a", "b"):
        commanders.note(client, stopped=True)
    commanders.let_go_on()
    assert not commanders.note("a", stopped=False)
    assert not commanders.note("b", stopped=False)


def test_a_person_lets_one_go_on(commanders):
    for client in ("a", "b"):
        commanders.note(client, stopped=True)
    commanders.let_go_on("a")
    commanders.let_go_on("who never commanded")
    assert not commanders.note("a", stopped=False)
    assert commanders.note("b", stopped=False)


def test_strangers_who_make_up_names_take_no_more_memory_and_who_commands_on_stays_known(commanders):
    for number in range(2 * _commanders._MOST):
        commanders.note("a", stopped=True)
        commanders.note(f"stranger {number}", stopped=True)
    assert len(commanders._ended) == _commanders._MOST
    assert commanders.note("a", stopped=False)
