"""The editor's protection against every attack of docs/explanation/editor-safety.md, on real sockets."""

from __future__ import annotations

import contextlib
import hashlib
import hmac
import json
import logging
import os
import re
import shutil
from collections.abc import Iterator
from pathlib import Path

import psutil
import pytest
from websockets.exceptions import ConnectionClosed, ConnectionClosedError
from websockets.sync.client import ClientConnection

from tests.support.editor import DOCUMENT, Editor, NoPart, Refused, Window, editor, parts
from tests.support.limits import PAGE_LIMIT
from tests.support.ports import free_port
from visualhfsm._editor.limits import Limits


@pytest.fixture(scope="module")
def root(tmp_path_factory: pytest.TempPathFactory) -> Path:
    outside = tmp_path_factory.mktemp("outside")
    root = outside / "root"
    (root / "folder").mkdir(parents=True)
    (root / "robot.xml").write_text(DOCUMENT)
    (outside / "secret.xml").write_text(DOCUMENT)
    (root / "link.xml").symlink_to(outside / "secret.xml")
    (root / "away").symlink_to(outside)
    return root


@pytest.fixture(scope="module")
def running(root: Path) -> Iterator[Editor]:
    with editor(root) as running:
        yield running


@pytest.fixture
def own(root: Path) -> Iterator[Editor]:
    """A server whose threads and processes end with the test."""
    with editor(root) as running:
        yield running


# ------------------------------------------------------------------------------------------ who may come in


def test_the_printed_address_lets_in_and_leaves_no_token_behind(running: Editor) -> None:
    token = running.server.credentials.new_token()
    status, headers, _ = running.get(f"/?token={token}")
    assert (status, headers["location"]) == (303, "./")
    cookie = headers["set-cookie"]
    assert cookie.startswith(f"visualhfsm-{running.port}=")
    assert {"httponly", "samesite=strict"} <= {part.strip().lower() for part in cookie.split(";")}
    assert token not in cookie
    status, headers, page = running.get("/", {"Cookie": cookie.partition(";")[0]})
    assert status == 200
    assert b"<html" in page


def test_a_browser_that_comes_from_elsewhere_is_led_in_by_a_page(running: Editor) -> None:
    token = running.server.credentials.new_token()
    status, headers, page = running.get(f"/?token={token}", {"Sec-Fetch-Site": "cross-site"})
    assert status == 200
    assert b'content="0;url=./"' in page
    assert running.get("/", {"Cookie": headers["set-cookie"].partition(";")[0]})[0] == 200


def test_a_browser_may_open_its_address_again(running: Editor) -> None:
    path = f"/?token={running.server.credentials.new_token()}"
    cookie = running.get(path)[1]["set-cookie"].partition(";")[0]
    assert running.get(path, {"Cookie": f"a=b; {cookie}"})[0] == 303
    assert running.get("/", {"Cookie": cookie})[0] == 200


def code_at_end(socket: ClientConnection) -> int | None:
    """Return the code with which the server closes a websocket."""
    with contextlib.suppress(ConnectionClosed):
        while True:
            socket.recv(PAGE_LIMIT)
    return socket.close_code


def test_of_two_browsers_that_use_an_address_the_second_one_is_refused(root: Path) -> None:
    reported: list[tuple[str, str]] = []
    with editor(root, report=lambda *each: reported.append(each)) as running:
        running.server.offer("started")
        path = reported[0][1].partition(running.host)[2]
        cookie = running.get(path)[1]["set-cookie"].partition(";")[0]
        with running.socket(headers={"Cookie": cookie}) as first:
            window = Window(first)
            for _ in range(3):
                status, headers, content = running.get(path, {"Accept": "text/html"})
                assert (status, "set-cookie" in headers) == (403, False)
                assert b"each lets in one browser" in content
            assert window.ask("hello")["root"] == str(root)
        assert running.get(path, {"Cookie": cookie})[0] == 303
        assert [occasion for occasion, _ in reported] == ["started", "used"]
        assert running.get(reported[1][1].partition(running.host)[2])[0] == 303


