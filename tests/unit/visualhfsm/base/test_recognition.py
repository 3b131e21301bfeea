"""What components and robots say, in the language of a page: real ones speak, so that the templates are theirs."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import msgspec
import pytest

from codegen.reasons import PARTS
from hfsm_runtime import Automaton, State
from hfsm_runtime.virtual import Execution
from naoserver.errors import CommandRefused
from naoserver.safety._event_log import EventLog
from naoserver.safety._gate import Gate
from tests.support.automata import component
from tests.support.places import ROOT
from visualhfsm._base.languages import encoder, sentences
from visualhfsm._base.recognition import recognized

STATES = (State(id=1, name="a", initial=True), State(id=2, name="b", final=True))


def in_spanish(value: object) -> dict[str, Any]:
    """Return what a Spanish page gets of a value."""
    found: dict[str, Any] = msgspec.json.decode(encoder("es").encode(value))
    return found


ENDED = "la parada de emergencia terminó las órdenes de somebody"


def test_a_refused_command_and_its_events_are_said_in_spanish() -> None:
    events = EventLog(lambda: 0.0, lambda: 0.0)
    gate = Gate(events)
    gate.stop("STOP was pressed in the editor")
    with pytest.raises(CommandRefused) as refused:
        gate.require("somebody")
    gate.reset()
    with pytest.raises(CommandRefused) as refused_again:
        gate.require("somebody")
    said = [in_spanish({"": recognized(each.message)})[""] for each in events.snapshot()[0]]
    assert said == [
        "parada de emergencia: se pulsó STOP en el editor",
        "orden rechazada: el robot está parado: se pulsó STOP en el editor",
        "se ha levantado la parada de emergencia",
        f"orden rechazada: {ENDED}",
    ]
    assert in_spanish({"": recognized(str(refused_again.value))})[""] == (
        f"{ENDED}; inicia de nuevo su programa, o deja seguir a todos: nao stop --reset --resume"
    )
    assert in_spanish({"": recognized(str(refused.value))})[""] == (
        "el robot está parado: se pulsó STOP en el editor; levanta antes la parada de emergencia"
    )


def test_what_a_reload_could_not_keep_is_said_in_spanish() -> None:
    count = 0
    below = Automaton(id=2, name="b", states=(State(id=1, name="red", initial=True, exit=lambda: None),))
    first = replace(STATES[0], code=lambda: count, children=(below,))
    run = Execution(component(Automaton(id=1, name="walker", states=(first, STATES[1]))))
    run.advance(0.35)
    other = Automaton(id=1, name="walker", states=(State(id=7, name="c", initial=True),))
    said = [in_spanish({"": recognized(each)})[""] for each in run.exchange(component(other))]
    assert said == [
        "ningún código del autómata 1 (walker) usa ya count",
        "el autómata 2 (b), que estaba en red, ya no existe; su código de salida no se ejecutó",
        "el autómata 1 (walker) estaba en el estado a, que ya no existe, y vuelve a empezar en c",
    ]


ERRORS = {"CommandRefused", "InvalidCommand", "InvalidValueException", "RouteError", "JointTaken", "LinkLost"}
DOORS = ("naoserver/moves/joint_paths.py",)
"""Programs for other robots come through these, and read what their own robot says."""
WORDS = {
    "{}; {}": ("the robot is held by Ana", "wait until the lease is given back"),
    "{} is moved by {} now: stop it first": ("LKnee", "the walk"),
    "{}: a {} of {} is not a finite number": ("LKnee", "speed", "nan"),
    "the robot cannot {}, so it cannot go to a place": ("turn",),
    "the robot cannot {}: {}": ("drive", "it has toppled over; put it on its wheels first"),
}
"""Values that are words, not names or numbers, as the code of robots puts them into its texts."""


def refusals() -> Iterator[str]:
    """Yield the texts in the code of robots with which commands are refused."""
    for folder in ("naoserver", "naoserver_sim"):
        for path in sorted((ROOT / folder).rglob("*.py")):
            if not path.relative_to(ROOT).as_posix().startswith(DOORS):
                yield from refusals_in(ast.parse(path.read_text("utf-8")))


def refusals_in(module: ast.Module) -> Iterator[str]:
    for node in ast.walk(module):
        if not (isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in ERRORS):
            continue
        for argument in node.args:
            match argument:
                case ast.Constant(value=str(text)) if " " in text:  # not the name of a field
                    yield text
                case ast.JoinedStr(values=parts):
                    text = "".join(
                        str(part.value) if isinstance(part, ast.Constant) else "{}" for part in parts
                    )
                    yield text.format(*WORDS.get(text, ["7"] * len(parts)))


@pytest.mark.slow
def test_every_refusal_of_a_robot_is_known() -> None:
    found = list(refusals())
    assert len(found) > 30
    assert [text for text in found if in_spanish({"": recognized(text)})[""] == text] == []


@pytest.mark.parametrize(
    ("english", "spanish"),
    [
        (
            "InvalidValueException: LKnee: a speed of -0.5 is negative (field='LKnee')",
            "InvalidValueException: LKnee: una velocidad de -0,5 es negativa (field='LKnee')",
        ),
        (
            "the output found of automaton 2 (b) is int now and has its default again",
            "la salida found del autómata 2 (b) ahora es int y vuelve a tener su valor por defecto",
        ),
        (
            "a breakpoint is dropped: automaton 1 (walker) has no state 3",
            "se quita un punto de parada: el autómata 1 (walker) no tiene el estado 3",
        ),
        (
            "1.57 is out of range, limited to -0.25 (3 more since the last report)",
            "1,57 está fuera de su rango; se limita a -0,25 (3 más desde el último aviso)",
        ),
        (
            "limited to 0 until it is stopped: it has fallen",
            "se limita a 0 hasta que se pare: se ha caído",
        ),
        (
            "the motion Wave ended: LKnee has gone limp",
            "el movimiento Wave ha terminado: LKnee se ha aflojado",
        ),
        (
            "Sit begins standing, in Stand, but the robot is lying on its belly now",
            "Sit empieza de pie, en Stand, pero el robot está ahora tumbado boca abajo",
        ),
        (
            "lost the robot: ALMemory.getListData: no answer within 0.5 s; trying to find it again",
            "se ha perdido el robot: ALMemory.getListData: sin respuesta en 0,5 s; se intenta encontrarlo otra vez",
        ),
    ],
)
def test_parts_of_what_a_robot_says_are_said_in_spanish_too(english: str, spanish: str) -> None:
    assert in_spanish({"": recognized(english)})[""] == spanish


def test_what_is_not_known_stays_as_it_is() -> None:
    for text in ("¿Qué?", "", "the ball is in goal", "x" * 1000):
        assert in_spanish({"": recognized(text)})[""] == text


@pytest.mark.parametrize(
    ("english", "spanish"),
    [
        ("walker has finished in b, entered by t1", "walker ha acabado en b; entró por t1"),
        (
            "Top has no format 'X'; it has RGB8; JPEG needs Pillow where the server runs: pip install pillow",
            (
                "Top no tiene el formato 'X'; tiene RGB8; JPEG necesita Pillow donde se ejecuta el servidor: "
                "pip install pillow"
            ),
        ),
        (
            "not all automata of the state have finished: a is in b, c is in d",
            "no han acabado todos los autómatas del estado: a está en b, c está en d",
        ),
    ],
)
def test_the_template_that_knows_most_of_a_text_counts(english: str, spanish: str) -> None:
    assert in_spanish({"": recognized(english)})[""] == spanish


@pytest.mark.parametrize(
    ("english", "spanish"),
    [
        ("standing has been in turn for 1.50 s", "standing está en turn desde hace 1,50 s"),
        ("walker is in standing", "walker is in standing"),
        ("it refused to walk: it is going to rain", "se ha negado a andar: it is going to rain"),
    ],
)
def test_names_that_people_give_are_no_part_of_a_sentence(english: str, spanish: str) -> None:
    assert in_spanish({"": recognized(english)})[""] == spanish


def test_each_part_of_a_sentence_is_a_value_of_one() -> None:
    assert {*PARTS}.issubset(name for each in sentences() for name in each.values)


@pytest.mark.parametrize(
    "text", ["; " * 300, "a ended: b stopped: " * 30, ", limited to 1" * 40, "x is y, not z: " * 40]
)
def test_a_text_that_fits_again_and_again_is_not_changed(text: str) -> None:
    assert recognized(text) == text
