"""Several windows with shared documents, through real websockets."""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import re
import socket
import threading
import time
from collections.abc import AsyncGenerator, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import msgspec
import pytest
from websockets.exceptions import ConnectionClosed

from codegen.hfsm.document import Document
from codegen.messages import Message
from tests.support.component import snapshot
from tests.support.editor import (
    DOCUMENT,
    Editor,
    NoCodeHelp,
    NoPart,
    Refused,
    Window,
    editor,
    shared_checks,
)
from tests.support.editor import parts as make_parts
from tests.support.limits import EVENT_LIMIT, FOREVER
from tests.support.plugins import OLD_DOCUMENTS
from tests.support.robot_server import eventually
from visualhfsm._base.errors import VisualHfsmError
from visualhfsm._document.places import Place
from visualhfsm._document.serialization import parse_file
from visualhfsm._editor.limits import Limits
from visualhfsm._editor.parts import Parts
from visualhfsm._monitor.messages import Output, OutputLine, Present, Publish, Snapshot, Source, StartedPush
from visualhfsm._monitor.realm.run_log import LiveSnapshot
from visualhfsm.project._document import OpenDocument
from visualhfsm.project._editing.change import Change

HEAD = (
    "<config><iceinterface><nameinterface>head</nameinterface><nameproxy>Head</nameproxy>"
    "<interface>PoseHead</interface></iceinterface></config>"
)
ADD_STATE = {"command": "addState", "automaton": 1, "x": 200, "y": 300, "name": "stop"}


@pytest.fixture(scope="module", autouse=True)
def checks() -> Iterator[None]:
    """The process in which all editors of this file check their documents."""
    with shared_checks():
        yield


@pytest.fixture
def root(tmp_path: Path) -> Path:
    root = tmp_path / "root"
    root.mkdir()
    (root / "robot.xml").write_text(DOCUMENT)
    return root


@pytest.fixture
def running(root: Path) -> Iterator[Editor]:
    with editor(root) as running:
        yield running


@pytest.fixture
def window(running: Editor) -> Iterator[Window]:
    with running.window() as window:
        window.ask("open", path="robot.xml")
        yield window


def names(window: Window, tab: int = 1) -> list[str]:
    return [state["name"] for state in window.documents[tab]["automata"][0]["states"]]


# ------------------------------------------------------------------------------------------ editing


def test_the_outcome_is_there_when_the_answer_comes(window: Window) -> None:
    window.ask("do", tab=1, command=ADD_STATE)
    assert names(window) == ["wait", "go", "stop"]
    window.ask("undo", tab=1)
    assert names(window) == ["wait", "go"]
    window.ask("redo", tab=1)
    assert names(window) == ["wait", "go", "stop"]


@pytest.mark.parametrize(("within", "steps"), [(FOREVER, 1), (-1.0, 3)])
def test_like_changes_are_one_step_as_long_as_the_limits_say(root: Path, within: float, steps: int) -> None:
    with editor(root, merge_within=within) as running, running.window() as window:
        window.ask("open", path="robot.xml")
        for code in ("a", "ab", "abc"):
            command = {
                "command": "setText",
                "place": {"kind": "state", "automaton": 1, "id": 1, "part": "code"},
                "text": code,
            }
            window.ask("do", tab=1, command=command)
        for _ in range(steps):
            window.ask("undo", tab=1)
        with pytest.raises(Refused, match="nothing to undo"):
            window.ask("undo", tab=1)


def test_windows_see_each_others_changes(running: Editor, window: Window) -> None:
    with running.window() as other:
        assert names(other) == ["wait", "go"]
        window.ask("do", tab=1, command=ADD_STATE)
        other.wait_for_push("document", revision=1)
        assert names(other) == ["wait", "go", "stop"]
        other.ask("undo", tab=1)
        window.wait_for_push("document", revision=2)
        assert names(window) == ["wait", "go"]


def test_what_one_window_types_is_no_step_of_another(root: Path) -> None:
    with editor(root, merge_within=FOREVER) as running, running.window() as window, running.window() as other:
        window.ask("open", path="robot.xml")
        for who, text in ((window, "a"), (window, "ab"), (other, "abc"), (other, "abcd"), (window, "abcde")):
            command = {
                "command": "setText",
                "place": {"kind": "state", "automaton": 1, "id": 1, "part": "code"},
                "text": text,
            }
            who.ask("do", tab=1, command=command)
        for left in ("abcd", "ab"):
            window.ask("undo", tab=1)
            assert window.documents[1]["automata"][0]["states"][0]["code"] == left


