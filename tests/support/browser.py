"""A browser with the editor's page, used like a person: found by roles and names, with mouse and keys."""

from __future__ import annotations

import contextlib
import functools
import os
import shutil
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, Final, Literal, NamedTuple

import pytest
from playwright.sync_api import (
    Browser,
    BrowserContext,
    ConsoleMessage,
    Error,
    Locator,
    Page,
    Playwright,
    Route,
    TimeoutError,  # noqa: A004 - Playwright's
    expect,
    sync_playwright,
)

from codegen.diagnostics import Diagnostics
from codegen.hfsm import read_document
from codegen.hfsm.document import Document
from tests.support.editor import Editor
from tests.support.limits import PAGE_LIMIT, START_LIMIT
from tests.support.page_coverage import PAGE_COVERAGE, recorded
from tests.support.places import ROOT
from tests.support.soak import SOAKS

__all__ = [
    "NO_CHROMIUM",
    "Box",
    "Connections",
    "EditorPage",
    "chromium",
    "chromium_on_demand",
    "chromium_path",
    "editor_page",
    "load_axe",
    "open_alone",
    "pages_in_turn",
    "saved",
    "shared_address",
]

COMMANDS: Final = ("chromium-headless-shell", "chromium", "chromium-browser")
NO_CHROMIUM: Final = "needs Chromium: make browser as root, or apt-get install chromium"
FEATURES_OFF: Final = (
    # Unseen pages for suggestions below the address bar, which take half of the time to open a window.
    *("WebUIOmniboxPopup", "WebUIOmniboxAimPopup"),
    # Chromium goes by the last such list, so these are those of Playwright's list that may matter here.
    *("AvoidUnnecessaryBeforeUnloadCheckSync", "DestroyProfileOnBrowserClose", "PaintHolding"),
    *("HttpsFirstBalancedModeAutoEnable", "HttpsUpgrades", "ThirdPartyStoragePartitioning"),
    *("AimEnabled", "LensOverlay", "MediaRouter", "NetworkTimeServiceQuerying", "OptimizationHints"),
    "PreconnectToSearch",
)
FLAGS: Final = (
    "--no-sandbox",  # Chromium's sandbox does not work for root in a container
    *("--disable-gpu", "--disable-dev-shm-usage"),
    "--renderer-process-limit=1",  # a window stays in its process, which keeps the files of the page
    f"--disable-features={','.join(FEATURES_OFF)}",
    "--js-flags=--no-opt,--no-maglev",  # a page lives for seconds, too short for optimized code to pay
)
_AXE: Final = ROOT / "tests/page/node_modules/axe-core/axe.min.js"
EXPERIMENTAL_RULES: Final = ("label-content-name-mismatch",)
"""Rules that axe leaves out by default."""
MOTION: Final[Literal["no-preference", "reduce"]] = "no-preference" if SOAKS else "reduce"
"""What the user prefers: a click waits until nothing moves, which takes a fifth of the time of all tests."""
POINTED_AT: Final = 3.0
"""After so many s without an effect a person points at something again."""
COLOR_RULES: Final = ("color-contrast", "link-in-text-block")
"""All rules of axe about colors except the one of level AAA, which axe leaves out by default."""

expect.set_options(timeout=PAGE_LIMIT * 1000)

# A frame is drawn after what asked for it has run, so the second one shows that the first was drawn.
DRAWN_AT_SIZE: Final = """async ([width, height]) => {
    const frame = () => new Promise((resolve) => requestAnimationFrame(resolve));
    while (innerWidth !== width || innerHeight !== height) await frame();
    await frame();
    await frame();
}"""

# One request instead of one for each state: the page itself checks again with each frame.
STATES_ARE: Final = """names => {
    const states = [...document.querySelectorAll("hfsm-canvas .state")];
    const isShown = (state, name) =>
      `${state.ariaLabel},`.startsWith(`State ${name},`) &&
      state.checkVisibility({visibilityProperty: true}) && state.getBoundingClientRect().width > 0;
    return states.length === names.length && states.every((each, index) => isShown(each, names[index]));
}"""

