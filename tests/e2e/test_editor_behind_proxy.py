"""The page below paths of one host, behind a reverse proxy that takes the path off or passes it on."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect

from tests.support.browser import EditorPage, new_window, saved
from tests.support.editor import DOCUMENT, editor
from tests.support.limits import CALL_LIMIT, RUN_LIMIT
from tests.support.monitor import expect_current, patient_parts, status
from tests.support.ports import free_port
from tests.support.processes import free_endpoint
from tests.support.reverse_proxy import Mount, reverse_proxy
from tests.support.soak import cases
from zenoh_ice import Settings

ANA = "/user/ana/visualhfsm/"
BEN = "/user/ben/visualhfsm/"


@contextmanager
def behind(browser: Browser, root: Path, path: str, *, keeps_path: bool) -> Iterator[EditorPage]:
    """Show the document of a folder in an editor behind a proxy, in a new window."""
    settings = Settings(realm="test-proxy", connect=(free_endpoint(),), clock="wall", timeout=CALL_LIMIT)
    with (
        editor(
            root,
            root / "walk.xml",
            base_path=path,
            port=free_port(),
            make_parts=patient_parts(settings),
        ) as running,
        reverse_proxy({path: Mount(running.port, keeps_path=keeps_path)}) as host,
    ):
        page = new_window(browser)
        address = running.server.new_address().replace(running.host, host)
        shown = EditorPage(page, running, address)
        yield shown
        assert not shown.mishaps, shown.mishaps
        assert page.url == f"http://{host}{path}"
        page.context.close()


@pytest.mark.parametrize(
    "keeps_path", cases([pytest.param(False, id="path taken off")], [pytest.param(True, id="path kept")])
)
def test_a_state_is_drawn_tried_and_followed_behind_a_proxy(
    browser: Browser, root: Path, path: Path, keeps_path: bool
) -> None:
    asked: list[str] = []
    with behind(browser, root, ANA, keeps_path=keeps_path) as shown:
        shown.page.on("request", lambda request: asked.append(request.url))
        shown.page.on("websocket", lambda socket: asked.append(socket.url))
        shown.state("wait").wait_for()
        x, y = shown.middle_of("go")
        shown.press("s")
        shown.page.mouse.click(x, y + 150)
        shown.name("rest")
        shown.expect_states("wait", "go", "rest")
        assert len(saved(shown, path).automata[0].states) == 3
        shown.button("Other ways to run").click()
        shown.page.get_by_role("menuitem", name="Try it without a robot").click()
        expect(status(shown)).to_have_text("Trying, 1 x", timeout=RUN_LIMIT * 1000)  # news, by websocket
        expect_current(shown, "wait")
        shown.page.reload()
        shown.expect_states("wait", "go", "rest")
        own = ANA.join(shown.page.url.split(ANA)[:1]) + ANA
        assert asked
        assert not [
            each for each in asked if own.partition("://")[2] not in each and not each.startswith("blob:")
        ]


def test_two_editors_of_one_host_keep_nothing_in_common(browser: Browser, root: Path, tmp_path: Path) -> None:
    with ExitStack() as stack:
        mounts = {}
        addresses = []
        for path in (ANA, BEN):
            folder = tmp_path / path.split("/")[2]
            folder.mkdir()
            (folder / "walk.xml").write_text(DOCUMENT)
            running = stack.enter_context(
                editor(folder, folder / "walk.xml", base_path=path, port=free_port())
            )
            mounts[path] = Mount(running.port)
            addresses.append(running.server.new_address().replace(running.host, "HOST"))
        host = stack.enter_context(reverse_proxy(mounts))
        page = new_window(browser)
        stack.callback(page.context.close)
        ana, ben = (each.replace("HOST", host) for each in addresses)
        page.goto(ana)
        theme = switch_theme(page)
        page.evaluate("sessionStorage.setItem('visualhfsm.unsent', 'not of this path')")
        page.goto(ben)
        expect(page.locator("hfsm-canvas .state").first).to_be_visible()
        assert page.evaluate("document.documentElement.dataset.theme") != theme
        expect(page.get_by_role("alert").filter(has_text="not of this path")).to_have_count(0)
        names = page.evaluate("[...Object.keys(localStorage)]")
        names.remove("visualhfsm.robotFolded")  # from `new_window`
        assert names == [f"{ANA} visualhfsm.theme"]
        found = {each["path"] for each in page.context.cookies()}
        assert found == {ANA, BEN}
        page.goto(f"http://{host}{ANA}")
        expect(page.locator("html")).to_have_attribute("data-theme", theme)


def switch_theme(page: Page) -> str:
    """Switch between light and dark, and return what is chosen now."""
    page.locator("hfsm-canvas .state").first.wait_for()
    before = page.evaluate("document.documentElement.dataset.theme")
    page.locator("hfsm-menubar").get_by_text("View", exact=True).click()
    page.get_by_role("menu").get_by_text("Light or dark", exact=False).click()
    expect(page.locator("html")).not_to_have_attribute("data-theme", before)
    return str(page.evaluate("document.documentElement.dataset.theme"))
