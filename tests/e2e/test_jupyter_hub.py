"""The editor of each user of a JupyterHub, through the hub's proxy: two pupils on one computer.

All tests share one hub, which takes seconds to start, as do the servers of its users.
"""

from __future__ import annotations

import contextlib
import json
from collections.abc import Iterator
from pathlib import Path

import psutil
import pytest
from playwright.sync_api import Browser, Page, expect
from websockets.exceptions import ConnectionClosed, InvalidStatus

from tests.support.browser import new_window
from tests.support.editor import DOCUMENT, Refused, Window
from tests.support.jupyter_hub import SERVER_LIMIT, Hub, Login, jupyter_hub
from tests.support.limits import END_LIMIT, RUN_LIMIT, START_LIMIT
from tests.support.plugins import needs
from tests.support.processes import assert_gone
from tests.support.waiting import until

pytestmark = [pytest.mark.slow, pytest.mark.timeout(600)]

ADD_STATE = {"command": "addState", "automaton": 1, "name": "rest", "x": 200.0, "y": 300.0}


@pytest.fixture(scope="module")
def hub(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Hub]:
    with jupyter_hub(tmp_path_factory.mktemp("hub")) as hub:
        yield hub


@pytest.fixture(scope="module")
def ana(hub: Hub) -> Login:
    return pupil(hub, "ana@school.es")


@pytest.fixture(scope="module")
def ben(hub: Hub) -> Login:
    return pupil(hub, "ben muñoz")


def pupil(hub: Hub, name: str) -> Login:
    """Log in, with a document in the pupil's folder."""
    login = hub.login(name)
    (login.home / "walk.xml").write_text(DOCUMENT)
    (login.home / f"of_{name[:3]}.xml").write_text(DOCUMENT)
    return login


@contextlib.contextmanager
def window(login: Login) -> Iterator[Window]:
    """Open the page of a user's editor, which is started if it does not run, and its connection."""
    login.start()
    status, page = login.get(f"{login.path}visualhfsm/")
    assert status == 200, page
    with login.socket(f"{login.path}visualhfsm/ws") as connection:
        shown = Window(connection)
        shown.hello = shown.ask("hello")
        yield shown


def names(shown: Window) -> set[str]:
    return {each["name"] for each in shown.ask("listFiles")["entries"]}


def test_the_launcher_offers_the_editor_with_its_icon(ana: Login) -> None:
    ana.start()
    found = json.loads(ana.get(f"{ana.path}server-proxy/servers-info")[1])["server_processes"]
    (entry,) = (each["launcher_entry"] for each in found if each["name"] == "visualhfsm")
    assert entry["enabled"]
    assert entry["title"] == "VisualHFSM"
    status, icon = ana.get(entry["icon_url"])
    assert status == 200
    assert icon.startswith("<svg")


def test_a_user_who_logs_in_is_led_to_the_editor(ana: Login) -> None:
    status, page = ana.get("/hub/")
    assert status == 200
    assert "<title>VisualHFSM</title>" in page


def test_each_user_has_an_editor_in_their_own_folder(ana: Login, ben: Login) -> None:
    with window(ana) as first, window(ben) as second:
        assert first.hello["root"] == str(ana.home)
        assert second.hello["root"] == str(ben.home)
        assert "of_ana.xml" in names(first) - names(second)
        with pytest.raises(Refused) as refused:
            second.ask("open", path=str(ana.home / "walk.xml"))
        assert refused.value.kind == "forbidden"


@needs("visualhfsm_classes")
def test_a_pupil_hands_in_where_the_teacher_collects(ana: Login) -> None:
    with window(ana) as shown:
        tab = shown.ask("open", path="walk.xml")["tab"]
        assert shown.ask("handIn", tab=tab) == {"path": "walk.xml", "collected": False}
        (ana.home / "hand-in").mkdir()
        assert shown.ask("handIn", tab=tab) == {"path": "hand-in/walk.xml", "collected": True}
        assert "<name>wait</name>" in (ana.home / "hand-in/walk.xml").read_text()
        with pytest.raises(Refused) as refused:
            shown.ask("handIn", tab=tab)
        assert refused.value.kind == "exists"