def test_who_was_let_in_is_led_to_the_page_by_any_address(running: Editor) -> None:
    status, headers, _ = running.get("/?token=old", {"Cookie": running.cookie()})
    assert (status, headers["location"]) == (303, "./")


def test_a_connection_for_stop_alone_does_nothing_else(root: Path) -> None:
    stops: list[str] = []

    class Stopping(NoPart):
        async def emergency_stop(self) -> dict[str, object]:
            stops.append("followers")
            return {"stopped": ["walk"], "failed": {}}

        async def stop_all(self) -> None:
            stops.append("started")

    make_parts = lambda _: parts(started=Stopping(), followers=Stopping())  # noqa: E731
    with editor(root, make_parts=make_parts) as running:
        cookie = running.cookie()
        for path in ("/view/stop", "/stop/"):
            assert _upgrade(running, path, cookie=cookie) == 403, path
        assert running.get("/stop", {"Cookie": cookie})[0] == 404
        for wrong in ({"origin": "http://evil.example"}, {"origin": "http://127.0.0.1:1"}, {"cookie": ""}):
            assert _upgrade(running, "/stop", **{"cookie": cookie, **wrong}) == 403, wrong
        assert stops == []
        with running.socket("/stop", {"Cookie": cookie}) as stopping:
            answer = json.loads(stopping.recv(PAGE_LIMIT))
            assert answer["ok"] == {"stopped": ["walk"], "failed": {}}
            assert code_at_end(stopping) == 1000
        assert sorted(stops) == ["followers", "started"]


@pytest.mark.parametrize(
    "path",
    [
        "/",
        "/?token=",
        "/?token=wrong",
        "/static/0/vendor/lit.js",
        "/plugins/task/0/view.js",
        "/ws",
        "/nothing",
    ],
)
def test_nobody_gets_anything_without_the_token(running: Editor, path: str) -> None:
    status, headers, content = running.get(path)
    assert status == 403
    assert "set-cookie" not in headers
    assert b"terminal" in content


@pytest.mark.parametrize(
    "cookie", ["", "visualhfsm-PORT=", "visualhfsm-PORT=wrong", "visualhfsm-PORT=é", "a=b; c"]
)
def test_a_wrong_cookie_opens_no_websocket(running: Editor, cookie: str) -> None:
    assert _upgrade(running, cookie=cookie.replace("PORT", str(running.port))) == 403


@pytest.mark.parametrize(
    "other", ['prefs={"a": 1, "b": 2}', "a@b=1", "n=é", "c", "a b=c d", "visualhfsm-PORT=old"]
)
def test_cookies_of_other_servers_on_loopback_keep_nobody_out(running: Editor, other: str) -> None:
    cookies = f"{other.replace('PORT', str(running.port))}; {running.cookie()}; a=b"
    assert running.get("/", {"Cookie": cookies})[0] == 200
    assert _upgrade(running, cookie=cookies) == 101


def test_a_page_comes_in_again_after_a_restart_on_the_same_port(root: Path) -> None:
    port = free_port()
    with editor(root, port=port) as first, first.window() as window:
        key = bytes.fromhex(window.hello["key"])
        run = window.hello["instance"]

    def resume(running: Editor, proof: str) -> tuple[str, str]:
        """Return the status of an answer to a challenge, and the cookie of its answer."""
        offer = json.loads(running.get("/resume?nonce=ab")[2])
        assert offer["proof"] == signed(f"server:ab:{offer['challenge']}")
        answer = signed(f"page:{offer['challenge']}") if proof == "right" else proof
        status, headers, _ = running.get(f"/resume?challenge={offer['challenge']}&proof={answer}")
        return str(status), headers.get("set-cookie", "")

    def signed(text: str) -> str:
        return hmac.new(key, text.encode(), hashlib.sha256).hexdigest()

    with editor(root, port=port) as again:
        assert resume(again, "wrong") == ("403", "")
        status, cookie = resume(again, "right")
        assert status == "204"
        assert "samesite=strict" in cookie.lower()
        assert again.get("/", {"Cookie": cookie.partition(";")[0]})[0] == 200
        with again.window() as window:
            assert (window.hello["key"], window.hello["instance"] == run) == (key.hex(), False)
        for headers in ({"Origin": "http://evil.example"}, {"Host": "evil.example"}):
            assert again.get("/resume?nonce=ab", headers)[0] == 403