HASTE: Final = 1 if SOAKS else 5
"""The page waits so many times less for a pause in what a user does, such as the end of typing or of a hover."""

# On a busy machine a message could be gone before it is looked for.
PACE: Final = f"""
    const genuine = window.setTimeout;
    const paced = (delay) => (delay >= 6000 ? 20 * delay : delay >= 100 && delay <= 600 ? delay / {HASTE} : delay);
    window.setTimeout = (handler, delay, ...rest) => genuine(handler, paced(delay), ...rest);
"""


def chromium_path() -> str | None:
    """Return the path of Chromium, preferably of the headless one, or None if it is not installed."""
    return os.environ.get("CHROMIUM") or next(filter(None, map(shutil.which, COMMANDS)), None)


def launch_chromium(playwright: Playwright) -> Browser:
    """Start the system's Chromium, or the one that CHROMIUM names; without any, the test is skipped."""
    path = chromium_path()
    if path is None:
        pytest.skip(NO_CHROMIUM)
    return playwright.chromium.launch(executable_path=path, args=FLAGS, timeout=START_LIMIT * 1000)


@contextlib.contextmanager
def chromium_on_demand() -> Iterator[Callable[[], Browser]]:
    """Yield a function that returns Chromium, which it starts when it is first called."""
    with sync_playwright() as playwright, contextlib.ExitStack() as started:

        @functools.cache
        def browser() -> Browser:
            return started.enter_context(launch_chromium(playwright))

        yield browser


@contextlib.contextmanager
def chromium() -> Iterator[Browser]:
    """Start Chromium."""
    with chromium_on_demand() as browser:
        yield browser()


# Drawing the robot beside the drawing takes time; a test that looks at it shows it.
FOLD_ROBOT: Final = "localStorage['visualhfsm.robotFolded'] ??= 'yes'"


AS_AT_FIRST: Final = f"""async () => {{
    const app = document.querySelector("hfsm-app");
    for (const each of document.querySelectorAll("dialog[open]")) each.close();
    app.showSide("");
    app.showBottom("");
    for (const name of ["--left", "--side", "--bottom"]) document.documentElement.style.removeProperty(name);
    localStorage.clear();
    {FOLD_ROBOT};
}}"""
"""Closes what a test may leave open when its documents are closed, and forgets what the page remembers."""


KEEP_CONNECTIONS: Final = """
    const open = new Set();
    let refusing = false;
    window.WebSocket = class extends WebSocket {
      constructor(...details) {
        super(...details);
        open.add(this);
        this.addEventListener("close", () => open.delete(this));
        if (refusing) this.close();
      }
    };
    window.connections = {
      cut() {
        refusing = true;
        for (const each of open) each.close();
      },
      restore() {
        refusing = false;
      },
    };
"""


class Connections:
    """The websockets between a page and its server, which can be cut.

    The page itself closes them. If the test relayed their messages, it would do so only while it talks to the browser,
    and messages from the page would wait until then.
    """

    def __init__(self, page: Page) -> None:
        self._page = page

    def cut(self) -> None:
        """Close all connections and refuse new ones."""
        self._page.evaluate("window.connections.cut()")

    def restore(self) -> None:
        """Accept connections again."""
        self._page.evaluate("window.connections.restore()")


class Box(NamedTuple):
    """Where an element is in the window, in pixels."""

    x: float
    y: float
    width: float
    height: float

    @classmethod
    def of(cls, locator: Locator) -> Box:
        """Return where a visible element is."""
        found = locator.bounding_box()
        assert found is not None
        return cls(found["x"], found["y"], found["width"], found["height"])

    @property
    def area(self) -> float:
        """The square pixels that it takes."""
        return self.width * self.height

    def overlaps(self, other: Box) -> bool:
        """Return whether two elements cover each other."""
        return (
            self.x < other.x + other.width
            and other.x < self.x + self.width
            and self.y < other.y + other.height
            and other.y < self.y + self.height
        )

    def is_within(self, other: Box) -> bool:
        """Return whether another element's place contains this one's."""
        return (
            other.x <= self.x
            and self.x + self.width <= other.x + other.width
            and other.y <= self.y
            and self.y + self.height <= other.y + other.height
        )


