"""The read-only address: its viewers see every change, and can change nothing, whatever they send."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus

from tests.support.editor import DOCUMENT, Editor, Refused, Window, editor, shared_checks
from tests.support.plugins import needs
from visualhfsm._editor.limits import Limits

ATTACKS: Final[list[dict[str, Any]]] = [
    {"op": "do", "tab": 1, "command": {"command": "renameState", "automaton": 1, "state": 1, "name": "x"}},
    {"op": "do", "tab": 1, "command": {"command": "replaceDocument", "content": DOCUMENT}},
    {"op": "undo", "tab": 1},
    {"op": "copy", "tab": 1, "automaton": 1, "states": [1]},
    {"op": "paste", "tab": 1, "automaton": 1},
    {"op": "duplicate", "tab": 1, "automaton": 1, "states": [1]},
    {"op": "save", "tab": 1},
    {"op": "saveAs", "tab": 1, "path": "stolen.xml", "overwrite": True},
    {"op": "open", "path": "robot.xml"},
    {"op": "openText", "name": "a", "text": DOCUMENT},
    {"op": "close", "tab": 1, "discard": True},
    {"op": "listFiles", "directory": ""},
    {"op": "diff", "tab": 1, "against": "robot.xml"},
    {
        "op": "codeHelp",
        "wanted": "complete",
        "tab": 1,
        "place": {"kind": "document"},
        "code": "import os; os.",
    },
    {"op": "interfaces"},
    {"op": "generate", "tab": 1},
    {"op": "start", "tab": 1},
    {"op": "stop", "tab": 1},
    {"op": "simulate"},
    {"op": "guessRobot", "path": "robots/arm.urdf"},
    {"op": "saveRobot", "name": "stolen", "text": ""},
    {"op": "connectRobot", "address": "nao.local"},
    {"op": "endRobot"},
    {"op": "export", "tab": 1},
    {"op": "share"},
    {"op": "share", "shared": False},
    {"op": "resetEmergencyStop"},
    {"op": "pause", "component": "robot"},
]


@pytest.fixture(scope="module", autouse=True)
def checks() -> Iterator[None]:
    """The process in which all editors of this file check their documents."""
    with shared_checks():
        yield


@pytest.fixture
def root(tmp_path: Path) -> Path:
    (tmp_path / "robot.xml").write_text(DOCUMENT)
    return tmp_path


@contextlib.contextmanager
def looking_on(running: Editor, address: str) -> Iterator[Window]:
    """A window at the read-only address, which has said hello."""
    with running.socket("/view/ws", {"Cookie": viewer_cookie(running, address)}) as socket:
        window = Window(socket)
        window.hello = window.ask("hello")
        yield window


def viewer_cookie(running: Editor, address: str) -> str:
    status, headers, _ = running.get(f"/{address}")
    assert (status, headers["location"]) == (303, "./")
    cookie = headers["set-cookie"]
    assert {"httponly", "samesite=strict", "path=/view/"} <= {
        part.strip().lower() for part in cookie.split(";")
    }
    return cookie.partition(";")[0]


def test_a_viewer_sees_every_change(root: Path) -> None:
    with editor(root) as running, running.window() as window:
        tab = window.ask("open", path="robot.xml")["tab"]
        address = window.ask("share")["address"]
        with looking_on(running, address) as viewer, looking_on(running, address) as second:
            assert viewer.hello["viewer"]
            assert not viewer.hello["key"]  # it lets in the pages of the editor after a restart
            assert not window.hello["viewer"]
            rename = {"command": "renameState", "automaton": 1, "state": 1, "name": "stand"}
            window.ask("do", tab=tab, command=rename)
            for each in (viewer, second):
                while not (each.documents and name_in(each.documents[tab]) == "stand"):
                    each.wait_for(lambda message: message.get("push") == "document")


def name_in(document: dict[str, Any]) -> str:
    name: str = document["automata"][0]["states"][0]["name"]
    return name


@pytest.fixture(scope="module")
def shared(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Path, Window, Window]]:
    """The folder and a window of an editor with a document, and a viewer: one for all attacks."""
    root = tmp_path_factory.mktemp("shared")
    (root / "robot.xml").write_text(DOCUMENT)
    with editor(root) as running, running.window() as window:
        window.ask("open", path="robot.xml")
        with looking_on(running, window.ask("share")["address"]) as viewer:
            yield root, window, viewer


@pytest.mark.parametrize(
    "attack",
    [*ATTACKS, pytest.param({"op": "startTrials", "tab": 1}, marks=needs("visualhfsm_trials"))],
    ids=lambda attack: attack["op"],
)
def test_a_viewer_changes_nothing(shared: tuple[Path, Window, Window], attack: dict[str, Any]) -> None:
    root, window, viewer = shared
    before = window.documents[1]
    with pytest.raises(Refused) as refused:
        viewer.ask(**attack)
    assert refused.value.kind == "forbidden"
    window.ask("hello")
    assert window.workspace["tabs"]
    assert window.documents == {1: before}
    assert window.ask("share")["address"], "it is still shared"
    assert [path.name for path in root.iterdir()] == ["robot.xml"]
    assert (root / "robot.xml").read_text() == DOCUMENT


def test_a_viewer_may_stop_what_moves(root: Path) -> None:
    with (
        editor(root) as running,
        running.window() as window,
        looking_on(running, window.ask("share")["address"]) as viewer,
    ):
        with pytest.raises(Refused) as refused:  # this server has no robot: it was asked nevertheless
            viewer.ask("emergencyStop")
        assert refused.value.kind != "forbidden"


def test_the_cookie_of_a_viewer_is_none_of_the_editor(root: Path) -> None:
    with editor(root) as running, running.window() as window:
        cookie = viewer_cookie(running, window.ask("share")["address"])
        assert running.get("/view/", {"Cookie": cookie})[0] == 200
        assert running.get("/", {"Cookie": cookie})[0] == 403
        for path in ("/ws", "/poses", "/camera/top"):
            assert running.upgrade(path, headers(running, cookie)) == 403
        value = cookie.partition("=")[2]
        forged = f"visualhfsm-{running.port}={value}"  # under the name of the other cookie
        assert running.upgrade("/ws", headers(running, forged)) == 403
        assert (
            running.upgrade("/view/ws", {**headers(running, cookie), "Origin": "http://evil.example"}) == 403
        )


def headers(running: Editor, cookie: str) -> dict[str, str]:
    return {"Host": running.host, "Origin": f"http://{running.host}", "Cookie": cookie}


@pytest.mark.parametrize("path", ["/view/?token=wrong", "/?token=wrong", "/view/nothing?token=wrong"])
def test_a_viewer_gets_no_cookie_of_the_editor_by_a_wrong_token(root: Path, path: str) -> None:
    with editor(root) as running, running.window() as window:
        cookie = viewer_cookie(running, window.ask("share")["address"])
        status, answer, _ = running.get(path, {"Cookie": cookie})
        assert (status, "set-cookie" in answer) == (403, False)


def test_nobody_looks_on_before_it_is_shared(root: Path) -> None:
    with editor(root) as running:
        assert running.get("/view/")[0] == 403
        assert running.get("/view/?token=")[0] == 403
        assert running.upgrade("/view/ws", headers(running, f"visualhfsm-view-{running.port}=")) == 403


def test_a_token_of_the_editor_does_not_become_one_of_viewers(root: Path) -> None:
    with editor(root) as running, running.window() as window:
        address = window.ask("share")["address"]
        token = address.partition("token=")[2]
        assert running.get(f"/?token={token}")[0] == 403
        assert running.get("/", {"Cookie": running.cookie()})[0] == 200  # nobody was locked out by that


def test_viewers_go_when_the_address_is_withdrawn(root: Path) -> None:
    with editor(root) as running, running.window() as window:
        address = window.ask("share")["address"]
        cookie = viewer_cookie(running, address)
        with looking_on(running, address) as viewer:
            window.ask("share", shared=False)
            with pytest.raises(ConnectionClosed) as closed:
                viewer.wait_for(lambda _: False)
            assert closed.value.rcvd is not None
            assert closed.value.rcvd.code == 4410
        status, _, refusal = running.get("/view/", {"Cookie": cookie, "Accept": "text/html"})
        assert status == 403
        assert b"was withdrawn" in refusal
        assert b"terminal" not in refusal  # a viewer has none
        assert running.get(f"/{address}")[0] == 403
        assert window.ask("open", path="robot.xml")["tab"]  # the editor goes on


def test_a_viewer_who_asks_on_and_on_gets_one_line_of_the_log(
    root: Path, caplog: pytest.LogCaptureFixture
) -> None:
    with editor(root) as running:
        for _ in range(10):
            assert running.get("/view/")[0] == 403
            assert running.upgrade("/view/ws", headers(running, "")) == 403
    refused = [each for each in caplog.messages if each.startswith("refused")]
    assert refused == [
        "refused a request: Ask for another address: the one that you had for looking on was withdrawn."
    ]


def test_a_viewer_who_floods_waits_for_his_turn_and_nobody_else_does(root: Path) -> None:
    with (
        editor(root, limits=Limits(viewer_requests=0.001)) as running,
        running.window() as window,
        looking_on(running, window.ask("share")["address"]) as viewer,  # which was his only request for long
    ):
        flood = {viewer.send("outputShown") for _ in range(1000)}
        for _ in range(20):
            window.ask("listFiles")
        window.ask("open", path="robot.xml")
        viewer.wait_for_push("document")
        assert not flood & viewer.answers.keys()
        window.ask("share", shared=False)
        with pytest.raises(ConnectionClosed):
            viewer.wait_for_push("closed")


def test_a_viewer_may_ask_a_lot_after_a_pause(root: Path) -> None:
    with (
        editor(root, limits=Limits(viewer_requests=1e6)) as running,
        running.window() as window,
        looking_on(running, window.ask("share")["address"]) as viewer,
    ):
        for number in [viewer.send("outputShown") for _ in range(1000)]:
            viewer.answer(number)


def test_so_many_look_on_that_the_editor_has_room(root: Path) -> None:
    with editor(root, limits=Limits(viewers=1)) as running, running.window() as window:
        address = window.ask("share")["address"]
        with looking_on(running, address):
            with pytest.raises((ConnectionClosed, InvalidStatus)), looking_on(running, address):
                pass
            assert window.ask("open", path="robot.xml")["tab"]


def test_windows_beyond_the_limit_are_closed(root: Path) -> None:
    with editor(root, limits=Limits(connections=3)) as running, running.window() as first:
        headers = {"Cookie": running.cookie()}
        with running.socket(headers=headers), running.socket(headers=headers):
            # uvicorn refuses ordinary requests by now, but not those that become websockets.
            with pytest.raises((ConnectionClosed, InvalidStatus)), running.socket(headers=headers):
                pass
            assert first.ask("open", path="robot.xml")["tab"]