def test_a_port_that_the_system_picked_leaves_no_key_behind(tmp_path: Path) -> None:
    (tmp_path / "root").mkdir()
    with editor(tmp_path / "root", port=0) as running, running.window() as window:
        assert len(window.hello["key"]) == 64
    assert not (tmp_path / "keys").exists()


def test_who_is_refused_reads_what_to_do(running: Editor) -> None:
    status, headers, content = running.get("/?token=<b>old", {"Accept": "text/html"})
    assert (status, headers["content-type"]) == (403, "text/plain; charset=utf-8")
    assert headers["x-content-type-options"] == "nosniff"
    assert b"in its terminal" in content
    assert b"<b>" not in content


def test_a_page_that_does_not_exist_is_said_so_to_those_who_were_let_in(running: Editor) -> None:
    for path in ("/nothing", "/static/0/nothing.js"):
        status, _, content = running.get(path, {"Accept": "text/html", "Cookie": running.cookie()})
        assert (status, content) == (404, b"Not Found")


def test_a_query_that_is_none_is_refused(running: Editor) -> None:
    assert running.get("/?" + "&".join(100 * "a"))[0] == 403


def test_a_token_opens_no_websocket(running: Editor) -> None:
    token = running.server.credentials.new_token()
    assert _upgrade(running, path=f"/ws?token={token}", cookie="") == 403
    assert _upgrade(running, path=f"/ws?token={token}") == 403


@pytest.mark.parametrize("path", ["/ws", "/camera/top", "/poses"])
def test_the_page_opens_websockets(running: Editor, path: str) -> None:
    assert _upgrade(running, path=path) == 101


@pytest.mark.parametrize("path", ["/ws", "/camera/top", "/poses"])
@pytest.mark.parametrize(
    "origin",
    [
        "http://evil.example",
        "http://evil.example:PORT",
        "http://localhost:1",
        "http://127.0.0.1",
        "http://127.0.0.1:PORT.evil.example",
        "http://127.0.0.1:PORT@evil.example",
        "http://[",
        "null",
        "",
    ],
)
def test_another_site_opens_no_websocket(running: Editor, origin: str, path: str) -> None:
    assert _upgrade(running, path=path, origin=origin.replace("PORT", str(running.port))) == 403


def test_a_websocket_without_an_origin_is_refused(running: Editor) -> None:
    assert running.upgrade("/ws", {"Host": running.host, "Cookie": running.cookie()}) == 403


@pytest.mark.parametrize(
    "host",
    [
        "evil.example",
        "evil.example:PORT",
        "127.0.0.1.evil.example",
        "10.0.0.1:PORT",
        "[",
        "[::]:PORT",
        "0.0.0.0:PORT",
        "localhost.:PORT",
        "localhost@evil.example",
        "evil.example@localhost",
        "localhost/evil.example",
        "localhost; script-src *",
    ],
)
def test_a_name_that_was_rebound_to_loopback_is_refused(running: Editor, host: str) -> None:
    host = host.replace("PORT", str(running.port))
    assert running.get("/", {"Host": host, "Cookie": running.cookie()})[0] in {400, 403}
    assert _upgrade(running, host=host, origin=f"http://{host}") in {400, 403}