def test_windows_share_tabs_and_clipboard(running: Editor, window: Window) -> None:
    with running.window() as other:
        with pytest.raises(Refused, match=r"no states were copied here: Ctrl\+V pastes"):
            window.ask("paste", tab=1, automaton=1)
        window.ask("copy", tab=1, automaton=1, states=[1, 2])
        tab = other.ask("new")["tab"]
        other.ask("paste", tab=tab, automaton=1)
        window.wait_for_push("document", tab=tab, revision=1)
        assert names(window, tab) == ["wait", "go"]
        other.ask("close", tab=tab, discard=True)
        window.wait_for_push("closed", tab=tab)
        window.ask("listFiles")
        assert [open_tab["tab"] for open_tab in window.workspace["tabs"]] == [1]


def test_each_window_pastes_what_it_has_copied_and_duplicates_beside_that(
    running: Editor, window: Window
) -> None:
    def last(of: Window) -> str:
        return names(of, 1)[-1]

    with running.window() as other:
        window.ask("copy", tab=1, automaton=1, states=[1])
        other.ask("copy", tab=1, automaton=1, states=[2])
        window.ask("paste", tab=1, automaton=1)
        assert last(window).startswith("wait")
        done = window.ask("duplicate", tab=1, automaton=1, states=[2])
        assert done["added"][0]["states"] == [4]
        assert last(window).startswith("go")
        window.ask("paste", tab=1, automaton=1)
        assert last(window).startswith("wait")


def test_a_recording_among_the_files_is_shown_by_the_first_window(root: Path) -> None:
    file = root.with_name("run.mcap")
    file.touch()
    with (
        editor(root, root / "robot.xml", file) as running,
        running.window() as first,
        running.window() as second,
    ):
        assert (first.hello["recording"], second.hello["recording"]) == (str(file), "")
        assert [tab["path"] for tab in first.workspace["tabs"]] == ["robot.xml"]


def test_a_window_that_says_hello_again_gets_everything_again(window: Window) -> None:
    window.ask("do", tab=1, command=ADD_STATE)
    window.documents.clear()
    window.ask("hello")
    assert names(window) == ["wait", "go", "stop"]


def test_problems_follow_with_the_revision_that_was_checked(window: Window) -> None:
    window.ask("do", tab=1, command={"command": "deleteItems", "automaton": 1, "states": [1]})
    found = window.wait_for_push("problems", revision=1)
    assert {item["severity"] for item in found["items"]}


def test_changes_are_done_in_the_order_in_which_they_are_sent(window: Window) -> None:
    numbers = [window.send("do", tab=1, command={**ADD_STATE, "name": f"s{index}"}) for index in range(50)]
    for number in numbers:
        window.answer(number)
    assert names(window) == ["wait", "go", *(f"s{index}" for index in range(50))]


# ------------------------------------------------------------------------------------------ files


def test_unsaved_changes_are_not_closed_without_asking(window: Window) -> None:
    window.ask("close", tab=window.ask("new")["tab"])  # nothing to lose
    window.ask("do", tab=1, command=ADD_STATE)
    with pytest.raises(Refused) as refused:
        window.ask("close", tab=1)
    assert refused.value.kind == "unsaved"
    assert 1 in window.documents
    window.ask("close", tab=1, discard=True)
    assert 1 not in window.documents


def test_what_is_saved_can_be_closed_and_opened_again(root: Path, window: Window) -> None:
    window.ask("do", tab=1, command=ADD_STATE)
    assert window.workspace["tabs"][0]["dirty"]
    window.ask("save", tab=1)
    assert not window.workspace["tabs"][0]["dirty"]
    window.ask("close", tab=1)
    assert "stop" in (root / "robot.xml").read_text()
    tab = window.ask("open", path="robot.xml")["tab"]
    assert names(window, tab) == ["wait", "go", "stop"]


def test_what_is_no_document_is_refused(root: Path, window: Window) -> None:
    (root / "broken.xml").write_text("<VisualHFSM>")
    (root / "laughs.xml").write_text('<!DOCTYPE a [<!ENTITY b "c">]><VisualHFSM>&b;</VisualHFSM>')
    for name, kind in [("broken.xml", "refused"), ("laughs.xml", "refused"), ("missing.xml", "missing")]:
        with pytest.raises(Refused) as refused:
            window.ask("open", path=name)
        assert refused.value.kind == kind


def test_a_dropped_document_is_opened_without_a_file(window: Window) -> None:
    tab = window.ask("openText", name="dropped.xml", text=DOCUMENT)["tab"]
    assert names(window, tab) == ["wait", "go"]
    assert [each["title"] for each in window.workspace["tabs"]] == ["robot", "dropped"]
    with pytest.raises(Refused) as refused:
        window.ask("save", tab=tab)
    assert refused.value.kind == "refused"
    window.ask("saveAs", tab=tab, path="dropped.xml")
    assert window.workspace["tabs"][1]["path"] == "dropped.xml"


