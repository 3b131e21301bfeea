"""The component of any document has the same structure as the document, and runs."""

from __future__ import annotations

import tempfile
from itertools import count
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from codegen.hfsm import write_document
from codegen.hfsm.document import Argument, Automaton, Document, Parameter, Result, State, Text, Transition
from hfsm_runtime import Automaton as Made
from hfsm_runtime import VirtualRun
from tests.support.documents import compile_to, load
from tests.support.examples import examples

NAMES = st.sampled_from(
    ["", "go", "go", "go to wall", "class", "state_1", "año", "'\"\\", "automaton", "x" * 60]
)
CODE = st.sampled_from(
    ["", "x = 1", "\n  y = x\n  x += y", "# later", "z = '''a\n b'''", "return", "for i in []: pass"]
)
CONDITIONS = st.sampled_from(
    ["x", "True", "x > 1  # far\n", "return x", "(w := x) == 2", "\n if x:\n  return 1"]
)
TYPES = {"int": "3", "float": "0.5", "bool": "True", "str": '"red"', "object": "(1, 'a')"}
INPUTS = {type_name: f"given_{type_name}" for type_name in TYPES}
OUTPUTS = {type_name: f"found_{type_name}" for type_name in TYPES}


@st.composite
def documents(draw: st.DrawFn) -> Document:
    """Return a document with up to ten automata that uses the whole language, except for imports."""
    ids = count(1)
    automata: list[Automaton] = []

    def grow(father: int, depth: int) -> Automaton:
        own = next(ids)
        states: list[State] = []
        for number in range(1, draw(st.integers(1, 3)) + 1):
            wanted = draw(st.integers(0, 2)) if depth < 2 and len(automata) < 8 else 0
            children = [grow(own, depth + 1) for _ in range(wanted)]
            states.append(
                State(
                    id=number,
                    name=draw(NAMES),
                    initial=number == 1,
                    final=draw(st.integers(0, 5)) == 0,
                    children=tuple(child.id for child in children),
                    history=Text(draw(st.sampled_from(["", "resume", "restart"]))),
                    entry=Text(draw(CODE)),
                    code=Text(draw(CODE)),
                    exit=Text(draw(CODE)),
                    arguments=tuple(
                        Argument(
                            name=item.name,
                            child=child.id,
                            value=item.default if given else Text(TYPES[item.type.text]),
                        )
                        for child in children
                        for item in child.inputs
                        if (given := not item.default.is_blank and draw(st.booleans()))
                        or item.default.is_blank
                    ),
                    results=tuple(
                        Result(name=item.name, child=child.id, variable=Text(f"taken_{child.id}_{item.name}"))
                        for child in children
                        for item in child.outputs
                        if draw(st.booleans())
                    ),
                )
            )
        made = Automaton(
            id=own,
            father=father,
            states=tuple(states),
            transitions=tuple(
                transition(number, draw(st.integers(1, len(states))), draw(st.integers(1, len(states))))
                for number in range(1, draw(st.integers(0, 4)) + 1)
            ),
            inputs=tuple(
                Parameter(
                    name=INPUTS[name],
                    type=Text(name),
                    default=Text(TYPES[name] if father == 0 or draw(st.booleans()) else ""),
                )
                for name in draw(st.lists(st.sampled_from(sorted(TYPES)), unique=True, max_size=3))
            ),
            outputs=tuple(
                Parameter(name=OUTPUTS[name], type=Text(name), default=Text(TYPES[name]))
                for name in draw(st.lists(st.sampled_from(sorted(TYPES)), unique=True, max_size=2))
            ),
            variables=Text(
                "\n".join(
                    ["x = 0", *(f"{each.variable.text} = None" for state in states for each in state.results)]
                )
            ),
        )
        automata.append(made)
        return made

    def transition(number: int, origin: int, destination: int) -> Transition:
        kind = draw(st.sampled_from(["time", "condition", "event", "finished"]))
        trigger = {"time": "50", "event": "an event", "finished": ""}.get(kind) or ""
        return Transition(
            id=number,
            name=draw(NAMES),
            origin=origin,
            destination=destination,
            type=kind,
            trigger=Text(draw(CONDITIONS) if kind == "condition" else trigger),
            guard=Text("" if kind == "condition" else draw(st.one_of(st.just(""), CONDITIONS))),
            priority=Text(draw(st.sampled_from(["", "1", "2"]))),
            code=Text(draw(CODE)),
        )

    grow(0, 0)
    return Document(automata=tuple(automata))


@pytest.mark.slow
@settings(max_examples=examples(5), deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(documents())
def test_a_component_has_the_structure_of_its_document_and_runs(document: Document) -> None:
    with tempfile.TemporaryDirectory() as directory:
        component = load(compile_to(Path(directory), write_document(document)))
        virtual = VirtualRun(component, on_error="continue")
        virtual.send("an event", 3)
        virtual.advance(0.5)
    made = {automaton.id: automaton for automaton in virtual.tree.root.automaton.tree()}
    assert made.keys() == {automaton.id for automaton in document.automata}
    for automaton in document.automata:
        assert_same(automaton, made[automaton.id])
    assert {error.message.partition(":")[0] for error in virtual.errors} <= {"NameError"}, virtual.errors


def assert_same(automaton: Automaton, made: Made) -> None:
    for state, found in zip(automaton.states, made.states, strict=True):
        assert (state.id, state.name, state.initial, state.final) == (
            found.id,
            found.name,
            found.initial,
            found.final,
        )
        assert state.children == tuple(child.id for child in found.children)
        assert found.restart == (state.history.text == "restart")
        assert (found.arguments is not None) == bool(state.arguments)
        assert (found.results is not None) == bool(state.results and not state.final)
        for text, code in ((state.entry, found.entry), (state.code, found.code), (state.exit, found.exit)):
            assert (code is None) == text.is_blank
        assert_tried_alike(automaton, made, state.id)
    for item, declared in zip(automaton.inputs, made.inputs, strict=True):
        assert (item.name, item.type.text) == (declared.name, declared.type.__name__)
    for item, output in zip(automaton.outputs, made.outputs, strict=True):
        assert (item.name, item.type.text) == (output.name, output.type.__name__)
    for transition, fired in zip(automaton.transitions, made.transitions, strict=True):
        assert (transition.name, transition.origin, transition.destination) == (
            fired.name,
            fired.origin,
            fired.destination,
        )
        kinds = {
            "time": fired.seconds,
            "event": fired.event,
            "finished": fired.finished,
            "condition": fired.guard,
        }
        assert kinds[transition.type]
        assert guarded(transition) == (fired.guard is not None)
        assert transition.code.is_blank == (fired.code is None)


def assert_tried_alike(automaton: Automaton, made: Made, state: int) -> None:
    wanted = [transition.id for transition in automaton.outgoing(state)]
    assert wanted == [transition.id for transition in made.outgoing(made.state(state))]


def guarded(transition: Transition) -> bool:
    return transition.type == "condition" or not transition.guard.is_blank