@pytest.mark.parametrize("host", ["localhost", "localhost:9000", "127.0.0.1:9000", "[::1]:9000", "LocalHost"])
def test_tunnels_to_loopback_get_in(running: Editor, host: str) -> None:
    assert running.get("/", {"Host": host, "Cookie": running.cookie()})[0] == 200


def test_a_name_that_is_allowed_gets_in(root: Path) -> None:
    with editor(root, hosts=("robots.example",)) as running:
        assert running.get("/", {"Host": "robots.example", "Cookie": running.cookie()})[0] == 200


def test_another_site_gets_no_page_and_cannot_post(running: Editor) -> None:
    cookie = {"Cookie": running.cookie()}
    assert running.get("/", {**cookie, "Origin": "http://evil.example"})[0] == 403
    assert running.get("/", cookie, method="POST")[0] == 405
    assert running.get(f"/?token={running.server.credentials.new_token()}", method="POST")[0] == 405


def test_it_listens_on_loopback_only(running: Editor) -> None:
    listening = [
        connection.laddr.ip
        for connection in psutil.Process().net_connections("tcp")
        if connection.status == psutil.CONN_LISTEN and connection.laddr.port == running.port
    ]
    assert listening == ["127.0.0.1"]


# ------------------------------------------------------------------------------------------ what a page may do


def test_the_page_runs_no_script_but_ours_and_stands_in_no_frame(running: Editor) -> None:
    _, headers, page = running.get("/", {"Cookie": running.cookie()})
    policy = dict(part.strip().split(" ", 1) for part in headers["content-security-policy"].split(";"))
    assert policy["default-src"] == "'none'"
    assert "unsafe" not in headers["content-security-policy"]
    assert re.fullmatch(r"'self' 'sha256-[\w+/=]+'", policy["script-src"])
    nonce = re.fullmatch(r"'self' 'nonce-([\w-]{20,})'", policy["style-src"])
    assert nonce
    assert nonce[1].encode() in page
    assert nonce[1] not in running.get("/", {"Cookie": running.cookie()})[1]["content-security-policy"]
    assert policy["frame-ancestors"] == "'none'"
    assert headers["x-content-type-options"] == "nosniff"
    assert headers["referrer-policy"] == "no-referrer"
    assert b"onload" not in page
    assert not re.search(rb"<script(?![^>]*(src=|importmap))", page)


def test_files_of_the_page_are_kept_by_the_browser_until_they_change(running: Editor) -> None:
    cookie = {"Cookie": running.cookie()}
    _, headers, page = running.get("/", cookie)
    assert headers["cache-control"] == "no-store"
    found = re.search(rb'"lit":"([^"]+)"', page)
    assert found
    status, headers, _ = running.get(
        found[1].decode().removeprefix("."), {**cookie, "Accept-Encoding": "gzip"}
    )
    assert (status, headers["content-encoding"]) == (200, "gzip")
    assert headers["content-type"].startswith("text/javascript")
    assert "immutable" in headers["cache-control"]
    assert running.get("/static/old/vendor/lit.js", cookie)[1]["cache-control"] == "no-cache"


@pytest.mark.parametrize(
    "path",
    ["../server.py", "..%2fserver.py", "%2e%2e/server.py", "/etc/passwd", "%2fetc%2fpasswd", "%00", "vendor"],
)
def test_the_pages_files_are_all_that_is_served(running: Editor, path: str) -> None:
    assert running.get(f"/static/0/{path}", {"Cookie": running.cookie()})[0] == 404


def test_the_token_is_in_no_log(root: Path, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.DEBUG)
    with editor(root) as running:  # one that has not refused the like before, which it would log once alone
        token = running.server.credentials.new_token()
        running.get(f"/?token={token}")
        running.get(f"/?token={token}", {"Host": "evil.example"})
        running.get(f"/?token=x{token}")
        with running.window():
            pass
        cookie = running.cookie()
    logged = "\n".join(
        record.getMessage() for record in caplog.records if not record.name.startswith("websockets.client")
    )
    assert "refused" in logged
    assert token not in logged
    assert cookie.partition("=")[2] not in logged