class EditorPage:
    """The editor in a browser window."""

    def __init__(self, page: Page, editor: Editor, address: str = "", *, holds: str = "") -> None:
        self.page = page
        self._holds = holds
        self._held: list[Route] = []
        self.connections = Connections(page)
        self.editor = editor
        self.mishaps: list[str] = []
        self.spent = False
        """Whether the window was changed for good, such as its clock: then no other test may use it."""
        page.on("pageerror", self._note_error)
        page.on("console", self._note_message)
        if holds:  # before the page loads: interception that begins while it does may lose requests
            page.route(holds, lambda route: self._held.append(route))
        page.goto(address or editor.server.new_address())

    def leave(self) -> None:
        """Stop listening: the window will show something else, unless it is spent."""
        self.page.remove_listener("pageerror", self._note_error)
        self.page.remove_listener("console", self._note_message)
        if self.spent:
            self.page.close()

    def _note_error(self, error: Error) -> None:
        self.mishaps.append(str(error))

    def _note_message(self, message: ConsoleMessage) -> None:
        if message.type == "error" and "WebSocket" not in message.text:
            self.mishaps.append(message.text)

    def state(self, name: str) -> Locator:
        """The state of the shown automaton with a name."""
        return self.page.locator(f'.state[aria-label="State {name}"], .state[aria-label^="State {name},"]')

    def transition(self, name: str) -> Locator:
        """The transition of the shown automaton with a name."""
        return self.page.locator(f'.transition[aria-label^="Transition {name} from"]')

    def button(self, name: str) -> Locator:
        """The button with a name."""
        return self.page.get_by_role("button", name=name, exact=True)

    def hover(self, locator: Locator, shows: Locator) -> None:
        """Point at an element until that shows another one; like a person, come again if it doesn't."""
        deadline = time.monotonic() + PAGE_LIMIT
        while True:
            locator.hover()
            with contextlib.suppress(TimeoutError):
                shows.wait_for(timeout=POINTED_AT * 1000)
                return
            assert time.monotonic() < deadline, f"{locator} shows nothing"
            self.page.mouse.move(0, 0)

    def held(self, path: str, ask: Callable[[], None]) -> Route:
        """Do what asks for a file, and return the request for it, which is not answered yet."""
        if path != self._holds:
            self.page.locator("hfsm-shelf").wait_for(state="attached")  # the last that a page loads by itself
            self.page.route(path, lambda route: self._held.append(route))
        ask()
        deadline = time.monotonic() + PAGE_LIMIT
        while not self._held:
            assert time.monotonic() < deadline, f"nothing asks for {path}"
            self.page.wait_for_timeout(20)
        return self._held[0]

    def choose_in(self, menu: str, item: str) -> None:
        """Choose an item of a menu of the header, or of *Actions* on the canvas."""
        self.page.locator("hfsm-menubar, hfsm-tools").get_by_text(menu, exact=True).click()
        self.page.get_by_role("menu").get_by_text(item, exact=True).click()

    def choose(self, name: str) -> None:
        """Click a radio button until it is selected in the page: what appears above it may move it meanwhile."""
        radio = self.page.get_by_role("radio", name=name)
        deadline = time.monotonic() + PAGE_LIMIT
        while True:
            self.page.locator("label", has=radio).click()  # which is what a user clicks
            with contextlib.suppress(AssertionError):
                # Not `check`, which looks at once: the page may be drawn once more before the server has answered.
                expect(radio).to_be_checked(timeout=POINTED_AT * 1000)
                return
            assert time.monotonic() < deadline, f"{name} is not chosen"

    def dismiss(self, notices: Locator) -> None:
        """Close notices, which cover the elements below them, without moving the focus."""
        notices.locator(".close").evaluate_all("all => all.forEach((each) => each.click())")

    def press(self, *keys: str) -> None:
        """Press keys in order."""
        for key in keys:
            self.page.keyboard.press(key)

    def show_robot(self) -> None:
        """Show the robot beside the drawing, as users see it: tests fold it."""
        self.button("See the robot").click()
        expect(self.page.get_by_role("region", name="The robot").locator(".stage canvas")).to_be_visible()

    def edit_code(self) -> None:
        """Show the code of the selected element, and wait until it has the focus, which it takes a moment later."""
        self.press("Shift+Enter")
        expect(self.page.locator(".side:focus-within")).to_have_count(1)

    def type(self, text: str) -> None:
        """Type a text, key by key, so that what each key does in a code field counts."""
        self.page.keyboard.type(text)

    def insert(self, text: str) -> None:
        """Type a text at once, without its keys: a fifth of the work where only the text matters."""
        self.page.keyboard.insert_text(text)

    def name(self, text: str) -> None:
        """Insert the name of an element that was just drawn, or is being renamed."""
        self.page.locator(".rename").wait_for()
        self.insert(text)
        self.press("Enter")

    def resize(self, width: int, height: int) -> None:
        """Resize the window, and wait until it is drawn: then everything that watches sizes has adapted."""
        self.page.set_viewport_size({"width": width, "height": height})
        self.page.evaluate(DRAWN_AT_SIZE, [width, height])

    def middle(self, locator: Locator) -> tuple[float, float]:
        """Return the position of the middle of an element in the window, once it is visible."""
        locator.wait_for()
        box = locator.bounding_box()
        assert box is not None
        return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2

    def middle_of(self, name: str) -> tuple[float, float]:
        """Return the position of the middle of a state in the window."""
        return self.middle(self.state(name).locator(".body"))

    def expect_at(self, what: str | Locator, place: tuple[float, float], within: float = 1.5) -> None:
        """Wait until the middle of an element, or of the state with a name, is at a position in the window."""
        found = what if isinstance(what, Locator) else self.state(what).locator(".body")
        deadline = time.monotonic() + PAGE_LIMIT
        while (seen := self.middle(found)) != pytest.approx(place, abs=within):
            assert time.monotonic() < deadline, f"{seen}, not {place}"
            self.page.wait_for_timeout(20)

    def radius_of(self, name: str) -> float:
        """Return the radius of a state in pixels of the window."""
        body = self.state(name).locator(".body")
        body.wait_for()
        box = body.bounding_box()
        assert box is not None
        return box["width"] / 2

    def drag(self, start: tuple[float, float], end: tuple[float, float]) -> None:
        """Drag with the left button."""
        mouse = self.page.mouse
        mouse.move(*start)
        mouse.down()
        mouse.move((start[0] + end[0]) / 2, (start[1] + end[1]) / 2, steps=2)
        mouse.move(*end, steps=2)
        mouse.up()

    def connect(self, origin: str, destination: str) -> None:
        """Drag from the border of a state to another one; afterwards the name of the transition can be typed."""
        x, y = self.middle_of(origin)
        to_x, to_y = self.middle_of(destination)
        far = ((to_x - x) ** 2 + (to_y - y) ** 2) ** 0.5 or 1.0
        radius = self.radius_of(origin)
        self.drag((x + (to_x - x) / far * radius, y + (to_y - y) / far * radius), (to_x, to_y))

    def names(self) -> list[str]:
        """Return the names of the shown states."""
        labels = self.page.locator("hfsm-canvas .state").evaluate_all(
            "all => all.map(each => each.getAttribute('aria-label'))"
        )
        return [label.removeprefix("State ").partition(",")[0] for label in labels]

    def arcs(self) -> list[str]:
        """Return the labels of the shown transitions: `name from origin to destination`."""
        labels = self.page.locator(".transition[data-key]").evaluate_all(
            "all => all.map(each => each.getAttribute('aria-label'))"
        )
        return [label.removeprefix("Transition ").partition(",")[0] for label in labels]

    def expect_states(self, *names: str) -> None:
        """Wait until there are exactly the states with these names, in this order, and are visible."""
        try:
            self.page.wait_for_function(STATES_ARE, arg=names)
        except Error:
            assert self.names() == list(names)
            raise

    def violations(self, *areas: str, in_both_themes: bool = SOAKS) -> list[str]:
        """Return what axe finds wrong in the page, or in areas of it (selectors) once each is shown.

        It checks the theme that is shown, and on demand the other one. There only colors differ, so it checks only
        the colors. The page stays in that theme, because drawing it once more takes time, too.
        """
        if areas:
            all_are_shown = "areas => areas.every((each) => document.querySelector(each))"
            self.page.wait_for_function(all_are_shown, arg=areas)
        if self.page.evaluate("!window.axe"):
            load_axe(self.page)
        found = self._violations(areas, {"rules": {each: {"enabled": True} for each in EXPERIMENTAL_RULES}})
        if not in_both_themes:
            return found
        self._change_theme()
        return found + self._violations(areas, {"runOnly": COLOR_RULES})

    def _violations(self, areas: Sequence[str], options: dict[str, Any]) -> list[str]:
        # Of results that are not requested, axe lists one element of each rule instead of all. Parsing all style sheets
        # again would take a third of its time, and serves only a rule that is off because it is experimental.
        found: list[str] = self.page.evaluate(
            """async ([areas, options]) => {
              const shown = areas.map((each) => [each]);
              const usual = {resultTypes: ["violations"], preload: {assets: ["media"]}};
              const found = await axe.run(areas.length ? {include: shown} : document, {...usual, ...options});
              return found.violations.flatMap(({id, nodes}) =>
                nodes.map((node) => `${id}: ${node.html.slice(0, 150)} ${node.failureSummary}`));
            }""",
            [areas, options],
        )
        return found

    def _change_theme(self) -> None:
        shown: str = self.page.evaluate("document.documentElement.dataset.theme")
        theme: Literal["light", "dark"] = "light" if shown == "dark" else "dark"
        self.page.emulate_media(color_scheme=theme)
        self.page.wait_for_function("theme => document.documentElement.dataset.theme === theme", arg=theme)


