"""What proofs rely on, as a component keeps it."""

from __future__ import annotations

from pathlib import Path

import pytest

from codegen.hfsm.document import Document, Event, Text
from codegen.hfsm.model_checker import relied_on
from codegen.hfsm.model_checker.model import read_model
from codegen.logic import PROOFS, read_proofs
from tests.support.documents import compile_to, load
from tests.support.model_documents import PATH, after, automaton, document, on, state, stated, when
from tests.support.wrong_proofs import ALL


def rows(written: Document) -> list[tuple[object, ...]]:
    return relied_on(read_model(written, PATH).effects)[0]


def test_the_events_of_a_state_are_those_of_all_code_that_runs_in_it() -> None:
    below = automaton(2, [state(1, exit='self.send("left")')], father=1)
    above = automaton(
        1,
        [state(1, code='self.send("go")', children=[2]), state(2, entry='self.send("back")'), state(3)],
        [
            on("go", 1, 2),
            on("back", 2, 1, "self.send('asked')", code='self.send("fired")'),
            *(on(event, 2, 3, id=number) for number, event in enumerate(("left", "asked", "fired"), 10)),
        ],
    )
    sent = [row for row in rows(document(above, below)) if row[0] == "sent"]
    assert sent == [
        ("sent", "asked", ((1, 2),)),
        ("sent", "back", ((1, 2),)),
        ("sent", "fired", ((1, 1),)),
        ("sent", "go", ((1, 1),)),
        ("sent", "left", ((1, 1), (2, 1))),
    ]


@pytest.mark.parametrize(("code", "declared"), [('self.send("go")', ["go"]), ("self.send(input())", [])])
def test_no_proof_relies_on_an_event_that_may_come_from_anywhere(code: str, declared: list[str]) -> None:
    automata = automaton(1, [state(1, code=code), state(2)], [on("go", 1, 2)])
    assert rows(document(automata, events=tuple(Event(name=name) for name in declared))) == []


def test_guards_are_kept_that_decide_together_and_keep_their_value() -> None:
    states = [state(1), state(2), state(3)]
    transitions = [
        when("n > 0", 1, 2, id=1),
        when("not n > 0 and m > 0", 1, 3, id=2),
        when("k > 0", 1, 3, id=3),
        when("self.camera.near", 2, 1, id=4),
        when("not self.camera.near", 2, 3, id=5),
    ]
    found = rows(document(automaton(1, states, transitions)))
    assert [row for row in found if row[0] == "guard"] == [
        ("guard", 1, 1, 1, (("n > 0", True),)),
        ("guard", 1, 1, 2, (("n > 0", False), ("m > 0", True))),
    ]


def test_links_are_kept_of_guards_that_consist_of_others() -> None:
    states = [state(1), state(2), state(3)]
    transitions = [when("n or m", 1, 2, id=1), when("not n", 1, 3, id=2), when("k and m", 2, 3, id=3)]
    variables = Text("n = m = k = 1")
    found = rows(document(automaton(1, states, transitions, variables=variables)))
    assert [row for row in found if row[0] in ("guard", "link")] == [
        ("guard", 1, 1, 1, (("n or m", True),)),
        ("guard", 1, 1, 2, (("n", False),)),
        ("link", 1, 1, (("n", False), ("m", False), ("n or m", True))),
        ("link", 1, 1, (("n or m", False), ("n", True))),
        ("link", 1, 1, (("n or m", False), ("m", True))),
    ]


def test_a_property_is_timed_that_holds_by_its_times_alone() -> None:
    states = [state(1, "a"), state(2, "b"), state(3, "c")]
    properties = [
        stated("never", "a and b", name="one"),
        stated("never", "c", "150", name="later"),
        stated("never", "b", name="wrong"),
    ]
    written = document(automaton(1, states, [after(100, 1, 2), after(100, 2, 3)]), properties=properties)
    assert rows(written) == [
        ("property", "one", "never", 0, False, (1,), ("and", ("in", (1, 1)), ("in", (1, 2)))),
        ("property", "later", "never", 150_000_000, True, (1,), ("in", (1, 3))),
    ]


def test_nothing_is_kept_where_nothing_decides() -> None:
    assert rows(document(automaton(1, [state(1), state(2), state(3)], [after(100, 1, 2)]))) == []


@pytest.mark.parametrize("name", ["code", "guards of one text", "never", "state"])
def test_a_component_has_it_and_so_has_its_text(name: str, tmp_path: Path) -> None:
    file = compile_to(tmp_path, ALL[name].text)
    kept = vars(type(load(file))).get(PROOFS, ())
    assert read_proofs(file.read_text()) == kept
    assert bool(kept) is (name in ("code", "state"))
