"""The gate before a robot: whatever an agent, or somebody beside it, tries, nothing moves without a verdict."""

from __future__ import annotations

import re
import shutil
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing, suppress
from pathlib import Path
from typing import Any

import pytest

from codegen.messages import MessageError
from interfaces.nao import SafetyPrx
from naoserver.fake import FakeRobot
from tests.support.documents import transition
from tests.support.limits import CALL_LIMIT, RUN_LIMIT, START_LIMIT
from tests.support.robot_server import ServedRobot, served
from tests.support.waiting import until
from visualhfsm import VisualHfsmError
from visualhfsm_agent._approval import Approvals, Asked
from visualhfsm_agent._desk import Desk
from visualhfsm_agent._limits import AgentError
from zenoh_ice import Settings, ZenohIceError

pytestmark = pytest.mark.slow

_CODE = "self.Head.setPose(0.5, 0.0, 0.5)"
_DOCUMENT = """<VisualHFSM>
<SubAutomata id="1" idFather="0">
<state initial="true" id="1"><name>look</name><code>{code}</code>{inside}</state>{last}</SubAutomata>
{more}<config><iceinterface><nameinterface>Head</nameinterface><nameproxy>{identity}</nameproxy>
<interface>{kind}</interface></iceinterface></config></VisualHFSM>
"""
_CHILD = """<VisualHFSM><SubAutomata id="1" idFather="0">
<state initial="true" id="1"><name>below</name><code>pass</code></state></SubAutomata></VisualHFSM>
"""
_TORN = "class Torn:\n    def __repr__(self):\n        {}\nx = Torn()"
_IMPORT = '<SubAutomata id="2" idFather="1"><import>child.xml</import></SubAutomata>\n'


def write(
    root: Path, code: str = _CODE, *, identity: str = "Head", kind: str = "PoseHead", **parts: str
) -> None:
    parts = {"inside": "", "last": "", "more": "", **parts}
    (root / "look.xml").write_text(_DOCUMENT.format(code=code, identity=identity, kind=kind, **parts))


def allow(root: Path, realm: str, **changes: str) -> None:
    given = {"realm": f'"{realm}"', "interfaces": '["Head"]', "ask": "false", "longest_run": f"{START_LIMIT}"}
    (root / "agent.toml").write_text(
        "".join(f"{key} = {value}\n" for key, value in (given | changes).items())
    )


@pytest.fixture(scope="module")
def robot() -> Iterator[ServedRobot]:
    with served(FakeRobot()) as server:
        yield server


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("projects") / "project"