@contextlib.contextmanager
def editor_page(
    browser: Browser,
    editor: Editor,
    *,
    width: int = 1280,
    height: int = 800,
    cached: bool = True,
    language: str | None = None,
    holds: str = "",
) -> Iterator[EditorPage]:
    """Open the editor in a window; fail if the page throws or logs an error.

    The file that `holds` names is not loaded before the test lets it be; see `held`.

    Its files may come from the browser's cache if `cached`; then it does not always list what it loads. A window with a
    `language` other than English remembers nothing.
    """
    origin = f"http://{editor.host}"
    with window(browser, origin, width, height, cached=cached, language=language) as page:
        with recorded(page):
            shown = EditorPage(page, editor, holds=holds)
            try:
                yield shown
            except BaseException as error:
                error.add_note(f"what the page has logged: {shown.mishaps}")
                raise
            assert not shown.mishaps, shown.mishaps
        shown.leave()


def load_axe(page: Page) -> None:
    """Load the checker of accessibility into a page; skips the test where npm has not installed it."""
    if not _AXE.exists():
        pytest.skip("needs axe-core: make test installs it where Node.js is")
    page.evaluate(_AXE.read_text("utf-8"))


@functools.cache
def idle_windows(browser: Browser) -> list[Page]:
    """Return the windows that no test uses at present.

    Each is the only one of its context. It keeps its process, and the files of the editor's page in its memory.
    """
    return []


