"""The semantics of inputs, sentence by sentence: what a state passes to its automata, and when."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from hfsm_runtime import Automaton, Input, State, VirtualRun, run
from hfsm_runtime._automaton import Arguments
from hfsm_runtime.errors import DefinitionError
from tests.support.automata import after, automaton, component
from zenoh_ice.data.exceptions import ConnectionLostException


class Child:
    """An automaton with inputs, and what its code saw of them."""

    def __init__(self, *inputs: Input, id: int = 2) -> None:
        self.values: dict[str, object] = {given.name: given.default for given in inputs}
        self.seen: list[dict[str, object]] = []
        self.automaton = automaton(
            id,
            f"child {id}",
            [State(id=1, name="x", entry=self._look, code=self._look)],
            inputs=inputs,
            set_inputs=self._set,
            period=0.1,
        )

    def _look(self) -> None:
        self.seen.append(dict(self.values))

    def _set(self, values: Mapping[str, object]) -> None:
        self.values.update(values)


def handing(arguments: Arguments, *children: Child, **others: Any) -> State:
    return State(
        id=1,
        name="a",
        arguments=lambda: arguments,
        children=tuple(child.automaton for child in children),
        **others,
    )


def above(state: State) -> Automaton:
    return automaton(1, "root", [state, State(id=2, name="b")], [after(0.5, 1, 2), after(0.5, 2, 1)])


def test_arguments_are_set_before_the_child_runs_anything() -> None:
    child = Child(Input(name="color", type=str))
    run(component(above(handing({2: {"color": "red"}}, child))), 0)
    assert child.seen == [{"color": "red"}] * 2


def test_arguments_are_evaluated_after_the_entry_code_and_each_time_the_state_is_entered() -> None:
    child = Child(Input(name="round", type=int))
    entered: list[None] = []
    state = State(
        id=1,
        name="a",
        entry=lambda: entered.append(None),
        arguments=lambda: {2: {"round": len(entered)}},
        children=(child.automaton,),
    )
    run(component(above(state)), 1)
    assert [seen["round"] for seen in child.seen] == [1] * 6 + [2]


def test_an_input_without_an_argument_keeps_its_value() -> None:
    child = Child(Input(name="color", type=str), Input(name="speed", type=float, default=0.5))
    run(component(above(handing({2: {"color": "red"}}, child))), 0)
    assert child.seen[0] == {"color": "red", "speed": 0.5}


def test_each_child_is_handed_its_own() -> None:
    first, second = Child(Input(name="n", type=int)), Child(Input(name="n", type=int), id=3)
    run(component(above(handing({2: {"n": 1}, 3: {"n": 2}}, first, second))), 0)
    assert (first.seen[0], second.seen[0]) == ({"n": 1}, {"n": 2})


def test_the_only_child_is_handed_its_arguments_by_their_names() -> None:
    child = Child(Input(name="n", type=int))
    run(component(above(handing({"n": 1}, child))), 0)
    assert child.seen[0] == {"n": 1}


def test_arguments_by_their_names_for_one_of_two_children_are_an_error() -> None:
    children = Child(Input(name="n", type=int, default=0)), Child(Input(name="n", type=int, default=0), id=3)
    virtual = run(component(above(handing({"n": 1}, *children))), 0)
    expected = "the state 'a' does not own one automaton: say which by its id"
    assert virtual.errors[0].message.endswith(expected)


@pytest.mark.parametrize(("inputs", "known"), [("", "none"), ("n", "n"), ("nm", "n, m")])
def test_an_argument_without_an_input_is_an_error_with_a_list_of_the_inputs(inputs: str, known: str) -> None:
    child = Child(*(Input(name=name, type=int, default=0) for name in inputs))
    virtual = run(component(above(handing({"x": 1}, child))), 0)
    assert virtual.errors[0].message.endswith(f"has no input 'x': it has {known}")


@pytest.mark.parametrize(
    ("type", "value", "set_to"),
    [
        (int, 3, 3),
        (int, np.int64(3), 3),
        (float, 3, 3.0),
        (float, np.float32(0.5), 0.5),
        (bool, True, True),
        (bool, np.True_, True),
        (str, "red", "red"),
        (object, [1], [1]),
    ],
)
def test_a_value_of_the_right_type_is_set(type: type, value: object, set_to: object) -> None:
    child = Child(Input(name="n", type=type))
    run(component(above(handing({2: {"n": value}}, child))), 0)
    assert child.seen[0] == {"n": set_to}
    assert child.values["n"].__class__ is set_to.__class__


@pytest.mark.parametrize(
    ("type", "value"),
    [(int, 3.0), (int, True), (int, "3"), (float, "3"), (float, True), (bool, 1), (str, 3), (str, None)],
)
def test_a_value_of_another_type_is_an_error_in_the_code_of_the_state(type: type, value: object) -> None:
    child = Child(Input(name="n", type=type))
    virtual = run(component(above(handing({2: {"n": value}}, child))), 0)
    assert (virtual.halted, child.seen) == (True, [])
    (error,) = virtual.errors
    assert (error.automaton, error.state) == (1, 1)
    assert f"the input 'n' of automaton 2 ('child 2') of the state 'a' is {type.__name__}" in error.message


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({7: {"n": 1}}, "owns no automaton 7"),
        ({2: {"n": 1, "m": 1}}, "has no input 'm': it has n"),
        ({}, "is not handed its input 'n', which has no default"),
    ],
)
def test_arguments_that_do_not_fit_are_an_error(
    arguments: Mapping[int, Mapping[str, object]], words: str
) -> None:
    virtual = run(component(above(handing(arguments, Child(Input(name="n", type=int))))), 0)
    assert words in virtual.errors[0].message


def test_a_lost_server_in_the_arguments_leaves_the_entry_owed_and_the_children_asleep() -> None:
    child = Child(Input(name="n", type=int))
    virtual: VirtualRun

    def arguments() -> Mapping[int, Mapping[str, object]]:
        if virtual.time < 0.3:
            raise ConnectionLostException("gone")
        return {2: {"n": 1}}

    state = State(id=1, name="a", arguments=arguments, children=(child.automaton,))
    virtual = VirtualRun(component(automaton(1, "root", [state])))
    virtual.advance(0.2)
    assert child.seen == []
    virtual.advance(0.1)
    assert child.seen == [{"n": 1}] * 2


def test_an_input_without_default_that_nobody_can_hand_over_is_refused() -> None:
    child = Child(Input(name="n", type=int))
    with pytest.raises(DefinitionError, match="the state 'a' of automaton 1"):
        automaton(1, "root", [State(id=1, name="a", children=(child.automaton,))])
    with pytest.raises(DefinitionError, match="nothing sets the input 'n' of the root"):
        run(component(child.automaton), 0)