# ------------------------------------------------------------------------------------------ files


def outside(root: Path) -> list[str]:
    """Return paths that lead out of the root."""
    secret = root.parent / "secret.xml"
    return [
        "../secret.xml",
        "folder/../../secret.xml",
        str(secret),
        "link.xml",
        "away/secret.xml",
        "away/new.xml",
        "/etc/passwd",
        "~/secret.xml/../../../secret.xml",
        "a\0.xml",
        "x" * 3000 + ".xml",
    ]


def test_no_file_outside_of_the_root_is_opened(own: Editor, root: Path) -> None:
    with own.window() as window:
        for path in outside(root):
            with pytest.raises(Refused) as refused:
                window.ask("open", path=path)
            assert refused.value.kind == "forbidden", path


def test_no_file_outside_of_the_root_is_written(own: Editor, root: Path) -> None:
    before = (root.parent / "secret.xml").read_bytes()
    with own.window() as window:
        tab = window.ask("new", template="empty")["tab"]
        for path in [*outside(root), "robot.py", ".bashrc", "folder", ""]:
            with pytest.raises(Refused) as refused:
                window.ask("saveAs", tab=tab, path=path, overwrite=True)
            assert refused.value.kind == "forbidden", path
    assert (root.parent / "secret.xml").read_bytes() == before
    assert sorted(path.name for path in root.iterdir()) == ["away", "folder", "link.xml", "robot.xml"]


def test_no_directory_outside_of_the_root_is_listed(own: Editor) -> None:
    with own.window() as window:
        for directory in ["..", "away", "/", "folder/../..", "robot.xml", "nothing"]:
            with pytest.raises(Refused) as refused:
                window.ask("listFiles", directory=directory)
            assert refused.value.kind == "forbidden", directory


def test_links_that_lead_away_are_not_listed(own: Editor) -> None:
    with own.window() as window:
        listed = window.ask("listFiles")
    assert [entry["path"] for entry in listed["entries"]] == ["folder", "robot.xml"]


def test_no_file_outside_of_the_root_is_read_otherwise(own: Editor) -> None:
    with own.window() as window:
        tab = window.ask("open", path="robot.xml")["tab"]
        for op, fields in [
            ("diff", {"tab": tab, "against": "../secret.xml"}),
            ("recording", {"path": "../secret.mcap"}),
        ]:
            with pytest.raises(Refused) as refused:
                window.ask(op, **fields)
            assert refused.value.kind == "forbidden", op


def test_what_is_no_file_is_not_opened(own: Editor, root: Path) -> None:
    for name in ("pipe.xml", "pipe.mcap"):
        os.mkfifo(root / "folder" / name)
    (root / "folder" / "device.xml").symlink_to("/dev/zero")
    (root / "folder" / "directory.mcap").mkdir()
    with own.window() as window:
        for op, name in [
            ("open", "pipe.xml"),
            ("open", "device.xml"),
            ("recording", "pipe.mcap"),
            ("recording", "directory.mcap"),
            ("recording", "../robot.xml"),
        ]:
            with pytest.raises(Refused) as refused:
                window.ask(op, path=f"folder/{name}")
            assert refused.value.kind == "forbidden", name
    shutil.rmtree(root / "folder")
    (root / "folder").mkdir()


# ------------------------------------------------------------------------------------------ messages


NO_REQUESTS = [
    "",
    "{",
    "null",
    "[]",
    '{"id": 1}',
    '{"id": 1, "op": "shutdown"}',
    '{"id": -1, "op": "hello"}',
    '{"id": 1e99, "op": "hello"}',
    '{"id": 1, "op": "hello", "more": 1}',
    '{"id": 1, "op": "open", "path": 7}',
    '{"id": 1, "op": "open", "path": "' + 5000 * "x" + '"}',
    '{"id": 1, "op": "goTo", "tab": 1, "revision": -1}',
    '{"id": 1, "op": "setBreakpoints", "component": "c", "breakpoints": ' + 100_000 * "[",
    100_000 * '{"id":',
    '{"id": 1, "op": "hello"}\0',
]