def new_context(browser: Browser, language: str | None = None) -> BrowserContext:
    """Return a context without any memory."""
    return browser.new_context(
        viewport={"width": 1280, "height": 800},
        color_scheme="light",
        reduced_motion=MOTION,
        locale=language,
    )


@contextlib.contextmanager
def window(
    browser: Browser, origin: str, width: int, height: int, *, cached: bool, language: str | None = None
) -> Iterator[Page]:
    """Provide a window that remembers nothing or, if `cached`, nothing but unchanging files."""
    cached = (
        cached and not language and not PAGE_COVERAGE
    )  # code from the cache is compiled, without counters of its branches
    idle = idle_windows(browser) if cached else []
    page = idle.pop() if idle else new_window(browser, language)
    page.set_viewport_size({"width": width, "height": height})
    reusable = False
    try:
        yield page
        reusable = cached and not page.is_closed() and page.evaluate("origin") == origin
        if reusable:
            forget(page, origin)
            idle.append(page)
    finally:
        if not reusable:
            page.context.close()


def new_window(browser: Browser, language: str | None = None) -> Page:
    """Open a window for `EditorPage`."""
    page = new_context(browser, language).new_page()
    for script in (KEEP_CONNECTIONS, PACE, FOLD_ROBOT):
        page.add_init_script(script)
    page.set_default_timeout(PAGE_LIMIT * 1000)
    return page