@pytest.fixture
def root(folder: Path, robot: ServedRobot) -> Path:
    """The folder as it is at the beginning of each test."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    write(folder)
    allow(folder, robot.realm)
    return folder


def desk_of(root: Path, robot: ServedRobot, patience: float = RUN_LIMIT) -> Desk:
    settings = Settings(realm=robot.realm, connect=(robot.endpoint,), clock="wall", timeout=CALL_LIMIT)
    return Desk(root, settings, patience=patience)


@pytest.fixture(scope="module")
def lasting(folder: Path, robot: ServedRobot) -> Iterator[Desk]:
    """A desk that all tests share, as its processes take a second to start."""
    folder.mkdir(exist_ok=True)
    write(folder)
    with closing(desk_of(folder, robot)) as made:
        made.robot()
        made.verdict("look.xml", seconds=0.1)
        made.simulate("look.xml", seconds=0.1)
        yield made


@pytest.fixture
def desk(lasting: Desk, root: Path) -> Desk:
    return lasting


def ended(desk: Desk) -> dict[str, Any]:
    """Return the report of a run that has ended."""
    until(lambda: not desk.watch(1.0)["runs"], START_LIMIT)
    return desk.watch()


def angles(robot: ServedRobot) -> tuple[float, ...]:
    return tuple(robot.robot.read().positions)


def _edit(root: Path) -> None:
    write(root, "self.Head.setPose(-0.5, 0.0, 0.5)")


def _space(root: Path) -> None:
    with (root / "look.xml").open("a") as file:
        file.write(" ")


def _replace(root: Path) -> None:
    write(root.parent, "self.Head.setPose(-0.4, 0.0, 0.5)")
    (root.parent / "look.xml").replace(root / "look.xml")


def _link(root: Path) -> None:
    write(root.parent, "self.Head.setPose(-0.3, 0.0, 0.5)")
    (root / "look.xml").unlink()
    (root / "look.xml").symlink_to(root.parent / "look.xml")


def _helper(root: Path) -> None:
    (root / "helper.py").write_text("x = 1\n")


def _interface(root: Path) -> None:
    (root / "mine.idl").write_text("module mine { interface Mine { void go(); }; };\n")


def _delete(root: Path) -> None:
    (root / "look.xml").unlink()


def _no_realm(root: Path) -> None:
    (root / "agent.toml").unlink()


def _other_realm(root: Path) -> None:
    allow(root, "somebody")


def _no_servants(root: Path) -> None:
    allow(root, "somebody", interfaces="[]")


def _broken_limits(root: Path) -> None:
    (root / "agent.toml").write_text("realm = 3")


def _unknown_limit(root: Path) -> None:
    (root / "agent.toml").write_text('realm = "x"\nanything = true\n')


@pytest.mark.parametrize(
    "trick",
    [
        _edit,
        _space,
        _replace,
        _link,
        _helper,
        _interface,
        _delete,
        _no_realm,
        _other_realm,
        _no_servants,
        _broken_limits,
        _unknown_limit,
    ],
)
def test_what_changes_after_a_verdict_withdraws_it(
    desk: Desk, root: Path, robot: ServedRobot, trick: Callable[[Path], None]
) -> None:
    assert desk.verdict("look.xml", seconds=0.5)["ready"]
    before = angles(robot)
    trick(root)
    with pytest.raises((MessageError, OSError)) as caught:
        desk.run("look.xml")
    assert str(caught.value)
    assert angles(robot) == before


def test_an_imported_document_belongs_to_the_verdict(desk: Desk, root: Path, robot: ServedRobot) -> None:
    (root / "child.xml").write_text(_CHILD)
    write(root, inside="<idSubautomataSon>2</idSubautomataSon>", more=_IMPORT)
    assert desk.verdict("look.xml", seconds=0.5)["ready"]
    before = angles(robot)
    (root / "child.xml").write_text(_CHILD.replace("pass", "x = 1"))
    for why in ("has changed since the verdict", "no verdict"):  # which is asked for again
        with pytest.raises(AgentError, match=why):
            desk.run("look.xml")
    assert angles(robot) == before


@pytest.mark.parametrize(
    "code",
    [
        "import os",
        "open('x')",
        "self.Head.ice_getCommunicator()",
        "().__class__",
        "from zenoh_ice import initialize",
        "import subprocess; subprocess.run(['true'])",
    ],
)
def test_code_that_leads_elsewhere_runs_nowhere(desk: Desk, root: Path, code: str) -> None:
    write(root, code)
    for tool in (desk.verdict, desk.simulate, desk.trials):
        with pytest.raises(AgentError, match="an agent's code may not use"):
            tool("look.xml")
    with pytest.raises(AgentError, match="no verdict"):
        desk.run("look.xml")


@pytest.mark.parametrize("code", ["raise ValueError(1)", "1 / 0", "self.nothing()", "x ="])
def test_a_document_that_is_not_ready_does_not_run(
    desk: Desk, root: Path, robot: ServedRobot, code: str
) -> None:
    write(root, code)
    before = angles(robot)
    answer = desk.verdict("look.xml", seconds=0.5)
    assert not answer["ready"]
    first = answer["data"]["reasons"][0]["message"]
    with pytest.raises(AgentError, match=f"it is not ready: .*{re.escape(first)}"):
        desk.run("look.xml")
    assert angles(robot) == before


def test_a_document_that_hangs_does_not_run(root: Path, robot: ServedRobot) -> None:
    write(root, "while self: pass")
    with closing(desk_of(root, robot, patience=1.0)) as impatient:
        assert not impatient.verdict("look.xml", seconds=0.5)["ready"]
        with pytest.raises(AgentError, match=r"it is not ready: .*took more than 1 s"):
            impatient.run("look.xml")


@pytest.mark.parametrize(
    ("code", "first", "error", "variables"),
    [
        ("pass", "x = 1 / 0", r"the variables .* ZeroDivisionError: .*look\.xml:\d", {}),
        ("pass", "raise SystemExit(4)", r"the variables .* SystemExit: 4", {}),
        (_TORN.format("raise ValueError"), "", "", {"x": "<Torn instance at"}),
        (_TORN.format("raise SystemExit"), "", "", {"x": "<Torn: its repr raised SystemExit>"}),
        (_TORN.format(r"return '\udc80'"), "", "", {"x": r"\udc80"}),
    ],
)
def test_a_simulation_says_what_variables_raise(
    desk: Desk, root: Path, *, code: str, first: str, error: str, variables: dict[str, str]
) -> None:
    write(root, code, last=f"<variables>{first}</variables>")
    found = desk.simulate("look.xml", seconds=0.2)
    assert found["failed"] is bool(error)
    assert re.match(error, found["data"]["error"])
    assert all(found["data"]["variables"][name].startswith(text) for name, text in variables.items())


def test_a_stop_ends_the_behavior_of_a_robot_that_is_gone(root: Path) -> None:
    with ExitStack() as ends:
        with served(FakeRobot()) as robot:
            allow(root, robot.realm)
            desk = ends.enter_context(closing(desk_of(root, robot)))
            assert desk.verdict("look.xml", seconds=0.5)["ready"]
            assert desk.run("look.xml")["runs"]
        with pytest.raises(ZenohIceError):
            desk.stop(robot=True)
        assert not desk.watch()["runs"]


@pytest.mark.parametrize(
    ("identity", "kind"), [("Safety", "Safety"), ("Joints", "Joints"), ("other/Head", "PoseHead")]
)
def test_servants_that_a_person_does_not_list_are_not_called(
    desk: Desk, root: Path, robot: ServedRobot, identity: str, kind: str
) -> None:
    write(root, "pass", identity=identity, kind=kind)
    with suppress(VisualHfsmError):
        desk.verdict("look.xml", seconds=0.5)
    before = angles(robot)
    with pytest.raises(AgentError):
        desk.run("look.xml")
    assert angles(robot) == before


@pytest.mark.parametrize(
    "path",
    ["../look.xml", "/etc/passwd", "look.toml", "agent.toml", "a\0.xml", "", "x" * 5000, "~/look.xml/.."],
)
def test_files_outside_and_of_other_kinds_are_not_reached(desk: Desk, root: Path, path: str) -> None:
    tools: list[Any] = [desk.document, desk.verdict, desk.simulate, desk.run, desk.picture, desk.undo]
    for tool in tools:
        with pytest.raises(MessageError):
            tool(path)
    with pytest.raises(MessageError):
        desk.edit(path, [{"command": "addState", "automaton": 1, "x": 1, "y": 1}])
    assert {each.name for each in root.iterdir()} == {"look.xml", "agent.toml"}


@pytest.mark.parametrize(
    "commands",
    [
        [],
        [{}],
        [{"command": "nothing"}],
        [{"command": "addState", "automaton": 99, "x": 0, "y": 0}],
        [{"command": "renameState", "automaton": 1, "state": 99, "name": "x"}],
        [{"command": "addState", "automaton": 1, "x": 0, "y": 0}] * 501,
        [{"command": "addState", "automaton": 1, "x": 0, "y": 0, "name": "n" * (1 << 20)}],
        [
            {
                "command": "setText",
                "place": {"kind": "state", "automaton": 1, "id": -1, "part": "code"},
                "text": "x",
            }
        ],
    ],
)
def test_commands_that_are_none_change_nothing(
    desk: Desk, root: Path, commands: list[dict[str, Any]]
) -> None:
    before = (root / "look.xml").read_bytes()
    with pytest.raises(MessageError):
        desk.edit("look.xml", commands)
    assert (root / "look.xml").read_bytes() == before


def test_only_one_of_racing_runs_begins(desk: Desk) -> None:
    assert desk.verdict("look.xml", seconds=0.5)["ready"]
    began: list[dict[str, Any]] = []

    def run() -> None:
        with suppress(AgentError):
            began.append(desk.run("look.xml"))

    threads = [threading.Thread(target=run) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(began) == 1
    desk.stop()


def test_another_session_has_verdicts_of_its_own(desk: Desk, root: Path, robot: ServedRobot) -> None:
    assert desk.verdict("look.xml", seconds=0.5)["ready"]
    with closing(desk_of(root, robot)) as other, pytest.raises(AgentError, match="no verdict"):
        other.run("look.xml")


def test_of_two_agents_in_a_folder_one_runs_until_it_has_ended(
    desk: Desk, root: Path, robot: ServedRobot
) -> None:
    assert desk.verdict("look.xml", seconds=0.5)["ready"]
    with closing(desk_of(root, robot)) as other:
        assert other.verdict("look.xml", seconds=0.5)["ready"]
        assert desk.run("look.xml")["runs"]
        with pytest.raises(AgentError, match="another agent is at work in this folder"):
            other.run("look.xml")
        desk.stop()
        assert other.run("look.xml")["runs"]


def test_the_agent_that_is_refused_asks_for_no_leave(desk: Desk, root: Path, robot: ServedRobot) -> None:
    allow(root, robot.realm, ask="true")
    with closing(desk_of(root, robot)) as other:
        for each in (desk, other):
            assert each.verdict("look.xml", seconds=0.5)["ready"]
        page, asked = asked_by(desk, root)
        page.answer(asked, "allowed")
        assert desk.run("look.xml")["runs"]
        with pytest.raises(AgentError, match="another agent"):
            other.run("look.xml")
        assert page.asked() is None
        desk.stop()


def test_what_ends_by_itself_says_so(desk: Desk, root: Path) -> None:
    last = '<state id="2"><name>done</name><final>true</final></state>'
    write(root, last=last + transition(1, 1, 2, "True", type="condition"))
    assert desk.verdict("look.xml", seconds=0.5)["ready"]
    desk.run("look.xml")
    report = ended(desk)
    assert (report["exit_code"], report["stopped_by"], report["status"]) == (0, "itself", "")


def test_a_document_that_was_deleted_may_come_again(desk: Desk, root: Path) -> None:
    add = {"command": "addState", "automaton": 1, "x": 1, "y": 1, "name": "again"}
    first = desk.document("look.xml")["data"]["text"]
    (root / "look.xml").unlink()
    with pytest.raises(AgentError, match="no document now, or gone"):
        desk.document("look.xml")
    desk.edit("look.xml", [add])
    assert "again" in (root / "look.xml").read_text("utf-8")
    write(root)
    assert desk.document("look.xml")["data"]["text"] == first


def test_a_robot_is_seen_by_an_agent_that_has_just_begun(root: Path, robot: ServedRobot) -> None:
    with closing(desk_of(root, robot)) as new:
        assert new.robot()["present"]


def test_hidden_folders_are_none_of_the_project(desk: Desk, root: Path) -> None:
    add = {"command": "addState", "automaton": 1, "x": 1, "y": 1}
    for path in (".git/x.xml", ".visualhfsm-agent/x.xml", "a/.b/x.xml", ".x.xml"):
        with pytest.raises(AgentError, match="hidden"):
            desk.edit(path, [add])
        assert not (root / path).exists()


def test_a_simulation_lists_commands_and_counts_reads(desk: Desk, root: Path) -> None:
    write(root, "self.Head.setPose(0.1, 0.0, 0.5)\nself.Head.getPose()")
    data = desk.simulate("look.xml", seconds=0.5)["data"]
    assert data["reads"]["Head.getPose"] == len(data["calls"]) > 1
    assert all("Head.setPose" in call for call in data["calls"])


def asked_by(desk: Desk, root: Path) -> tuple[Approvals, Asked]:
    """Return what a run asks a person for that nobody has allowed yet."""
    with pytest.raises(AgentError, match="a person must allow this run"):
        desk.run("look.xml")
    page = Approvals(root)
    asked = page.asked()
    assert asked is not None
    return page, asked


def test_a_person_allows_each_run_in_the_page(desk: Desk, root: Path, robot: ServedRobot) -> None:
    allow(root, robot.realm, ask="true")
    assert desk.verdict("look.xml", seconds=0.5)["ready"]
    page, asked = asked_by(desk, root)
    assert asked.path == "look.xml"
    page.answer(asked, "refused")
    with pytest.raises(AgentError, match="a person has refused this run"):
        desk.run("look.xml")
    page, asked = asked_by(desk, root)
    page.answer(asked, "allowed")
    assert desk.run("look.xml")["runs"]
    desk.stop()
    with pytest.raises(AgentError, match="a person must allow this run"):  # once
        desk.run("look.xml")


def test_a_run_ends_after_the_time_that_a_person_allows_and_leaves_no_folder(
    desk: Desk, root: Path, robot: ServedRobot, tmp_path_factory: pytest.TempPathFactory
) -> None:
    allow(root, robot.realm, longest_run="0.5")
    assert desk.verdict("look.xml", seconds=0.5)["ready"]
    folder = tmp_path_factory.mktemp("private")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("tempfile.tempdir", str(folder))
        patch.setattr("visualhfsm_agent._run._GRACE", START_LIMIT)  # it is not killed, however late it began
        desk.run("look.xml")
        report = ended(desk)
        assert (report["stopped_by"], report["status"]) == ("the longest run that a person allows", "")
        assert "a behavior runs" not in str(report)
        until(lambda: not any(folder.iterdir()))


@pytest.mark.parametrize(
    ("limits", "code", "why"),
    [
        ("Head.setPose.fraction", _CODE, "allows at most 0.2 for fraction"),
        (
            "Head.setPose.pan",
            "import numpy as np; self.Head.setPose(np.int8(-128), 0.0, 0.1)",
            "allows at most 0.2 for pan",
        ),
        ("Head.setPose.fractoin", "pass", "limits Head.setPose.fractoin, which Head does not have"),
    ],
)
def test_an_argument_beyond_its_limit_is_no_call(
    desk: Desk, root: Path, limits: str, code: str, why: str
) -> None:
    write(root, code)
    with (root / "agent.toml").open("a") as file:
        file.write(f'[most]\n"{limits}" = 0.2\n')
    assert desk.verdict("look.xml", seconds=0.5)["ready"]
    desk.run("look.xml")
    report = ended(desk)
    assert (report["exit_code"], report["stopped_by"]) == (1, "an error")
    assert f"agent.toml {why}" in "\n".join(report["data"]["output"])


def test_leave_for_one_document_is_none_for_another(desk: Desk, root: Path, robot: ServedRobot) -> None:
    allow(root, robot.realm, ask="true")
    assert desk.verdict("look.xml", seconds=0.5)["ready"]
    page, asked = asked_by(desk, root)
    page.answer(asked, "allowed")
    _edit(root)
    assert desk.verdict("look.xml", seconds=0.5)["ready"]
    with pytest.raises(AgentError, match="must allow"):
        desk.run("look.xml")


def test_its_stop_stops_the_robot_until_a_person_lets_it_go_on(desk: Desk, robot: ServedRobot) -> None:
    assert desk.verdict("look.xml", seconds=0.5)["ready"]
    assert desk.run("look.xml")["runs"]
    desk.stop(robot=True)
    try:
        assert desk.robot()["emergency_stop"]
    finally:
        with robot.client() as client:
            SafetyPrx.uncheckedCast(client.communicator.stringToProxy("Safety")).resetEmergencyStop()