SCXML = """<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" initial="wait">
<state id="wait"><transition event="call" target="go"/></state><final id="go"/><datamodel/></scxml>"""


def test_what_cannot_be_looked_at_is_not_listed(root: Path, window: Window) -> None:
    (root / "nowhere.xml").symlink_to(root / "gone.xml")
    (root / "closed").mkdir(mode=0)
    assert {"robot.xml", "closed"} == {each["name"] for each in window.ask("listFiles")["entries"]}
    if os.geteuid() != 0:  # who may read everything
        with pytest.raises(Refused, match="cannot be listed"):
            window.ask("listFiles", directory="closed")


@OLD_DOCUMENTS
def test_scxml_becomes_a_new_document(root: Path, window: Window) -> None:
    (root / "chart.scxml").write_text(SCXML)
    (root / "other.xml").write_text(SCXML)
    listed = window.ask("listFiles")["entries"]
    assert {"chart.scxml": "document"}.items() <= {each["name"]: each["kind"] for each in listed}.items()
    for opened in [
        window.ask("open", path="chart.scxml"),
        window.ask("open", path="other.xml"),
        window.ask("openText", name="dropped.scxml", text=SCXML),
    ]:
        assert names(window, opened["tab"]) == ["wait", "go"]
        assert isinstance(opened["remarks"], list)
    assert [each["path"] for each in window.workspace["tabs"][1:]] == ["", "", ""]
    with pytest.raises(Refused):
        window.ask("saveAs", tab=2, path="chart.scxml")
    (root / "chart.scxml").write_text("<VisualHFSM/>")
    with pytest.raises(Refused, match="is not the root of SCXML"):
        window.ask("open", path="chart.scxml")


def test_the_folder_of_a_new_file_is_made(root: Path, window: Window) -> None:
    assert window.ask("saveAs", tab=1, path="new/inner/robot.xml") == {"path": "new/inner/robot.xml"}
    assert (root / "new" / "inner" / "robot.xml").is_file()
    (root / "taken").touch()
    with pytest.raises(Refused, match="Cannot create the folder taken"):
        window.ask("saveAs", tab=1, path="taken/robot.xml")


def test_a_comparison_has_the_lines_that_differ(window: Window) -> None:
    text = "a\nb\nc\nd\ne"
    for code in (text, text.replace("d", "D")):
        command = {
            "command": "setText",
            "place": {"kind": "state", "automaton": 1, "id": 1, "part": "code"},
            "text": code,
        }
        window.ask("do", tab=1, command=command)
        if code is text:
            window.ask("save", tab=1)
    (difference,) = window.ask("diff", tab=1, against="saved")["differences"]
    assert difference["lines"] == [" c", "-d", "+D", " e"]
    window.ask("do", tab=1, command={**command, "text": "pass"})
    window.ask("save", tab=1)
    window.ask("do", tab=1, command={**command, "text": "go"})
    (difference,) = window.ask("diff", tab=1, against="saved")["differences"]
    assert "lines" not in difference


def test_the_person_is_asked_when_both_have_changed(root: Path, window: Window) -> None:
    window.ask("do", tab=1, command=ADD_STATE)
    (root / "robot.xml").write_text(DOCUMENT.replace("go", "away"))
    window.wait_for_push("outside", state="changed")
    with pytest.raises(Refused) as refused:
        window.ask("save", tab=1)
    assert refused.value.kind == "outside"
    assert window.ask("resolve", tab=1, choice="merge")["conflicts"] == []
    assert names(window) == ["wait", "away", "stop"]
    assert window.workspace["tabs"][0]["outside"] == ""
    window.ask("save", tab=1)


def test_changes_that_are_given_up_are_gone(root: Path) -> None:
    with editor(root) as running, running.window() as window:
        window.ask("do", tab=window.ask("new")["tab"], command=ADD_STATE)
    with editor(root) as running, running.window() as window:
        (found,) = window.workspace["recoverable"]
        window.ask("discard", journal=found["journal"])
        assert window.workspace["recoverable"] == []
        for journal in (found["journal"], "../robot.xml"):
            with pytest.raises(Refused) as refused:
                window.ask("recover", journal=journal)
            assert refused.value.kind == "missing"


def test_files_of_the_command_line_are_opened_wherever_they_are(root: Path, tmp_path: Path) -> None:
    elsewhere = tmp_path / "elsewhere.xml"
    elsewhere.write_text(DOCUMENT)
    with editor(root, elsewhere) as running, running.window() as window:
        assert window.workspace["tabs"][0]["path"] == str(elsewhere)
        window.ask("do", tab=1, command=ADD_STATE)
        window.ask("save", tab=1)
    assert "stop" in elsewhere.read_text()