def test_nobody_else_reaches_an_editor(hub: Hub, ana: Login, ben: Login) -> None:
    with window(ana):
        path = f"{ana.path}visualhfsm/"
        assert ben.get(path)[0] == 403
        assert "Sign in" in Login(hub).get(path)[1]
        for stranger in (ben, Login(hub)):
            with pytest.raises(InvalidStatus, match="HTTP 403"), stranger.socket(f"{path}ws"):
                pass


def test_a_page_of_another_site_gets_no_connection(ana: Login) -> None:
    with window(ana), pytest.raises((InvalidStatus, ConnectionClosed)):
        greet(ana, f"{ana.path}visualhfsm/ws", "http://evil.example")


def greet(login: Login, path: str, origin: str) -> None:
    with login.socket(path, origin) as connection:
        Window(connection).ask("hello")


@pytest.mark.sim
def test_robots_of_two_users_do_not_meet_listen_where_only_they_may_enter_and_end_with_a_killed_server(
    hub: Hub, ana: Login, ben: Login
) -> None:
    """They have the same names: nothing but the user says whose they are."""
    with window(ana) as first, window(ben) as second:
        tabs = [run_on_a_robot(shown) for shown in (first, second)]
        for login, shown in ((ana, first), (ben, second)):
            assert running(shown) == ["walk"]
            server, *others = hub.processes(login.name)
            assert len(ports([server])) == 1  # Jupyter's own, which lets in its user alone
            assert not ports(others)
            places = sockets(others)
            assert len(places) >= 4  # of the page, and at which editor, robot and behavior meet
            for place in places:
                assert place.is_absolute()  # no abstract name, which has no rights
                assert place.parent.stat().st_mode & 0o077 == 0
        second.ask("stop", tab=tabs[1])
        second.ask("endRobot")
        until(lambda: second.ask("listFiles") and not running(second), START_LIMIT)
        first.ask("listFiles")  # what was pushed before its answer has come
        assert running(first) == ["walk"]
        assert [push for push in first.pushes if push["push"] == "robot"][-1]["status"] == "present"
        # Of a server that is killed while a behavior runs on a robot, nothing is left.
        processes = hub.processes(ana.name)
        assert len(processes) >= 4  # Jupyter, the editor, the robot and the behavior
        processes[0].kill()
        assert_gone(processes)
    hub.wait(lambda: not hub.server(ana.name), END_LIMIT)


def run_on_a_robot(shown: Window) -> int:
    """Run a document on a simulated robot, and return its tab once the editor sees both."""
    tab: int = shown.ask("open", path="walk.xml")["tab"]
    shown.ask("simulate", world="empty")
    shown.wait_for_push("robot", status="present")
    shown.ask("start", tab=tab)
    shown.wait_for_push("started", tab=tab, status="started")
    until(lambda: shown.ask("listFiles") and running(shown), START_LIMIT)
    return tab


def running(shown: Window) -> list[str]:
    return [each["component"] for each in shown.workspace["present"]]


def ports(processes: list[psutil.Process]) -> set[int]:
    """Return the ports at which processes listen."""
    return {
        each.laddr.port
        for process in processes
        for each in process.net_connections("inet")
        if each.status == psutil.CONN_LISTEN
    }


def sockets(processes: list[psutil.Process]) -> set[Path]:
    """Return the Unix sockets in folders that processes have; those in /proc are deleted, and have no place."""
    files = set()
    for file in (each for process in processes for each in Path(f"/proc/{process.pid}/fd").iterdir()):
        with contextlib.suppress(FileNotFoundError):  # closed since it was listed
            files.add(str(file.readlink()))
    lines = (line.split(maxsplit=7) for line in Path("/proc/net/unix").read_text("utf-8").splitlines())
    return {  # psutil finds none whose path has spaces
        Path(words[7])
        for words in lines
        if len(words) == 8 and f"socket:[{words[6]}]" in files and not words[7].startswith("/proc/self/")
    }


