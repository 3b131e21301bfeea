"""Documents of the original editors get what the original generators provided."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import pytest

from codegen.diagnostics import Diagnostics
from codegen.hfsm import parse_document, write_document
from codegen.hfsm.code.text import library_today
from codegen.hfsm.loading import check_document
from hfsm_runtime import VirtualRun
from tests.support.codegen_command import ROOT
from tests.support.documents import compile_to, document, load, state, sub, transition
from visualhfsm.simulation import Behavior

MOTORS = (
    "<iceinterface><nameinterface>motors</nameinterface><nameproxy>Motors</nameproxy>"
    "<ip>localhost</ip><port>9999</port><interface>Motors</interface></iceinterface>"
)
CODE = """with self.lock:
    speed = 0.5 if time.time() and signal.SIGINT else 0.0
self.motorsPrx.setV(speed)
self.motors.setW(float(len(threading.enumerate()) > 0))
self.seen = sys.version_info.major, traceback.format_exc()"""


def old(*parts: str, config: str = MOTORS) -> str:
    """Return a document as VisualHFSM's editor of 2013 to 2017 wrote it: on one line, but for code."""
    inside = "".join(part.replace(">\n", ">") for part in parts)
    return f"<VisualHFSM>{inside}<libraries/><config>{config}</config></VisualHFSM>"


def visualstates(inside: str) -> str:
    """Return a document of VisualStates."""
    return (
        f'<VisualStates>\n<state id="0" initial="True"><name>root</name>\n{inside}</state>\n</VisualStates>'
    )


def checked(path: Path, text: str) -> list[str]:
    """Return what `check` reports of a document, as `code: message`."""
    path.write_text(text)
    diagnostics = Diagnostics()
    check_document(path, diagnostics)
    return [f"{found.code}: {found.message}" for found in diagnostics]


def converted(text: str) -> str:
    """Return a document in the format of today."""
    document = parse_document(text, Path("old.xml"), Diagnostics())
    assert document is not None
    return write_document(document)


DECLARED = "<dialect>VisualHFSM</dialect>"
LAYOUTS = {
    "2017": old(sub(1, 0, state(1, "go", CODE, initial=True))),
    "today": document(sub(1, 0, state(1, "go", CODE, initial=True)), config=MOTORS),
}
every_layout = pytest.mark.parametrize("text", LAYOUTS.values(), ids=LAYOUTS)


@every_layout
@pytest.mark.parametrize("change", [str, converted])
def test_code_finds_what_the_generator_of_2017_gave_it(
    tmp_path: Path, text: str, change: Callable[[str], str]
) -> None:
    component = load(compile_to(tmp_path, change(text)))
    calls: list[float] = []
    vars(component)["motors"] = SimpleNamespace(setV=calls.append, setW=calls.append)
    run = VirtualRun(component)
    run.advance(0)
    assert (run.errors, calls) == ((), [0.5, 1.0])


@every_layout
def test_old_names_are_noted_unless_the_document_says_that_it_is_old(tmp_path: Path, text: str) -> None:
    found = checked(tmp_path / "new.xml", text)
    assert {each[:4] for each in found} == {"N504"}
    for name in ("self.lock", "time", "signal", "self.motorsPrx", "threading", "sys", "traceback"):
        assert f": `{name}` is " in "\n".join(found)
    assert checked(tmp_path / "old.xml", text.replace("<VisualHFSM>", f"<VisualHFSM>{DECLARED}")) == []


@every_layout
def test_nothing_is_added_to_a_document(text: str) -> None:
    assert "dialect" not in converted(text)


@pytest.mark.parametrize("name", ["dance", "follow_ball"])
def test_a_document_without_white_space_becomes_the_same_component(tmp_path: Path, name: str) -> None:
    text = (ROOT / "behaviors" / f"{name}.xml").read_text()
    minified = re.sub(r">\s+<", "><", text)
    assert converted(minified) == converted(text)

    components = [compile_to(tmp_path, each, name).read_text() for each in (minified, text)]
    assert components[0] == components[1]


@pytest.mark.parametrize("head", ["", DECLARED])
def test_a_component_has_only_the_old_names_that_it_uses(tmp_path: Path, head: str) -> None:
    functions = "def wait(self, time):\n    self.log.info(time)\n    threading = time"
    text = document(
        sub(1, 0, state(1, "go", "sys = 1\nself.wait(sys)", initial=True), functions=functions),
        config=MOTORS,
        head=head,
    )
    generated = compile_to(tmp_path, text).read_text()
    assert not [line for line in generated.split("\n") if line.startswith("import ")]
    assert "property(" not in generated
    assert "Lock()" not in generated