def test_a_file_of_the_command_line_that_is_no_document_ends_the_command(root: Path) -> None:
    (root / "broken.xml").write_text("<VisualHFSM>")
    with pytest.raises(VisualHfsmError, match=r"broken\.xml"), editor(root, root / "broken.xml"):
        pass


# ------------------------------------------------------------------------------------------ limits


def keep_connecting(port: int, made: list[socket.socket]) -> None:
    """Open connections until one fails, or there are very many."""
    with contextlib.suppress(ConnectionError):
        while len(made) < 500:
            made.append(socket.create_connection(("127.0.0.1", port), EVENT_LIMIT))
            time.sleep(0.0005)


def test_a_connection_that_is_made_while_the_editor_ends_is_closed(root: Path) -> None:
    # A browser would send its next request there, and wait for the answer even when another editor has the port.
    for _ in range(5):
        made: list[socket.socket] = []
        with editor(root) as running:
            client = threading.Thread(target=keep_connecting, args=[running.port, made])
            client.start()
            eventually(partial(bool, made), EVENT_LIMIT)
        client.join()
        for connection in made:
            connection.settimeout(EVENT_LIMIT)
            with connection, contextlib.suppress(ConnectionResetError):
                assert connection.recv(1) == b""


def test_a_window_that_reads_nothing_holds_up_nobody(running: Editor, window: Window) -> None:
    with running.deaf_window():
        text = "x" * 100_000
        for index in range(40):
            code = f"{text}{index}"
            window.ask(
                "do",
                tab=1,
                command={
                    "command": "setText",
                    "place": {"kind": "automaton", "automaton": 1, "part": "functions"},
                    "text": code,
                },
            )
        assert window.documents[1]["automata"][0]["functions"].endswith("39")


def test_a_window_that_closes_while_the_editor_ends_does_not_disturb_it(root: Path) -> None:
    with (
        contextlib.ExitStack() as open_longer,
        editor(root, root / "robot.xml") as running,
        running.window() as window,
    ):
        send = open_longer.enter_context(running.deaf_window())
        for index in range(40):  # what it does not read keeps its connection from closing
            code = f"{index}" * 100_000
            command = {
                "command": "setText",
                "place": {"kind": "automaton", "automaton": 1, "part": "functions"},
                "text": code,
            }
            window.ask("do", tab=1, command=command)
        send(b"\x88\x80" + bytes(4))  # close
        window.ask("hello")


def test_so_many_questions_at_a_time_and_no_more(root: Path) -> None:
    gate = threading.Event()

    class SlowHelp(NoCodeHelp):
        def interfaces(self, _folder: Path) -> object:
            return gate.wait(FOREVER)

    limits = Limits(concurrent_operations=2)
    with (
        editor(root, limits=limits, make_parts=lambda _: make_parts(SlowHelp())) as running,
        running.window() as window,
    ):
        waiting = [window.send("interfaces") for _ in range(2)]
        with pytest.raises(Refused) as refused:
            window.ask("interfaces")
        assert refused.value.kind == "busy"
        gate.set()
        assert [window.answer(number) for number in reversed(waiting)] == [True, True]


def test_nothing_that_is_under_way_keeps_a_run_or_a_stop_out(root: Path) -> None:
    gate = threading.Event()

    class SlowHelp(NoCodeHelp):
        def interfaces(self, _folder: Path) -> object:
            return gate.wait(FOREVER)

    class Steered(NoPart):
        async def steer(self, component: str, action: str, arguments: Mapping[str, Any]) -> object:
            if action == "explain":
                await asyncio.to_thread(gate.wait, FOREVER)
            return action

        async def emergency_stop(self) -> object:
            return "emergencyStop"

    limits = Limits(concurrent_operations=1)
    found = make_parts(SlowHelp(), followers=Steered())
    with (
        editor(root, limits=limits, make_parts=lambda _: found) as running,
        running.window() as window,
    ):
        helping = window.send("interfaces")
        assert window.ask("reload", component="") == "reload"
        explaining = window.send("explain", component="", automaton=1)
        with pytest.raises(Refused, match="under way"):
            window.ask("reload", component="")
        assert window.ask("emergencyStop") == "emergencyStop"
        gate.set()
        assert [window.answer(helping), window.answer(explaining)] == [True, "explain"]


