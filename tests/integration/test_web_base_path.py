"""The editor below a path, at a port and at a Unix socket, as a reverse proxy reaches it."""

from __future__ import annotations

import http.client
import json
import os
import re
import socket
import stat
import subprocess
import sys
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from tempfile import TemporaryDirectory
from urllib.parse import urljoin

import psutil
import pytest
from typer.testing import CliRunner
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect, unix_connect
from websockets.typing import Origin

from tests.support.editor import DOCUMENT, Editor, Window, editor, shared_checks
from tests.support.limits import PAGE_LIMIT
from tests.support.ports import free_port
from tests.support.reverse_proxy import Mount, reverse_proxy
from visualhfsm._commands.app import app
from visualhfsm._editor.parts import make_parts
from visualhfsm._editor.server import Options, Server, SocketError
from zenoh_ice import Settings
from zenoh_ice.settings import load_settings

BASE = "/user/ana/visualhfsm/"


@pytest.fixture(scope="module")
def root(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = tmp_path_factory.mktemp("project") / "root"
    root.mkdir()
    (root / "robot.xml").write_text(DOCUMENT)
    return root


@pytest.fixture(scope="module")
def running(root: Path) -> Iterator[Editor]:
    with editor(root, base_path=BASE, port=free_port()) as running:
        yield running


@pytest.fixture(params=[False, True], ids=["path taken off", "path kept"])
def host(running: Editor, request: pytest.FixtureRequest) -> Iterator[str]:
    """The host of a reverse proxy in front of the editor."""
    with reverse_proxy({BASE: Mount(running.port, keeps_path=request.param)}) as host:
        yield host


def get(address: str, path: str, **headers: str) -> tuple[int, dict[str, str], bytes]:
    """Return what a proxy answers; `x_forwarded_host` stands for X-Forwarded-Host."""
    with closing(http.client.HTTPConnection(address, timeout=PAGE_LIMIT)) as connection:
        connection.request(
            "GET", path, headers={name.replace("_", "-"): text for name, text in headers.items()}
        )
        response = connection.getresponse()
        return response.status, {name.lower(): text for name, text in response.getheaders()}, response.read()


def query(running: Editor) -> str:
    """Return the part of a new address that holds its token."""
    return "?" + running.server.new_address().partition("?")[2]


def cookie_of(headers: dict[str, str]) -> str:
    return headers["set-cookie"].partition(";")[0]


# ---------------------------------------------------------------------------------------------- below a path


def test_the_address_has_the_path(running: Editor) -> None:
    assert running.server.new_address().startswith(f"http://{running.host}{BASE}?token=")


def test_an_address_leads_to_the_page_with_a_cookie_for_its_path_alone(running: Editor, host: str) -> None:
    asked = BASE + query(running)
    status, headers, _ = get(host, asked)
    assert status == 303
    assert urljoin(asked, headers["location"]) == BASE
    assert f"path={BASE};" in f"{headers['set-cookie'].lower()};"
    assert "secure" not in headers["set-cookie"].lower()
    assert get(host, BASE, cookie=cookie_of(headers))[0] == 200


def test_a_browser_that_comes_from_elsewhere_is_led_to_the_path(running: Editor, host: str) -> None:
    page = get(host, BASE + query(running), sec_fetch_site="cross-site")[2].decode()
    found = re.search(r'content="0;url=([^"]+)"', page)
    assert found
    assert urljoin(BASE, found[1]) == BASE


def test_a_token_below_the_page_leads_back_to_it(running: Editor, host: str) -> None:
    asked = f"{BASE}static/0/shell/app.js{query(running)}"
    assert urljoin(asked, get(host, asked)[1]["location"]) == BASE


def test_everything_that_the_page_names_is_below_its_path(running: Editor, host: str) -> None:
    cookie = cookie_of(get(host, BASE + query(running))[1])
    page = get(host, BASE, cookie=cookie)[2].decode()
    imports = json.loads(re.findall(r'<script type="importmap">(.*?)</script>', page)[0])["imports"]
    named = [*imports.values(), *re.findall(r'(?:href|src)="([^"]+)"', page)]
    assert len(named) > 50
    for each in named:
        address = urljoin(BASE, each)
        assert address.startswith(BASE), each
        is_prefix = each.endswith("/")  # of the modules of a folder
        assert is_prefix or get(host, address, cookie=cookie)[0] == 200, each
    assert get(host, BASE)[0] == 403


def test_the_files_of_the_page_name_nothing_at_the_top_of_the_host() -> None:
    static = Path("visualhfsm/_editor/static")
    texts = {
        path: path.read_text("utf-8") for path in static.rglob("*") if path.suffix in {".js", ".css", ".html"}
    }
    absolute = re.compile(r"""(?:fetch\(|WebSocket\(|import\(|from |src=|href=|url\()\s*["'`]?/(?![/*])""")
    assert len(texts) > 100
    assert not [
        str(path) for path, text in texts.items() if "vendor" not in path.parts and absolute.search(text)
    ]


def test_what_the_browser_keeps_is_kept_by_path() -> None:
    """Whatever the browser keeps for an origin, it keeps for all editors there."""
    by_origin = re.compile(
        r"\b(localStorage|sessionStorage|indexedDB|BroadcastChannel|SharedWorker|serviceWorker|caches|document\.cookie"
        r"|navigator\.locks)\b"
    )
    static = Path("visualhfsm/_editor/static")
    modules = [
        path for path in static.rglob("*.js") if "vendor" not in path.parts and path.name != "location.js"
    ]
    assert len(modules) > 80
    assert not [str(path) for path in modules if by_origin.search(path.read_text("utf-8"))]


def test_a_window_talks_through_the_proxy(running: Editor, host: str) -> None:
    cookie = cookie_of(get(host, BASE + query(running))[1])
    with connect(
        f"ws://{host}{BASE}ws",
        origin=Origin(f"http://{host}"),
        additional_headers={"Cookie": cookie},
        proxy=None,
    ) as connection:
        window = Window(connection)
        assert window.ask("hello")["root"]
        assert window.ask("listFiles")["entries"]


def test_pages_of_other_sites_are_refused_behind_the_proxy_too(running: Editor, host: str) -> None:
    cookie = cookie_of(get(host, BASE + query(running))[1])
    for origin in ("http://evil.example", f"http://{running.host}"):
        with pytest.raises(InvalidStatus, match="403"):
            connect(
                f"ws://{host}{BASE}ws",
                origin=Origin(origin),
                additional_headers={"Cookie": cookie},
                proxy=None,
            )


def test_pages_come_back_after_a_restart(running: Editor, host: str) -> None:
    offer = json.loads(get(host, f"{BASE}resume?nonce=ab")[2])
    assert offer["proof"]


def test_a_missing_slash_is_added_with_the_token(running: Editor) -> None:
    asked = BASE.rstrip("/") + query(running)
    status, headers, _ = running.get(asked)
    assert status == 307
    assert urljoin(asked, headers["location"]) == asked.replace("?", "/?")
    assert running.get(urljoin(asked, headers["location"]))[0] == 303


def test_other_paths_are_not_served(running: Editor) -> None:
    cookie = {"Cookie": running.cookie()}
    for path in (
        "/user/ben/visualhfsm/",
        "/user/ana/",
        f"{BASE}user/ana/visualhfsm/",
        "/user/ana/visualhfsmx",
    ):
        assert running.get(path, cookie)[0] == 404
    assert running.upgrade(
        "/user/ben/visualhfsm/ws", {"Host": running.host, "Origin": f"http://{running.host}", **cookie}
    ) in {403, 404}


# ---------------------------------------------------------------------------------------------- behind a proxy


def test_the_name_that_a_proxy_reports_counts_only_when_it_is_trusted(root: Path) -> None:
    for trusted, status in ((False, 403), (True, 303)):
        with (
            editor(root, base_path=BASE, trust_proxy=trusted, port=free_port()) as running,
            reverse_proxy({BASE: Mount(running.port, own_host=True)}) as host,
        ):
            origin = {"origin": f"http://{host}"}
            answer = get(host, BASE + query(running), **origin)
            assert answer[0] == status
            assert get(host, BASE + query(running), origin="http://evil.example")[0] == 403


def test_a_proxy_that_is_trusted_cannot_give_the_page_another_name(root: Path) -> None:
    with editor(root, trust_proxy=True, port=free_port()) as running:
        forged = {"X-Forwarded-Host": "evil.example", "Origin": "http://evil.example"}
        assert running.get("/", {"Cookie": running.cookie(), **forged})[0] == 403


@pytest.mark.parametrize("trusted", [False, True])
def test_the_cookie_is_secure_where_the_proxy_says_that_the_page_is(root: Path, trusted: bool) -> None:
    with editor(root, trust_proxy=trusted, port=free_port()) as running:
        path = f"/?token={running.server.credentials.new_token()}"
        cookie = running.get(path, {"X-Forwarded-Proto": "https"})[1]["set-cookie"]
        assert ("secure" in cookie.lower()) is trusted


# ---------------------------------------------------------------------------------------------- at a Unix socket


@pytest.fixture(scope="module", autouse=True)
def checks() -> Iterator[None]:
    """The process in which all editors of this file check their documents."""
    with shared_checks():
        yield


@pytest.fixture
def private() -> Iterator[Path]:
    """A folder of the user alone with a short name: the path of a socket has at most 107 bytes."""
    with TemporaryDirectory(prefix="s") as folder:
        yield Path(folder)


def test_a_proxy_of_the_same_user_needs_no_token_at_a_socket(root: Path, private: Path) -> None:
    path = private / "socket"
    before = listening_ports()
    with (
        editor(root, base_path=BASE, socket_path=path) as running,
        reverse_proxy({BASE: Mount(socket=path)}) as host,
    ):
        assert stat.S_IMODE(path.stat().st_mode) == 0o600
        assert get(host, BASE, host="hub.school.example")[0] == 200
        with unix_connect(
            str(path), uri="ws://hub.school.example/ws", origin=Origin("http://hub.school.example")
        ) as connection:
            greeting = Window(connection).ask("hello")
        assert greeting["key"] == ""  # there is nothing to come back with
        assert running.port == 0
        assert listening_ports() - before == {int(host.rpartition(":")[2])}
    assert not path.exists()


def listening_ports() -> set[int]:
    """Return the ports of this process and of all that it has started."""
    own = psutil.Process()
    return {
        each.laddr.port
        for process in (own, *own.children(recursive=True))
        for each in process.net_connections("inet")
        if each.status == psutil.CONN_LISTEN
    }


def test_other_sites_are_refused_at_a_socket_too(root: Path, private: Path) -> None:
    path = private / "socket"
    with editor(root, socket_path=path):
        for origin in ("http://evil.example", None):
            with pytest.raises(InvalidStatus, match="403"):
                unix_connect(str(path), uri="ws://hub.example/ws", origin=Origin(origin) if origin else None)


@pytest.mark.skipif(os.geteuid() != 0, reason="needs another user")
def test_another_user_cannot_connect_to_the_socket(root: Path) -> None:
    folder = Path("/tmp", f"visualhfsm-test-{os.getpid()}")  # its parents may be entered by everybody
    folder.mkdir(mode=0o700)
    path = folder / "socket"
    attempt = "import os, socket, sys; os.setuid(65534); socket.socket(socket.AF_UNIX).connect(sys.argv[1])"
    try:
        with editor(root, socket_path=path):
            for mode in (0o700, 0o755):  # nor if the folder were open
                folder.chmod(mode)
                done = subprocess.run(
                    [sys.executable, "-c", attempt, str(path)], capture_output=True, check=False
                )
                assert b"PermissionError" in done.stderr
    finally:
        folder.rmdir()


def options(root: Path, path: Path) -> Options:
    return Options(make_parts=make_parts(Settings()), root=root, socket=path)


def test_a_folder_that_others_may_enter_gets_no_socket(root: Path, private: Path) -> None:
    private.chmod(0o750)
    with pytest.raises(SocketError, match="others may enter its folder: chmod 700"):
        Server(options(root, private / "socket"))


@pytest.mark.parametrize("name", ["missing/socket", "x" * 200])
def test_a_socket_that_cannot_be_made_is_reported(root: Path, private: Path, name: str) -> None:
    with pytest.raises(SocketError, match="cannot listen at the socket"):
        Server(options(root, private / name))


def test_a_socket_in_use_and_other_files_are_left_alone(root: Path, private: Path) -> None:
    path = private / "socket"
    with closing(Server(options(root, path))), pytest.raises(SocketError, match="in use"):
        Server(options(root, path))
    path.write_text("mine")
    with pytest.raises(SocketError, match="in use"):
        Server(options(root, path))
    assert path.read_text() == "mine"


def test_the_socket_of_a_killed_editor_is_replaced(root: Path, private: Path) -> None:
    path = private / "socket"
    with closing(socket.socket(socket.AF_UNIX)) as left:
        left.bind(str(path))
    with editor(root, socket_path=path), reverse_proxy({"/": Mount(socket=path)}) as host:
        assert get(host, "/")[0] == 200


def test_an_editor_at_a_socket_meets_its_robot_at_sockets_alone(
    root: Path, private: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Ports of loopback are open to all users, and 7447 may be somebody else's robot."""
    for variable in [each for each in os.environ if each.startswith("VISUALHFSM_")]:
        monkeypatch.delenv(variable)
    meeting = private / "meeting"
    meeting.mkdir()
    make = make_parts(load_settings(), sockets=meeting)
    path = private / "socket"
    before = listening_ports()
    with (
        editor(root, socket_path=path, make_parts=make),
        unix_connect(str(path), uri="ws://hub.example/ws", origin=Origin("http://hub.example")) as connection,
    ):
        window = Window(connection)
        window.ask("hello")
        window.ask("simulate", world="empty")
        window.wait_for_push("robot", status="present")
        assert listening_ports() == before
        assert (
            len([each for each in meeting.iterdir() if each.is_socket()]) == 2
        )  # of the editor and the robot


# ---------------------------------------------------------------------------------------------- the command


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--base-path", "/a/../b/"], "browsers take . and .. out"),
        (["--base-path", "/static/"], "the page itself has /static"),
        (["--socket", "SOCKET", "--port", "8800"], "either --socket or --port"),
    ],
)
def test_what_cannot_be_served_is_refused(tmp_path: Path, arguments: list[str], said: str) -> None:
    arguments = [str(tmp_path / "socket") if each == "SOCKET" else each for each in arguments]
    result = CliRunner().invoke(app, ["edit", "--no-browser", *arguments])
    assert result.exit_code != 0
    assert said in re.sub(r"\s*│\s*", " ", result.output) + str(result.exception)