def test_what_the_document_itself_calls_so_wins(tmp_path: Path) -> None:
    functions = "def lock(self): return 1\ndef motorsPrx(self): return 2"
    code = "self.found = self.lock() + self.motorsPrx()"
    component = load(
        compile_to(tmp_path, old(sub(1, 0, state(1, "go", code, initial=True), functions=functions)))
    )
    run = VirtualRun(component)
    run.advance(0)
    assert (run.errors, vars(component)["found"]) == ((), 3)


def test_operations_are_checked_under_both_names(tmp_path: Path) -> None:
    text = old(sub(1, 0, state(1, "go", "self.motorsPrx.fly()", initial=True)))
    assert any("has no operation `fly`" in each for each in checked(tmp_path / "a.xml", text))


STATES = state(1, "go", initial=True), state(2, "rest")
REPEATED = transition(4, 1, 2, "10", type="time"), transition(4, 2, 1, "20", type="time")


def visualstates_transition(id: int, origin: int, destination: int) -> str:
    """Return a transition of VisualStates."""
    return (
        f'<transition id="{id}"><type>0</type><time>10</time><originid>{origin}</originid>'
        f"<destinationid>{destination}</destinationid><code></code></transition>"
    )


@pytest.mark.parametrize(
    "text",
    [
        old(sub(1, 0, *STATES, *REPEATED), config=""),
        visualstates(
            '<state id="1" initial="True"><name>go</name>'
            + visualstates_transition(4, 1, 2)
            + '</state>\n<state id="2"><name>rest</name>'
            + visualstates_transition(4, 2, 1)
            + "</state>\n"
        ),
    ],
)
def test_repeated_ids_of_transitions_are_renumbered(tmp_path: Path, text: str) -> None:
    assert checked(tmp_path / "old.xml", text) == ["W508: the id 4 of a transition is not unique: it gets 1"]
    component = load(compile_to(tmp_path, text))
    assert [each.id for each in component.automaton().transitions] == [4, 1]
    assert checked(tmp_path / "new.xml", converted(text)) == []


def test_repeated_ids_of_today_are_an_error(tmp_path: Path) -> None:
    (found,) = checked(tmp_path / "new.xml", document(sub(1, 0, *STATES, *REPEATED)))
    assert found.startswith("E517: ")


def _with_speed(id: int, name: str, inside: str, speed: int, *, namespace: bool) -> str:
    """Return a state of VisualStates with a function `speed`, in its namespace or directly."""
    functions = f"<functions>def speed(self): return {speed}</functions>"
    return (
        f'<state id="{id}" initial="{id == 1}"><name>{name}</name>\n'
        f"{f'<namespace>{functions}</namespace>' if namespace else functions}"
        f"{inside}{visualstates_transition(id, id, 3 - id)}</state>\n"
    )


def _inner(id: int) -> str:
    call = "self.seen = getattr(self, 'seen', []) + [self.namespace.speed()]"
    return f'<state id="{id}" initial="True"><name>inner{id}</name><code>{call}</code></state>'


def test_every_namespace_has_functions_of_its_own(tmp_path: Path) -> None:
    text = visualstates(
        _with_speed(1, "slow", _inner(3), 1, namespace=True)
        + _with_speed(2, "fast", _inner(4), 2, namespace=True)
    )
    assert [each for each in checked(tmp_path / "old.xml", text) if not each.startswith("N")] == [
        "W509: another namespace also has `speed`: here `_3` is appended to the names"
    ]
    component = load(compile_to(tmp_path, text))
    run = VirtualRun(component)
    run.advance(0.25)
    assert (run.errors, vars(component)["seen"]) == ((), [1, 2, 1])
    assert not [each for each in checked(tmp_path / "new.xml", converted(text)) if not each.startswith("N")]


def test_functions_of_two_states_side_by_side_are_kept_apart(tmp_path: Path) -> None:
    code = "<code>self.seen = getattr(self, 'seen', []) + [self.interfaces.speed()]</code>"
    text = visualstates(
        _with_speed(1, "slow", code, 1, namespace=False) + _with_speed(2, "fast", code, 2, namespace=False)
    )
    component = load(compile_to(tmp_path, text))
    run = VirtualRun(component)
    run.advance(0.25)
    assert (run.errors, vars(component)["seen"]) == ((), [1, 2, 1])