def test_a_stop_does_not_even_wait_for_earlier_changes(root: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    gate = threading.Event()
    undo = OpenDocument.undo

    def slow(session: OpenDocument, *own: Any) -> Change:
        gate.wait(FOREVER)
        return undo(session, *own)

    class Steered(NoPart):
        async def steer(self, component: str, action: str, arguments: Mapping[str, Any]) -> object:
            return action

        async def emergency_stop(self) -> object:
            return "emergencyStop"

    monkeypatch.setattr(OpenDocument, "undo", slow)
    found = make_parts(followers=Steered())
    with editor(root, make_parts=lambda _: found) as running, running.window() as window:
        window.ask("open", path="robot.xml")
        window.ask("do", tab=1, command=ADD_STATE)
        undoing = window.send("undo", tab=1)
        steering = window.send("pause", component="")
        waiting = [window.send("hello") for _ in range(20)]
        assert window.ask("emergencyStop") == "emergencyStop"
        assert not window.answers
        gate.set()
        assert window.answer(undoing)["name"] == "Add a state"
        assert window.answer(steering) == "pause"
        assert all(window.answer(each) for each in waiting)


def test_requests_that_wait_do_not_fill_the_memory(root: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    began, gate = threading.Event(), threading.Event()
    undo = OpenDocument.undo

    def slow(session: OpenDocument, *own: Any) -> Change:
        began.set()
        gate.wait(FOREVER)
        return undo(session, *own)

    monkeypatch.setattr(OpenDocument, "undo", slow)
    with editor(root, limits=Limits(waiting_bytes=5000)) as running, running.window() as window:
        window.ask("open", path="robot.xml")
        window.ask("do", tab=1, command=ADD_STATE)
        undoing = window.send("undo", tab=1)
        assert began.wait(FOREVER)
        waiting = [window.send("hello") for _ in range(4)]
        with pytest.raises(Refused, match="waiting") as refused:
            window.ask("hello")
        assert refused.value.kind == "busy"
        gate.set()
        assert window.answer(undoing)["name"] == "Add a state"
        assert all(window.answer(each)["root"] for each in waiting)
        assert window.ask("hello")


def test_a_stop_that_is_repeated_goes_on_without_its_window_and_delays_no_end_of_a_process(
    root: Path,
) -> None:
    limits = Limits(component_end_seconds=0.1, operation_seconds=FOREVER)
    let_go, still, ended = threading.Event(), threading.Event(), threading.Event()

    class Repeated(NoPart):
        async def emergency_stop(self) -> object:
            await asyncio.to_thread(let_go.wait, FOREVER)
            still.set()
            return None

    class Running(NoPart):
        async def stop_all(self) -> None:
            ended.set()

    found = make_parts(followers=Repeated(), started=Running())
    with (
        editor(root, limits=limits, make_parts=lambda _: found) as running,
        contextlib.ExitStack() as steps,
    ):
        steps.callback(let_go.set)
        with running.window() as window:
            window.send("emergencyStop")
            assert ended.wait(EVENT_LIMIT)
        let_go.set()
        assert still.wait(EVENT_LIMIT)


# ------------------------------------------------------------------------------------------ imports


def test_the_content_of_imported_automata_is_reported(running: Editor, root: Path) -> None:
    stub = '<SubAutomata id="2" idFather="1"><import>robot.xml</import></SubAutomata>'
    owning = DOCUMENT.replace("<name>go</name>", "<name>go</name><idSubautomataSon>2</idSubautomataSon>")
    (root / "patrol.xml").write_text(owning.replace("</VisualHFSM>", f"{stub}</VisualHFSM>"))
    with running.window() as window:
        window.ask("open", path="patrol.xml")
        (content,) = window.ask("imported", tab=1)
        assert (content["id"], content["father"]) == (2, 1)
        assert content["imported"] == {"file": "robot.xml", "automaton": 0}
        assert [state["name"] for state in content["states"]] == ["wait", "go"]
        assert window.ask("locate", tab=1, text="patrol.py:9 (patrol.xml:8)") is None
        window.ask("inline", tab=1, automaton=2)
        assert [state["name"] for state in window.documents[1]["automata"][1]["states"]] == ["wait", "go"]
        with pytest.raises(Refused, match="is outside"):
            window.ask("extract", tab=1, automaton=2, path="../walk.xml")
        window.ask("extract", tab=1, automaton=2, path="walk.xml")
        assert window.documents[1]["automata"][1]["imported"]["file"] == "walk.xml"
        assert "<name>go</name>" in (root / "walk.xml").read_text()


# ------------------------------------------------------------------------------------------ parts


class FakeRunning(NoPart):
    """Says hello, and ends unless it is to stay."""

    def __init__(self, publish: Publish) -> None:
        self._publish = publish
        self.closed = False

    async def start(self, source: Source, arguments: Sequence[str], **_: object) -> str:
        self._publish(StartedPush(tab=source.tab, component="robot", status="starting"))
        lines = [OutputLine(text=f"line {index}") for index in range(3000)]
        self._publish(Output(tab=source.tab, lines=lines))
        if "stay" not in arguments:
            self._publish(StartedPush(tab=source.tab, component="robot", status="ended", exit_code=0))
        return " ".join(("robot", *arguments))

    async def generate(self, source: Source) -> Path:
        return Path("robot.py")

    async def close(self) -> None:
        self.closed = True


MOMENT = LiveSnapshot(1.0, snapshot(0.0))


class FakeLive(NoPart):
    """Knows one component."""

    def __init__(self, publish: Publish) -> None:
        self._publish = publish
        self.attached: list[str] = []
        self.closed = False
        self.recorded: Any = None
        publish(Present([{"component": "dance"}]))

    async def follow(self, component: str, *, awaited: bool = False) -> dict[str, Any]:
        if awaited:
            return {}
        if component != "dance":
            raise VisualHfsmError(Message("{component} does not run", component=component))
        self.attached.append(component)
        self._publish(Snapshot(component=component, value=MOMENT))
        return {}

    async def described(self, names: Sequence[str]) -> list[Message]:
        return [Message.verbatim(f"{name} ({name}.py)") for name in names]

    async def unfollow(self, component: str) -> None:
        self.attached.clear()

    async def record(self, component: str, path: Path, document: str, pictures: int) -> None:
        self.recorded = (component, path, document, pictures)

    async def end_record(self, component: str) -> None:
        self.recorded = (component,)

    async def recording(self, path: Path) -> object:
        self.attached.append(path.name)
        content = path.read_text() if path.exists() else ""
        return {"component": f"recording:{path.name}", "content": content, "document": content}

    async def steer(self, component: str, action: str, arguments: Mapping[str, Any]) -> object:
        if action == "resume":
            raise RuntimeError("a secret")
        if action == "reload":
            return {"generation": 1}
        await asyncio.sleep(60)
        return None

    async def camera(self, name: str) -> AsyncGenerator[bytes, None]:
        if name != "top":
            raise VisualHfsmError(Message("there is no camera {name}", name=name))
        for index in range(100):
            yield b"%d" % index

    async def close(self) -> None:
        self.closed = True
        raise RuntimeError("closing failed")


class FakeCodeHelp(NoCodeHelp):
    def ask(
        self,
        wanted: str,
        document: Document,
        path: Path | None,
        place: Place,
        code: str,
        *,
        line: int,
        column: int,
    ) -> object:
        return {"path": None if path is None else path.name, "place": place, "code": code}


@pytest.fixture
def parts() -> list[Parts]:
    return []


@contextlib.contextmanager
def serving(root: Path, parts: list[Parts], limits: Limits) -> Iterator[Editor]:
    def make(publish: Publish) -> Parts:
        parts.append(make_parts(FakeCodeHelp(), FakeRunning(publish), FakeLive(publish)))
        return parts[0]

    with editor(root, root / "robot.xml", limits=limits, make_parts=make) as running:
        yield running


@pytest.fixture
def served(root: Path, parts: list[Parts]) -> Iterator[Editor]:
    with serving(root, parts, Limits(operation_seconds=FOREVER, output_lines=2000)) as running:
        yield running


def test_a_run_reports_its_output_before_its_end(served: Editor) -> None:
    with served.window() as window:
        assert window.ask("start", tab=1, arguments=["--fast"]) == {"component": "robot --fast"}
        ended = window.wait_for_push("started", status="ended")
        assert ended["exitCode"] == 0
        output = [push for push in window.pushes if push["push"] == "output"]
        lines = [line["text"] for push in output for line in push["lines"]]
        assert lines == [f"line {index}" for index in range(1000, 3000)]
        assert sum(push["dropped"] for push in output) == 1000
    with served.window() as later:
        assert [push["status"] for push in later.pushes if push["push"] == "started"] == ["ended"]
        (stored,) = [push for push in later.pushes if push["push"] == "output"]
        assert (len(stored["lines"]), stored["whole"]) == (2000, True)


def test_a_component_whose_name_runs_elsewhere_is_not_started(root: Path) -> None:
    (root / "dance.xml").write_text(DOCUMENT)

    def make(publish: Publish) -> Parts:
        return make_parts(None, FakeRunning(publish), FakeLive(publish))

    limits = Limits(component_leaving_seconds=0.1)
    with (
        editor(root, root / "dance.xml", limits=limits, make_parts=make) as running,
        running.window() as window,
    ):
        with pytest.raises(Refused, match="dance runs already, and was not started here: stop it first"):
            window.ask("start", tab=1)
        window.ask("saveAs", tab=1, path="dance2.xml")
        assert window.ask("start", tab=1) == {"component": "robot"}


def test_a_run_beside_a_component_of_others_is_refused_until_the_user_accepts_it(
    root: Path, parts: list[Parts]
) -> None:
    (root / "robot.xml").write_text(DOCUMENT.replace("</VisualHFSM>", f"{HEAD}</VisualHFSM>"))
    (root / "thinks.xml").write_text(DOCUMENT)
    with serving(root, parts, Limits(operation_seconds=FOREVER)) as running, running.window() as window:
        for accepted in ([], ["robot", "walk"]):
            with pytest.raises(Refused, match=r"^dance \(dance\.py\) runs on this robot, and was") as refused:
                window.ask("start", tab=1, beside=accepted)
            assert refused.value.kind == "shared"
        assert not [push for push in window.pushes if push["push"] == "started"]
        assert window.ask("start", tab=1, dryRun=True) == {"component": "robot"}
        assert window.ask("start", tab=1, beside=["dance"]) == {"component": "robot"}
        thinks = window.ask("open", path="thinks.xml")["tab"]
        assert window.ask("start", tab=thinks) == {"component": "robot"}


def test_a_document_is_changed_until_its_component_is_reloaded(served: Editor) -> None:
    with served.window() as window:

        def changed() -> bool:
            found: bool = window.workspace["tabs"][0]["changed"]
            return found

        def after(op: str, **fields: Any) -> bool:
            window.ask(op, **fields)
            window.ask("export", tab=1)  # what was pushed meanwhile has come
            return changed()

        assert not after("do", tab=1, command=ADD_STATE)  # nothing runs
        assert not after("start", tab=1, arguments=["stay"])
        assert not after(
            "do", tab=1, command={"command": "moveItems", "automaton": 1, "states": [1], "dx": 9, "dy": 9}
        )
        assert after("do", tab=1, command={**ADD_STATE, "name": "more"})
        assert not after("undo", tab=1)
        assert after("redo", tab=1)
        assert after("generate", tab=1)
        assert not after("reload", component="robot")


def test_only_who_follows_a_component_hears_of_it(root: Path, parts: list[Parts]) -> None:
    limits = Limits(operation_seconds=FOREVER, return_seconds=0.1)
    with serving(root, parts, limits) as served:
        live = parts[0].followers
        assert isinstance(live, FakeLive)
        with served.window() as window, served.window() as other:
            assert window.workspace["present"] == [{"component": "dance"}]
            window.ask("follow", component="dance")
            window.wait_for_push(
                "snapshot", component="dance", value=msgspec.json.decode(msgspec.json.encode(MOMENT))
            )
            other.ask("listFiles")
            assert not [push for push in other.pushes if push["push"] == "snapshot"]
            other.ask("follow", component="dance")
            window.ask("unfollow", component="dance")
            assert live.attached
            other.ask("unfollow", component="dance")
            assert not live.attached
            window.ask("follow", component="dance")
            assert live.attached
            with pytest.raises(Refused, match="does not run"):
                window.ask("follow", component="chess")
        with served.window() as later:
            later.ask("listFiles")
            eventually(lambda: not live.attached)  # the window is gone


def test_a_run_is_recorded_into_a_new_file_below_the_root(served: Editor, root: Path) -> None:
    with served.window() as window:
        answer = window.ask("start", tab=1, arguments=["--fast"], record=True)
        name = answer["recording"]
        assert re.fullmatch(r"recordings/robot-\d{8}-\d{6}\.mcap", name)
        assert answer["component"] == f"robot --fast --record {root / name} --record-images"
        assert (root / "recordings").is_dir()
        (root / "recordings").rmdir()
        (root / "recordings").symlink_to("/")
        with pytest.raises(Refused) as refused:
            window.ask("start", tab=1, record=True)
        assert refused.value.kind == "forbidden"


def test_a_followed_component_is_recorded_below_the_root_with_what_it_runs(
    served: Editor, root: Path, parts: list[Parts]
) -> None:
    live = parts[0].followers
    assert isinstance(live, FakeLive)
    with served.window() as window:
        name = window.ask("record", component="robot", pictures=5)["recording"]
        assert re.fullmatch(r"recordings/robot-\d{8}-\d{6}\.mcap", name)
        component, path, document, pictures = live.recorded
        assert (component, path, pictures) == ("robot", root / name, 5)
        assert parse_file(document.encode(), Path("robot.xml")) == parse_file(
            DOCUMENT.encode(), Path("robot.xml")
        )
        window.ask("record", component="robot", pictures=None)
        assert live.recorded == ("robot",)
        window.ask("record", component="elsewhere", pictures=0)
        assert live.recorded[2] == ""
        for wrong in ({"pictures": 31}, {"pictures": -1}, {"pictures": 5, "path": "/tmp/run.mcap"}):
            with pytest.raises(Refused) as refused:
                window.ask("record", component="robot", **wrong)
            assert refused.value.kind == "malformed"
        (root / "recordings").rmdir()
        (root / "recordings").symlink_to("/")
        with pytest.raises(Refused) as refused:
            window.ask("record", component="robot", pictures=0)
        assert refused.value.kind == "forbidden"


def test_a_recording_is_let_go_of_by_the_window_that_opened_it(served: Editor, parts: list[Parts]) -> None:
    live = parts[0].followers
    assert isinstance(live, FakeLive)
    with served.window() as window, served.window() as other:
        opened = window.ask("recording", path="run.mcap")
        other.ask("unfollow", component=opened["component"])
        assert live.attached == ["run.mcap"]
        window.ask("unfollow", component=opened["component"])
        assert not live.attached


def test_a_recording_opens_the_document_that_it_contains_to_be_read(served: Editor, root: Path) -> None:
    (root / "run.mcap").write_text(DOCUMENT)
    (root / "none.mcap").write_text("no document")
    with served.window() as window:
        tab = window.ask("recording", path="run.mcap")["tab"]
        assert tab != 1
        (shown,) = (each for each in window.workspace["tabs"] if each["tab"] == tab)
        assert (shown["title"], shown["recording"], shown["dirty"]) == ("run.mcap", "run.mcap", False)
        assert window.ask("recording", path="run.mcap")["tab"] == tab
        assert window.ask("recording", path="none.mcap")["tab"] == 0

        rest = {"automaton": 1, "states": [2]}
        changes: dict[str, dict[str, Any]] = {
            "do": {"command": ADD_STATE}, "undo": {}, "goTo": {"revision": 1}, "cut": rest, "paste": {"automaton": 1},
            "duplicate": rest,
            "extract": {"automaton": 1, "path": "part.xml"}, "inline": {"automaton": 1},
        }  # fmt: skip
        for op, fields in changes.items():
            with pytest.raises(Refused, match=r"run\.mcap cannot be changed: .*; make a copy with `Save as`"):
                window.ask(op, tab=tab, **fields)
        window.ask("copy", tab=tab, **rest)
        with pytest.raises(Refused, match="no file yet"):
            window.ask("save", tab=tab)


def test_a_copy_of_the_document_of_a_recording_can_be_changed(served: Editor, root: Path) -> None:
    (root / "run.mcap").write_text(DOCUMENT)
    with served.window() as window:
        tab = window.ask("recording", path="run.mcap")["tab"]
        with pytest.raises(Refused) as refused:
            window.ask("saveAs", tab=tab, path="robot.xml")
        assert refused.value.kind == "exists"
        copy = window.ask("saveAs", tab=tab, path="copy.xml")
        assert copy["path"] == "copy.xml"
        assert copy["tab"] not in {1, tab}
        window.ask("do", tab=copy["tab"], command=ADD_STATE)
        differences = window.ask("diff", tab=tab, against="copy.xml")["differences"]
        assert [(each["kind"], each["place"]["kind"]) for each in differences] == [("removed", "state")]
        assert window.ask("close", tab=tab) is None


def test_what_takes_too_long_is_answered(root: Path, parts: list[Parts]) -> None:
    limits = Limits(operation_seconds=0.01)  # a greeting might take longer on a busy machine: there is none
    with serving(root, parts, limits) as running, running.socket() as socket:
        with pytest.raises(Refused) as refused:
            Window(socket).ask("pause", component="dance")
        assert refused.value.kind == "timeout"


def test_what_takes_long_holds_up_nobody_and_what_fails_is_answered(served: Editor) -> None:
    with served.window() as window:
        slow = window.send("pause", component="dance")
        assert window.ask("listFiles")
        assert slow not in window.answers
        with pytest.raises(Refused) as refused:
            window.ask("resume", component="dance")
        assert refused.value.kind == "internal"
        assert "secret" not in str(refused.value)


def test_code_help_gets_the_document_as_it_is(served: Editor) -> None:
    place = {"kind": "state", "automaton": 1, "id": 2, "part": "code"}
    with served.window() as window:
        found = window.ask("codeHelp", wanted="complete", tab=1, place=place, code="self.", line=1, column=5)
    assert found == {"path": "robot.xml", "place": place, "code": "self."}


def test_a_picture_is_sent_when_the_last_one_was_drawn(served: Editor) -> None:
    with served.socket("/camera/top") as socket:
        assert socket.recv(EVENT_LIMIT) == b"0"
        with pytest.raises(TimeoutError):
            socket.recv(0.1)
        for index in range(1, 5):
            socket.send("drawn")
            assert socket.recv(EVENT_LIMIT) == b"%d" % index


def test_a_camera_that_is_not_there_is_reported(served: Editor) -> None:
    with served.socket("/camera/side") as socket:
        with pytest.raises(ConnectionClosed):
            socket.recv(EVENT_LIMIT)
        assert socket.close_code == 4404
        assert socket.close_reason == "there is no camera side"


def test_messages_are_what_a_page_can_read(window: Window) -> None:
    window.ask("do", tab=1, command={**ADD_STATE, "name": "“☃”\u2028</script>"})
    assert names(window)[-1] == "“☃”\u2028</script>"
    json.dumps(window.documents)
