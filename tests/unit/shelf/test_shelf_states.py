"""Each state of our shelf, drawn into a document: it is checked, ends, and stops what it began when it is left."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final, Literal

import pytest

from interfaces.nao import ActionState, ActionStatus, SafetyPrx, TouchReading
from tests.support.places import ROOT
from tests.support.soak import repeated
from visualhfsm import Place, Project, SetText
from visualhfsm._document.commands.states import AddState
from visualhfsm._document.commands.transitions import AddTransition, SetTransitionType
from visualhfsm._document.commands.variables import TakeOutput
from visualhfsm.testing import Behavior, MakeBehavior, check_properties

pytestmark = pytest.mark.sim

SHELF: Final = ROOT / "shelf"
DEGREE: Final = math.radians(1.0)

Say = Callable[[Behavior], object]


@dataclass(frozen=True)
class Example:
    """A state of the shelf in use: `prepare` is done before it is entered, `holds` afterwards.

    `stop` is the call that ends what it began, if it is left before its end. It ends within `limit` seconds.
    """

    arguments: dict[str, str] = field(default_factory=dict)
    prepare: Say = lambda _: None
    holds: Say = lambda _: True
    stop: str = ""
    limit: float = 15.0
    outputs: dict[str, object] = field(default_factory=lambda: {"done": True, "reason": ""})
    """What the state above knows in the end."""


def place_ball(b: Behavior) -> None:
    b.robot.ball("green").place(pan=0.6, distance=1.0, height=0.5)


def say_words(b: Behavior) -> None:
    b.advance(0.2)
    b.robot.hear("Go on")
    b.advance(0.2)
    assert b.active != "next"
    b.robot.hear("Please STOP now")


def press(b: Behavior) -> None:
    touched = TouchReading(time=1.0, touched=["HeadFront"])
    b.stub("Touch", getTouchReading=touched)


def is_lit(b: Behavior) -> bool:
    colors = b.component.Leds.getLeds().colors
    return [colors[eye].blue for eye in ("LeftEye", "RightEye")] == [1.0, 1.0] and colors["Chest"].blue < 1.0


def was_sent(b: Behavior, forward: float, degrees: float) -> bool:
    """Return whether the robot was sent that far: where it arrives is the test of its walk."""
    walked = b.calls("Walk.walkTo")[-1]
    return math.isclose(walked.x, forward) and math.isclose(walked.heading, degrees * DEGREE)


def said(b: Behavior) -> str:
    return str(b.component.Speech.getSpeech().text)


EXAMPLES: Final = {
    "say": Example({"text": '"Good morning"'}, holds=lambda b: said(b) == "Good morning", stop="Speech.stop"),
    "play_a_sound": Example(
        {"sound": '"fanfare"', "loudness": "0.25"},
        holds=lambda b: (
            b.calls("Sounds.play")[-1].loudness == 0.25 and b.component.Sounds.getSound().name == "fanfare"
        ),
        stop="Sounds.stop",
    ),
    "look_at": Example(
        {"left": "40.0", "up": "-10.0"},
        holds=lambda b: max(abs(b.robot.head[0] - 40 * DEGREE), abs(b.robot.head[1] - 10 * DEGREE)) < 0.1,
        stop="Head.stop",
    ),
    "look_for_a_ball": Example(
        {"color": '"green"'},
        place_ball,
        holds=lambda b: abs(b.robot.head[0] - 0.6) < 0.15,
        stop="Head.stop",
        outputs={"found": True, "left": pytest.approx(0.6 / DEGREE, abs=5.0)},
    ),
    "walk_to": Example(
        {"forward": "0.2", "turn": "20.0"}, holds=lambda b: was_sent(b, 0.2, 20.0), stop="Walk.stop"
    ),
    "turn": Example({"left": "-45.0"}, holds=lambda b: was_sent(b, 0.0, -45.0), stop="Walk.stop"),
    "sit": Example(holds=lambda b: b.component.Postures.getPosture() == "Sit", stop="Postures.stop"),
    "stand": Example(holds=lambda b: b.component.Postures.getPosture() == "Stand", stop="Postures.stop"),
    "wave_a_hand": Example(holds=lambda b: b.calls("Motions.play")[-1].name == "wave", stop="Motions.stop"),
    "kick": Example(
        {"foot": '"left"'},
        holds=lambda b: b.calls("Motions.play")[-1].name == "kick_left",
        stop="Motions.stop",
    ),
    "play_a_motion": Example(
        {"motion": '"wave"', "pace": "1.5"},
        holds=lambda b: b.calls("Motions.play")[-1].pace == 1.5,
        stop="Motions.stop",
    ),
    "lights": Example({"color": '"blue"', "where": '"Eye"'}, holds=is_lit),
    "wait_for_a_word": Example(
        {"word": '"stop"'}, say_words, outputs={"sentence": "Please STOP now", "done": True}
    ),
    "one_at_a_time": Example(
        {"role": '"talk"', "seconds": "0.5"},
        holds=lambda b: not b.component.Team.getRobotOf("talk"),
        stop="Team.release",
    ),
    "wait_for_touch": Example({"sensor": '"Head"'}, press, outputs={"touched": "HeadFront", "done": True}),
}
BODIES: Final = [
    *(("T1", name) for name in ("say", "look_at", "turn", "wave_a_hand")),
    *(("G1", name) for name in ("look_at", "walk_to")),
    *(("Cart", name) for name in ("walk_to", "lights", "play_a_sound")),
]
ANYWHERE: Final = {"look_at": {"left": "10.0", "up": "-5.0"}, "lights": {"color": '"blue"'}}
"""Arguments that suit other robots than a Nao, too."""


@pytest.fixture(scope="module")
def shelf(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Project]:
    """The shelf, which one process checks for all tests."""
    with Project(SHELF, journals=tmp_path_factory.mktemp("journals")) as made:
        made.open("sit.xml").check()  # starts the process
        yield made


@pytest.fixture(scope="module")
def drawings(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Project]:
    """A folder of documents, for which the shelf is read once, and which one process checks for all tests."""
    folder = tmp_path_factory.mktemp("drawings")
    with Project(folder, journals=folder / "journals") as made:
        made.new().check()  # starts the process
        yield made


def draw(
    project: Project,
    name: str,
    arguments: dict[str, str],
    *,
    leave_after: int | None = None,
    takes: bool = True,
) -> Path:
    """Return the file of a document: a state of the shelf, and what follows when it ends, or after a time in ms.

    The document `takes` its outputs into variables with their names.
    """
    document = project.new()
    document.add_ready_state(f"ours/{name}.xml", 1, 120.0, 160.0)
    for key, value in arguments.items():
        document.apply(
            SetText(place=Place(kind="state", automaton=1, id=1, part="argument", name=key), text=value)
        )
    for declared in document.automata[1].outputs if takes else ():
        document.apply(TakeOutput(automaton=1, state=1, name=declared.name))
    if leave_after is None:
        document.apply(AddState(automaton=1, x=400.0, y=160.0, name="next", origin=1, trigger="finished"))
    else:
        document.apply(AddState(automaton=1, x=400.0, y=160.0, name="next"))
        document.apply(AddTransition(automaton=1, origin=1, destination=2, type="time"))
        document.apply(SetTransitionType(automaton=1, transition=1, type="time", trigger=str(leave_after)))
    drawn = document.save(Path(tempfile.mkdtemp(dir=project.root.directory)) / "drawn.xml")
    document.close()
    return drawn


def test_every_state_of_the_shelf_has_an_example() -> None:
    assert sorted(EXAMPLES) == sorted(path.stem for path in SHELF.glob("*.xml"))


@pytest.mark.slow
@pytest.mark.parametrize("name", EXAMPLES)
def test_a_state_and_what_is_drawn_of_it_have_no_problems(
    shelf: Project, drawings: Project, name: str
) -> None:
    drawn = draw(drawings, name, {}, takes=False)
    for project, file in ((shelf, f"{name}.xml"), (drawings, drawn)):
        findings = project.open(file).check()
        assert [each.message for each in findings.problems if each.severity != "note"] == []


@pytest.mark.parametrize(
    "name", [path.stem for path in sorted(SHELF.glob("*.xml")) if "<property" in path.read_text()]
)
def test_what_a_state_promises_is_proved(name: str) -> None:
    check_properties(SHELF / f"{name}.xml", examples=repeated(10, 100))


@pytest.mark.slow
@pytest.mark.parametrize("robot", ["fake", pytest.param("sim", marks=pytest.mark.sim)])
@pytest.mark.parametrize("name", EXAMPLES)
def test_a_state_does_it_and_ends(
    drawings: Project, behavior: MakeBehavior, name: str, robot: Literal["fake", "sim"]
) -> None:
    example = EXAMPLES[name]
    b = behavior(draw(drawings, name, example.arguments), robot=robot, camera="drawn")
    example.prepare(b)
    b.run_until("next", limit=example.limit)
    assert not b.errors
    assert example.holds(b)
    known = b.variables("drawn")
    assert {name: known.get(name) for name in example.outputs} == example.outputs


@pytest.mark.parametrize(
    ("name", "state"),
    [
        *((name, "Walk.getWalkState") for name in ("walk_to", "turn")),
        *((name, "Postures.getPostureState") for name in ("sit", "stand")),
        *((name, "Motions.getMotionState") for name in ("kick", "wave_a_hand", "play_a_motion")),
    ],
)
def test_a_state_that_fails_says_why(
    drawings: Project, behavior: MakeBehavior, name: str, state: str
) -> None:
    identity, operation = state.split(".")
    b = behavior(draw(drawings, name, EXAMPLES[name].arguments), robot="fake", camera="drawn")
    failed = ActionState(status=ActionStatus.Failed, message="the battery is empty")
    b.stub(identity, **{operation: failed})
    b.run_until("next", limit=5.0)
    known = b.variables("drawn")
    assert (known["done"], known["reason"]) == (False, "the battery is empty")


@pytest.mark.parametrize("name", EXAMPLES)
def test_a_state_whose_servers_are_lost_ends_and_says_so(
    drawings: Project, behavior: MakeBehavior, name: str
) -> None:
    b = behavior(draw(drawings, name, EXAMPLES[name].arguments), robot="fake", camera="drawn")
    with b.server_offline():
        b.run_until("next", limit=1.0)
    known = b.variables("drawn")
    assert not known.get("done", known.get("found"))
    assert " is offline: it was taken offline" in known["reason"]


@pytest.mark.parametrize("name", ["kick", "look_at", "say", "sit", "turn", "walk_to"])
def test_a_state_that_is_under_way_when_its_servers_are_lost_ends_and_says_so(
    drawings: Project, behavior: MakeBehavior, name: str
) -> None:
    b = behavior(draw(drawings, name, EXAMPLES[name].arguments), robot="fake", camera="drawn")
    b.advance(0.2)
    with b.server_offline():
        b.run_until("next", limit=1.0)
    assert " is offline: it was taken offline" in b.variables("drawn")["reason"]


@pytest.mark.parametrize(
    "name", ["kick", "look_at", "play_a_motion", "sit", "turn", "walk_to", "wave_a_hand"]
)
def test_a_state_whose_robot_is_stopped_ends_and_says_so(
    drawings: Project, behavior: MakeBehavior, name: str
) -> None:
    b = behavior(draw(drawings, name, EXAMPLES[name].arguments), robot="fake", camera="drawn")
    safety = SafetyPrx.uncheckedCast(b.world.communicator.stringToProxy("Safety"))
    safety.emergencyStop("a hand in the way")
    b.run_until("next", limit=1.0)
    known = b.variables("drawn")
    assert (known["done"], "a hand in the way" in known["reason"]) == (False, True)
    assert safety.getSafetyState().stopped


@pytest.mark.parametrize("name", [name for name, example in EXAMPLES.items() if example.stop])
def test_a_state_that_is_left_stops_what_it_began(
    drawings: Project, behavior: MakeBehavior, name: str
) -> None:
    example = EXAMPLES[name]
    b = behavior(draw(drawings, name, example.arguments, leave_after=300), robot="fake", camera="drawn")
    b.run_until("next", limit=1.0)
    assert b.calls()[-1].target == example.stop


@pytest.mark.parametrize(("body", "name"), BODIES)
def test_a_state_suits_other_robots(drawings: Project, behavior: MakeBehavior, body: str, name: str) -> None:
    arguments = ANYWHERE.get(name, EXAMPLES[name].arguments)
    b = behavior(draw(drawings, name, arguments), robot="sim", camera="drawn", body=body)
    b.run_until("next", limit=20.0)
    assert not b.errors