@pytest.mark.parametrize(
    ("code", "is_changed"),
    [
        ("self.a = 1 &amp;lt; 2", True),
        ("if 1 &amp;amp;lt; 2:\n  self.a = True", True),
        ("self.a = '&amp;lt;' != ''", False),
        ("lt = 1; self.a = lt != 2", False),
    ],
)
def test_what_was_escaped_twice_is_undone(tmp_path: Path, code: str, is_changed: bool) -> None:
    text = visualstates(f'<state id="1" initial="True"><name>go</name><code>{code}</code></state>')
    found = checked(tmp_path / "old.xml", text)
    assert [each[:4] for each in found] == ["W509"] * is_changed
    component = load(compile_to(tmp_path, text))
    run = VirtualRun(component)
    run.advance(0)
    assert (run.errors, vars(component)["a"]) == ((), True)


def test_an_interface_may_be_written_in_other_letters(tmp_path: Path) -> None:
    text = old(sub(1, 0, state(1, "go", initial=True)), config=MOTORS.replace(">Motors</interface>", ">MOTORS</interface>"))  # fmt: skip
    assert checked(tmp_path / "old.xml", text) == []


DRONE = (
    "<iceinterface><nameinterface>cmd</nameinterface><nameproxy>CMDVel</nameproxy><interface>CMDVel</interface></iceinterface>"
    "<iceinterface><nameinterface>Laser</nameinterface><nameproxy>Laser</nameproxy><interface>Laser</interface></iceinterface>"
    "<iceinterface><nameinterface>pose</nameinterface><nameproxy>Pose</nameproxy><interface>Pose3d</interface></iceinterface>"
    "<iceinterface><nameinterface>extra</nameinterface><nameproxy>Extra</nameproxy><interface>ArDroneExtra</interface></iceinterface>"
    "<iceinterface><nameinterface>data</nameinterface><nameproxy>Data</nameproxy><interface>Navdata</interface></iceinterface>"
    "<iceinterface><nameinterface>bumper</nameinterface><nameproxy>B</nameproxy><interface>Bumper</interface></iceinterface>"
)
FLIGHT = """velocity = jderobot.CMDVelData()
velocity.linearX = 1
self.lock.acquire()
self.cmdPrx.setCMDVelData(velocity)
self.lock.release()
self.extraPrx.takeoff()
scan = self.LaserPrx.getLaserData()
self.seen = [scan.numLaser, scan.distanceData, self.posePrx.getPose3DData().x, self.dataPrx.getNavdata().altd]
self.seen += [scan.values, self.bumper.getBumperData().state]"""


def test_interfaces_that_no_robot_of_ours_has_are_served_by_stand_ins(tmp_path: Path) -> None:
    text = old(sub(1, 0, state(1, "fly", FLIGHT, initial=True)), config=DRONE)
    component = load(compile_to(tmp_path, text))
    with Behavior(component, stand_ins=True) as run:
        run.advance(1.0)
    assert vars(component)["seen"] == [0, [0], 0.0, 0, [0.0], 0]


@pytest.mark.parametrize(
    ("library", "code"),
    [
        ("jderobot", "self.seen = jderobot.CMDVelData().linearX"),
        (" import jderobot ", "self.seen = jderobot.CMDVelData().linearX"),
        ("jderobot as j", "self.seen = j.CMDVelData().linearX"),
        ("from jderobot import CMDVelData as Velocity", "self.seen = Velocity().linearX"),
    ],
)
def test_the_package_of_jderobot_is_that_of_today(tmp_path: Path, library: str, code: str) -> None:
    text = old(sub(1, 0, state(1, "fly", code, initial=True))).replace(
        "<libraries/>", f"<libraries><lib>{library}</lib></libraries>"
    )
    run = VirtualRun(load(compile_to(tmp_path, text)))
    run.advance(0)
    assert vars(run.component)["seen"] == 0.0
    (found,) = checked(tmp_path / "old.xml", text)
    assert found.startswith("W544")


def test_libraries_of_similar_names_are_left_alone(tmp_path: Path) -> None:
    for library in ("jderobotComm", "jderobot.laser", "my.jderobot", "from my import jderobot"):
        assert library_today(library) == library


def test_a_function_that_is_called_without_self_is_named(tmp_path: Path) -> None:
    path = tmp_path / "old.xml"
    path.write_text(
        old(sub(1, 0, state(1, "go", "finished()", initial=True), functions="def finished(self): pass"))
    )
    diagnostics = Diagnostics()
    check_document(path, diagnostics)
    (found,) = diagnostics
    assert (found.code, [note.message for note in found.notes]) == (
        "W520",
        ["the component has it: write `self.finished`"],
    )