@pytest.mark.soak("test_a_pupil_runs_a_behavior_and_keeps_what_was_not_saved")
def test_a_killed_editor_starts_again_and_offers_what_was_not_saved(hub: Hub, ben: Login) -> None:
    with window(ben) as shown:
        tab = shown.ask("open", path="of_ben.xml")["tab"]
        shown.ask("do", tab=tab, command=ADD_STATE)
        former = hub.editor(ben.name)
        below = former.children(recursive=True)
        former.kill()
        assert_gone([former, *below])
    hub.wait(lambda: editors(hub, ben) and ben.get(f"{ben.path}visualhfsm/")[0] == 200, START_LIMIT)
    with window(ben) as shown:
        assert [each["path"] for each in shown.workspace["recoverable"]] == ["of_ben.xml"]
        (kept,) = shown.workspace["recoverable"]
        assert shown.ask("recover", journal=kept["journal"])
        (document,) = shown.documents.values()
        assert [each["name"] for each in document["automata"][0]["states"]] == ["wait", "go", "rest"]


def editors(hub: Hub, login: Login) -> list[psutil.Process]:
    with contextlib.suppress(ValueError):
        return [hub.editor(login.name)]
    return []


@pytest.mark.sim
@pytest.mark.soak(
    "test_robots_of_two_users_do_not_meet_listen_where_only_they_may_enter_and_end_with_a_killed_server"
)
def test_no_process_is_left_of_a_server_that_is_stopped(hub: Hub, ana: Login) -> None:
    with window(ana) as shown:
        run_on_a_robot(shown)
        processes = hub.processes(ana.name)
        assert len(processes) >= 4  # Jupyter, the editor, the robot and the behavior
        hub.stop(ana.name)
        assert_gone(processes)


@pytest.fixture
def page(hub: Hub, ana: Login, browser: Browser) -> Iterator[Page]:
    """The window of a pupil who has logged in after the server was killed, as soon as it shows the editor."""
    for server in hub.processes(ana.name)[:1]:
        server.kill()
    hub.wait(lambda: not hub.server(ana.name), END_LIMIT)
    page = new_window(browser)
    page.goto(hub.address)
    page.get_by_label("Username").fill(ana.name)
    page.get_by_label("Password").fill("any")
    page.get_by_role("button", name="Sign in").click()
    page.wait_for_url(f"**/user/{ana.name}/visualhfsm/", timeout=SERVER_LIMIT * 1000)
    yield page
    page.context.close()


@pytest.mark.sim
def test_a_pupil_runs_a_behavior_and_keeps_what_was_not_saved(hub: Hub, ana: Login, page: Page) -> None:
    with window(ana) as shown:
        assert "walk.xml" in names(shown)
    page.get_by_role("button", name="Watch a robot dance").click()
    expect(page.locator(".live-status")).to_have_text("Running", timeout=RUN_LIMIT * 1000)
    expect(page.get_by_role("button", name="Simulated Nao H25")).to_be_visible()
    page.locator("hfsm-canvas .state").last.click()
    page.keyboard.press("Delete")
    expect(page.locator("hfsm-canvas .state")).to_have_count(3)

    killed = hub.editor(ana.name)
    below = killed.children(recursive=True)
    killed.kill()
    assert_gone([killed, *below])
    recover = page.get_by_role("button", name="Recover dance")
    recover.click(timeout=START_LIMIT * 1000)  # the page has come back by itself
    expect(page.locator("hfsm-canvas .state")).to_have_count(3)

    processes = hub.processes(ana.name)
    hub.stop(ana.name)
    assert_gone(processes)
    offline = page.get_by_role("alert").filter(has_text="No connection since")
    expect(offline).to_contain_text("load it again: you may have to log in, or to start your server")
    page.reload()
    expect(page.get_by_role("button", name="Launch Server")).to_be_visible()