def test_what_is_no_request_is_answered_and_changes_nothing(own: Editor) -> None:
    with own.window() as window:
        for message in NO_REQUESTS:
            window.socket.send(message)
            answer = window.wait_for(lambda found: "error" in found)
            assert answer["kind"] == "malformed", message[:100]
        assert window.ask("listFiles")["directory"] == ""


def test_a_command_that_is_none_is_malformed(own: Editor) -> None:
    with own.window() as window:
        tab = window.ask("open", path="robot.xml")["tab"]
        for command in (
            {"command": "import os"},
            100,
            {"command": "addState", "automaton": 1, "x": "1", "y": 1},
        ):
            with pytest.raises(Refused) as refused:
                window.ask("do", tab=tab, command=command)
            assert refused.value.kind == "malformed"


def test_a_huge_message_closes_the_connection_alone(own: Editor) -> None:
    # Its head alone: what the server leaves unread would reset the connection, and the close with its code be lost.
    head = bytes([0x81, 0x80 | 127]) + (5_000_000).to_bytes(8) + bytes(4)
    with own.window() as other:
        with contextlib.suppress(ConnectionClosedError), own.socket() as client:
            client.socket.sendall(head)
            client.recv(10)
        assert client.close_code == 1009
        assert other.ask("listFiles")


def test_a_binary_message_closes_the_connection(own: Editor) -> None:
    assert close_code(own, b"{}") == 1003


def close_code(running: Editor, message: str | bytes) -> int:
    """Return with which code the server closes a websocket after a message."""
    with contextlib.suppress(ConnectionClosedError), running.socket() as client:
        client.send(message)
        with contextlib.suppress(ConnectionClosedError):
            client.recv(10)
    assert client.close_code is not None
    return client.close_code


def test_so_many_documents_and_no_more(root: Path) -> None:
    with editor(root, limits=Limits(tabs=2)) as own, own.window() as window:
        window.ask("new")
        window.ask("new")
        with pytest.raises(Refused) as refused:
            window.ask("new")
        assert refused.value.kind == "busy"


def test_of_too_many_files_the_first_ones_are_opened_and_the_others_named(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    root = tmp_path / "root"
    root.mkdir()
    files = [root / f"{name}.xml" for name in "abcd"]
    for file in files:
        file.write_text(DOCUMENT)
    with editor(root, *files[:2], *files, limits=Limits(tabs=2)) as own, own.window() as window:
        assert [tab["title"] for tab in window.workspace["tabs"]] == ["a", "b"]
    why = "was not opened: at most 2 documents can be open: close one first"
    assert [f"c.xml {why}", f"d.xml {why}"] == [text for text in caplog.messages if "opened" in text]


def test_a_script_in_a_name_stays_text(root: Path) -> None:
    script = "<script>alert(1)</script>"
    with editor(root) as own, own.window() as window:
        tab = window.ask("open", path="robot.xml")["tab"]
        window.ask(
            "do", tab=tab, command={"command": "renameState", "automaton": 1, "state": 1, "name": script}
        )
        assert window.documents[tab]["automata"][0]["states"][0]["name"] == script
        _, _, page = own.get("/", {"Cookie": own.cookie()})
        assert script.encode() not in page


def _upgrade(
    running: Editor, path: str = "/ws", cookie: str | None = None, host: str = "", origin: str | None = None
) -> int:
    """Return how the server answers a handshake that is the page's own but for what is given."""
    return running.upgrade(
        path,
        {
            "Host": host or running.host,
            "Origin": f"http://{running.host}" if origin is None else origin,
            "Cookie": running.cookie() if cookie is None else cookie,
        },
    )
