"""Random documents and commands for the tests of the editor."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from pathlib import Path
from random import Random
from typing import Any, Final, Literal, get_args, get_origin

import msgspec

from codegen.diagnostics import Diagnostics
from codegen.hfsm import parse_document
from codegen.hfsm.document import Automaton, Document, State, Text, Transition
from visualhfsm._base.errors import EditError
from visualhfsm._document.commands import COMMANDS, Command, decode_command
from visualhfsm._document.commands.text import SetText
from visualhfsm._document.places import Place
from visualhfsm._document.problems import UNTITLED, Findings, Problem, find
from visualhfsm._document.serialization import copy_states, written

__all__ = [
    "automaton",
    "check",
    "choose_command",
    "find_problems",
    "large_document",
    "names",
    "state",
    "texted",
    "transition",
    "tree",
]

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


_GROWING = frozenset(
    ("AddAnnotation", "AddAutomaton", "AddEntry", "AddState", "AddTransition", "PasteStates")
)
_SHRINKING = frozenset(("DeleteItems", "ExtractAutomaton", "FillAutomaton", "ReplaceDocument"))


def tree() -> Document:
    """A root with two states; one of them owns two automata, one of which owns a third."""
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


def automaton(document: Document, id: int = 1) -> Automaton:
    """Return an automaton of a document."""
    found = document.automaton(id)
    assert found is not None
    return found


def state(document: Document, id: int, of: int = 1) -> State:
    """Return a state of one of its automata."""
    found = automaton(document, of).state(id)
    assert found is not None
    return found


def transition(document: Document, id: int, of: int = 1) -> Transition:
    """Return a transition of one of its automata."""
    return next(each for each in automaton(document, of).transitions if each.id == id)


def names(document: Document, of: int = 1) -> list[str]:
    """Return the names of the states of an automaton."""
    return [each.name for each in automaton(document, of).states]


def find_problems(
    text: str, path: Path | None, include: Sequence[Path] = (), *, limit: int | None = None
) -> list[Problem]:
    """Return all problems of the text of a document."""
    return [*check(text, path, include, limit=limit, most=None).problems]


def check(text: str, path: Path | None, include: Sequence[Path] = (), **options: int | None) -> Findings:
    """Return what is found in the text of a document, with the options of `find`."""
    file, diagnostics = path or Path.cwd() / UNTITLED, Diagnostics(decoded=True)
    document = parse_document(text, file, diagnostics)
    *_, found = find(document, file, diagnostics, include, **options)
    return found


def texted(document: Document, text: str, **place: Any) -> Document:
    """Return a document with another text at a place, by default in automaton 1."""
    return SetText(place=Place(**{"automaton": 1, **place}), text=text).apply(document)


def large_document(states: int, automata: int = 1) -> Document:
    """A document with a number of states, as many transitions, and a chain of automata below the root."""
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


_fields: Final = cache(msgspec.structs.fields)  # msgspec looks them up again each time


def choose_command(random: Random, document: Document) -> Command:
    """Choose a command, mostly one that can be applied, sometimes one about a missing element."""
    kind = random.choice(COMMANDS)
    if kind.__name__ in _SHRINKING and random.random() < 0.7:
        kind = random.choice([each for each in COMMANDS if each.__name__ in _GROWING])
    automaton = random.choice([*document.automata * 6, Automaton(id=99)])
    values: dict[str, object] = {"command": kind.__struct_config__.tag}
    for field in _fields(kind):
        if field.required or random.random() < 0.6:
            values[field.encode_name] = _value(random, document, automaton, field)
    return decode_command(msgspec.json.encode(values))


def _value(
    random: Random, document: Document, automaton: Automaton, field: msgspec.structs.FieldInfo
) -> object:
    states = [state.id for state in automaton.states] or [1]
    transitions = [transition.id for transition in automaton.transitions] or [1]
    annotations = [annotation.id for annotation in automaton.annotations] or [1]
    options = [
        each
        for kind in (field.type, *get_args(field.type))
        if get_origin(kind) is Literal
        for each in get_args(kind)
    ]
    if options:
        return random.choice(options)
    match field.name:
        case "automaton":
            return automaton.id
        case "place":
            return {"kind": "state", "automaton": automaton.id, "id": random.choice(states), "part": "code"}
        case "at":
            place = {"kind": "state", "automaton": automaton.id, "id": random.choice(states), "part": "code"}
            at = {"place": place, "line": random.randint(0, 2), "column": random.randint(0, 2)}
            return [at] * random.randint(0, 2)
        case "line":
            return random.randint(0, 2)
        case "state" | "origin" | "destination":
            return random.choice([*states * 8, 77])
        case "transition":
            return random.choice([*transitions * 8, 77])
        case "annotation":
            return random.choice([*annotations * 8, 77])
        case "annotations":
            return random.sample(annotations, min(len(annotations), random.randint(0, 2)))
        case "width" | "height":
            return random.choice([0.0, 120.0, 200.5, 1e5, 1e7])
        case "states":
            return random.sample(states, min(len(states), random.randint(1, 4)))
        case "transitions":
            return random.sample(transitions, min(len(transitions), random.randint(1, 4)))
        case "x" | "y" | "dx" | "dy":
            return random.choice([0.0, 10.5, -300.0, 1e5, 0.1 + 0.2])
        case "index" | "to" | "child" | "source":
            return random.randint(0, 2)
        case "final" | "cut" | "whole":
            return random.choice([False, True])
        case "name":
            return random.choice(NAMES)
        case "file":
            return random.choice(["", "a.xml", "b & c.xml", "\0"])
        case "content":
            return _content(random, document, automaton, states)
        case "fields":
            names = ["name"] * 6 + ["type", "default", "description", "proxy", "expression"]
            return {random.choice(names): random.choice(TEXTS)}
        case "values":
            return {random.choice(NAMES): random.choice(TEXTS) for _ in range(random.randint(1, 3))}
        case "placements":
            places = [(state, random.uniform(-9, 9), random.uniform(-9, 9)) for state in states]
            notes = [(annotation.id, 5.0, -7.5, 120.0, 3.5) for annotation in automaton.annotations]
            return [{"automaton": automaton.id, "states": places, "annotations": notes}]
    return random.choice(TEXTS)


def _content(random: Random, document: Document, automaton: Automaton, states: list[int]) -> str:
    if random.random() < 0.2:
        return written(tree())
    try:
        annotations = [annotation.id for annotation in automaton.annotations]
        return copy_states(document, automaton.id, states[:2], annotations[:1])
    except EditError:
        return "<VisualHFSM/>"