def forget(page: Page, origin: str) -> None:
    """Leave a page, and clear all that its window remembers: the page, its storage and how it was used."""
    page.evaluate("addEventListener('pagehide', () => sessionStorage.clear())")  # after the page's own
    page.unroute_all()
    page.goto("about:blank")
    page.mouse.move(0, 0)
    page.emulate_media(media="null", color_scheme="light", reduced_motion=MOTION, forced_colors="null")
    page.context.clear_cookies()
    page.context.clear_permissions()
    devtools = page.context.new_cdp_session(page)
    devtools.send("Storage.clearDataForOrigin", {"origin": origin, "storageTypes": "all"})
    devtools.detach()


@contextlib.contextmanager
def pages_in_turn(browser: Browser, editor: Editor) -> Iterator[Callable[[], EditorPage]]:
    """Yield a function that returns the page of tests that run one after the other; a spent one is replaced."""
    with contextlib.ExitStack() as opened:
        newest: list[EditorPage] = []

        def page() -> EditorPage:
            if not newest or newest[-1].spent:
                opened.close()
                newest[:] = [opened.enter_context(editor_page(browser, editor))]
            return newest[-1]

        yield page


@contextlib.contextmanager
def open_alone(shown: EditorPage, *paths: Path) -> Iterator[None]:
    """Open documents in a window that shows none, and show the last one, or the start page without any.

    Afterwards the window is left as it was found: without documents, panels, notices and memory.
    """
    page = shown.page
    with shown.editor.opened(*paths):
        for path in paths[-1:]:
            page.get_by_role("tab", name=path.stem).last.click()
            page.locator("hfsm-canvas .state").first.wait_for()
        yield
        spent, shown.spent = shown.spent, True  # unless all of the following succeeds
    assert not shown.mishaps, shown.mishaps
    if spent:
        return
    page.get_by_role("heading", name="Draw what your robot does").wait_for()
    page.evaluate(AS_AT_FIRST)
    shown.dismiss(page.locator(".notice"))
    page.unroute_all()
    page.context.clear_permissions()
    page.mouse.move(0, 0)
    shown.resize(1280, 800)
    shown.spent = False


def shared_address(shown: EditorPage) -> str:
    """Share the editor with viewers; return the address for them."""
    shown.press("Control+k")
    shown.page.keyboard.type("Share to look")
    shown.press("Enter")
    address: str = shown.page.locator(".shared-address").input_value()
    shown.press("Escape")
    return address


def saved(shown: EditorPage, path: Path) -> Document:
    """Save the shown document and return the content of the file."""
    notice = shown.page.get_by_role("status").filter(has_text="Saved")
    shown.dismiss(notice)  # it is from an earlier time
    shown.press("Control+s")
    notice.wait_for()
    shown.dismiss(notice)
    document = read_document(path, Diagnostics())
    assert document is not None
    return document
