"""The page in other languages: chosen by the browser or in *View*, and without a word of English left."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from gettext import NullTranslations
from importlib.util import find_spec
from pathlib import Path
from typing import Final

import pytest
from playwright.sync_api import Browser, Route, expect

from tests.support.browser import EditorPage, editor_page, new_context
from tests.support.component import dance_and_follow
from tests.support.editor import Editor
from tests.support.monitor import DOCUMENT
from tests.support.watching import recorded
from visualhfsm._base import languages as _languages
from visualhfsm._base.html_file import STATIC
from visualhfsm._monitor.run_page import ExportedRun, write_run_page

WORDS: Final = """(known) => {
    // The names of the document, code, keys, and what a user reads of other programs.
    const others = ".cm-content, .cm-gutters, code, kbd, pre, .mono, [data-name], .state .name, .transition .label, " +
      ".lines, .component, .brand, .stop-button, hfsm-tree .text, hfsm-tabs .text, select.pick, .folder, option, .joints th, .when, .robot-cards label span";
    const attributes = ["aria-label", "title", "placeholder", "aria-valuetext", "aria-description"];
    const found = [];
    const note = (element, text) => {
      let rest = text.replace(/\\s+/g, " ").trim();
      for (let former = ""; former !== rest; ) [former, rest] = [rest, rest.replace(/⟦[^⟦⟧]*⟧/g, "·")];
      const words = rest.match(/\\p{L}{2,}/gu) ?? [];
      if (words.some((word) => !known.includes(word))) found.push(`${element.localName}.${element.getAttribute("class")}: ${rest}`);
    };
    const inside = (root) =>
      [...root.querySelectorAll("*")].flatMap((each) => [each, ...(each.shadowRoot ? inside(each.shadowRoot) : [])]);
    for (const element of inside(document.body)) {
      if (element.closest("script, style") || !element.checkVisibility()) continue;
      for (const name of attributes) if (element.hasAttribute(name)) note(element, element.getAttribute(name));
      if (element.closest(others)) continue;
      const texts = [...element.childNodes].filter((node) => node.nodeType === 3).map((node) => node.data);
      // A text with code in it is one text.
      for (const text of element.querySelector(":scope > code") ? [texts.join("")] : texts) note(element, text);
    }
    return [...new Set(found)];
}"""
"""Returns visible texts, and those of attributes, that are not of the made-up language."""


def views(shown: EditorPage) -> Iterator[str]:
    """Show one view of the page after the other, by keys and marks that are the same in every language."""
    page = shown.page
    yield "canvas"
    menus = page.locator("[role=menubar] > button")
    for index in range(menus.count() if menus.first.is_visible() else 0):
        menus.nth(index).click()
        page.get_by_role("menu").wait_for()
        yield f"menu {index}"
        shown.press("Escape")
    page.locator("hfsm-canvas .state").first.click()
    yield "selected"
    shown.press("Shift+F10")
    page.get_by_role("menu").wait_for()
    yield "actions on a state"
    shown.press("Escape", "Shift+Enter")
    page.locator(".side:focus-within").wait_for()
    yield "code of a state"
    shown.press("Control+f")
    page.locator(".cm-search").wait_for()
    yield "search in a piece of code"
    shown.press("Escape", "Escape")
    for index, name in enumerate(("time", "condition", "event")):
        page.locator(".transition .handle").nth(index).click()
        yield f"code of a transition: {name}"
    for key, name in (("Alt+i", "interfaces"), ("Alt+v", "variables")):
        shown.press(key)
        page.locator("hfsm-data-panel").wait_for()
        yield name
    for key, panel in BELOW.items():
        shown.press(key)
        page.locator(panel).wait_for()
        yield panel
    for key in DIALOGS:
        shown.press(key)
        page.locator("dialog[open]").wait_for()
        yield f"dialog {key}"
        shown.press("Escape")
        page.locator("dialog[open]").wait_for(state="detached")
    shown.press("Alt+b")
    page.locator(".robot-menu").wait_for()
    yield "robot"
    shown.press("Escape")


BELOW: Final = {
    "Control+m": "hfsm-problems",
    "Control+f": "hfsm-search",
    "Alt+o": "hfsm-output",
    "Alt+x": "hfsm-tests-panel",
    **({"Alt+y": "hfsm-trials-panel"} if find_spec("visualhfsm_trials") else {}),
    "Alt+h": "hfsm-undo-steps",
}
DIALOGS: Final = ("F1", "Control+k", "Control+e", "Control+o", "Control+Shift+s", "Alt+c")


def running_views(shown: EditorPage) -> Iterator[str]:
    """The same while the component runs."""
    page = shown.page
    shown.press("F5")
    page.locator(".live-status.running").wait_for()
    yield "running"
    shown.press("Alt+l")
    tabs = page.locator("hfsm-monitor-panel [role=tab]")
    tabs.first.wait_for()
    for index in range(tabs.count()):
        tabs.nth(index).click()
        page.locator("hfsm-monitor-panel .tab-panel > *").first.wait_for()
        yield f"live {index}"
    page.locator("hfsm-canvas .state").first.click()
    shown.press("Escape", "F8")
    page.locator(".live-status.paused").wait_for()
    yield "paused"
    shown.press("F8")
    shown.press("Shift+F5")
    page.locator(".live-status.ended").wait_for()
    yield "ended"


KNOWN: Final = [
    # Names of the document, of the robot and its parts, keys and units.
    *("walk", "xml", "wait", "look", "found", "go", "late", "many", "back", "home", "ball", "count", "speed"),
    *("float", "red", "spot", "pan", "tilt", "Nao", "STOP", "Camera", "CameraBottom"),
    *("Ctrl", "Alt", "ms", "min", "Hz"),
    # How the server says that a run has ended.
    *("stopped", "detenido"),
]
"""What may be read in every language."""


@pytest.fixture
def document() -> str:
    return DOCUMENT


def made_up(route: Route) -> None:
    """Answer with a language in which each text is its English one in brackets."""
    texts = json.loads((STATIC / "languages" / "es.json").read_text("utf-8"))
    route.fulfill(
        json={
            text: dict.fromkeys(known, bracketed(text)) if isinstance(known, dict) else bracketed(text)
            for text, known in texts.items()
        }
    )


def bracketed(text: str) -> str:
    """Put all of a text into brackets, except its placeholders."""
    return re.sub(r"{\w+}|((?!{\w+}).)+", lambda part: part[0] if part[0][0] == "{" else f"⟦{part[0]}⟧", text)


class MadeUp(NullTranslations):
    """The same language for what the server says, whose placeholders may have a format."""

    def gettext(self, message: str) -> str:
        parts = re.findall(r"{{|}}|{\w+(?::[^{}]*)?}|[^{}]+", message)
        return "".join(part if part[0] in "{}" else f"⟦{part}⟧" for part in parts)

    def ngettext(self, one: str, many: str, n: int) -> str:
        return self.gettext(one if n == 1 else many)


@pytest.fixture
def made_up_server(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Let the server speak it to pages in Spanish."""
    known = _languages._catalog
    monkeypatch.setattr(
        _languages, "_catalog", lambda language: MadeUp() if language == "es" else known(language)
    )
    _languages.encoder.cache_clear()
    yield
    _languages.encoder.cache_clear()


def recording_views(shown: EditorPage) -> Iterator[str]:
    """The views of a run that is recorded, and of the recording."""
    page = shown.page
    page.locator("hfsm-canvas .state").first.wait_for()
    shown.press("F5")
    page.locator(".live-status.running").wait_for()
    page.get_by_role("button", name="⟦Record⟧", exact=True).click()
    page.get_by_role("button", name="⟦End the recording⟧").wait_for()
    yield "recording"
    page.get_by_role("button", name="⟦End the recording⟧").click()
    page.get_by_role("button", name="⟦Play it⟧").click()
    page.locator(".banner.recorded").wait_for()
    yield "a recording"
    tabs = page.locator("hfsm-monitor-panel [role=tab]")
    if tabs.count() == 0:
        shown.press("Alt+l")
        tabs.first.wait_for()
    for index in range(tabs.count()):
        tabs.nth(index).click()
        page.locator("hfsm-monitor-panel .tab-panel > *").first.wait_for()
        yield f"a recording {index}"


RECORDING: Final = re.compile(r"(recordings/)?walk-[\d-]+(\.\w+)?")
"""The name of a recording, with the time at which it was made."""


@pytest.mark.usefixtures("made_up_server")
def test_no_word_of_english_is_left_in_a_view(browser: Browser, followed: Editor) -> None:
    with editor_page(browser, followed, language="es") as shown:
        shown.page.route("**/languages/es.json", made_up)
        shown.page.reload()
        left: dict[str, list[str]] = {}
        for walk in (views, running_views):
            for view in walk(shown):
                if words := shown.page.evaluate(WORDS, KNOWN):
                    left[view] = words
        assert left == {}


@pytest.mark.usefixtures("made_up_server")
def test_no_word_of_english_is_left_in_a_recording(browser: Browser, followed: Editor) -> None:
    with editor_page(browser, followed, language="es") as shown:
        shown.page.route("**/languages/es.json", made_up)
        shown.page.reload()
        left: dict[str, list[str]] = {}
        for view in recording_views(shown):
            # An element, then its text, of which the name of the recording is no word.
            texts = [each.partition(": ")[2] for each in shown.page.evaluate(WORDS, KNOWN)]
            words = {word for each in texts for word in re.findall(r"[^\W\d]{2,}", RECORDING.sub("", each))}
            if english := words.difference(KNOWN):
                left[view] = sorted(english)
        assert left == {}


def test_no_word_of_english_is_left_before_a_document_is_open_and_in_an_error(
    browser: Browser, running: Editor
) -> None:
    with editor_page(browser, running, language="es") as shown:
        shown.page.route("**/languages/es.json", made_up)
        shown.page.reload()
        shown.page.locator(".cards").wait_for()
        assert shown.page.evaluate(WORDS, KNOWN) == []
        shown.page.evaluate("void Promise.reject(new Error('42'))")
        shown.page.locator(".notice.error").wait_for()
        assert shown.page.evaluate(WORDS, [*KNOWN, "Error"]) == []
        shown.mishaps.clear()


def test_the_page_speaks_the_language_of_the_browser(browser: Browser, followed: Editor) -> None:
    with editor_page(browser, followed, language="es-MX") as shown:
        expect(shown.page.locator("html")).to_have_attribute("lang", "es")
        expect(shown.page.get_by_role("button", name="Sin problemas")).to_be_visible()
        expect(shown.page.get_by_text("2 estados, 3 transiciones")).to_be_visible()
        shown.press("Alt+i")
        expect(shown.page.get_by_role("heading", name="Parámetros 1")).to_be_visible()
        assert shown.violations("header", "hfsm-data-panel", ".live-bar") == []


def test_what_a_component_and_the_robot_say_is_in_the_language_of_the_page(
    browser: Browser, followed: Editor
) -> None:
    with editor_page(browser, followed, language="es") as shown:
        page = shown.page
        page.locator("hfsm-canvas .state").first.click()
        shown.press("F5")
        page.locator(".live-status.running").wait_for()
        shown.press("w")
        expect(page.get_by_role("tooltip")).to_contain_text("su momento llega tras")
        expect(page.get_by_role("tooltip")).to_contain_text("era falsa al evaluarla hace")
        shown.press("Escape", "Delete", "F9")
        expect(page.locator(".notice")).to_contain_text("estaba en el estado wait, que ya no existe")
        page.locator(".stop-button").click()
        expect(page.locator(".banner.error")).to_contain_text("se pulsó STOP en el editor")


def test_a_browser_of_another_language_gets_english_and_loads_no_texts(
    browser: Browser, followed: Editor
) -> None:
    with editor_page(browser, followed, language="de-DE") as shown:
        expect(shown.page.locator("html")).to_have_attribute("lang", "en")
        expect(shown.button("No problems")).to_be_visible()
        loaded: list[str] = shown.page.evaluate(
            "performance.getEntriesByType('resource').map(each => each.name)"
        )
        assert any(name.endswith("/texts.js") for name in loaded)
        assert not [name for name in loaded if "/languages/" in name]


def test_the_language_is_changed_and_what_was_typed_is_kept(browser: Browser, followed: Editor) -> None:
    with editor_page(browser, followed, cached=False) as shown:
        shown.state("wait").click()
        shown.edit_code()
        shown.press("Control+End")
        shown.type("\n# typed")
        shown.choose_in("View", "Language")
        shown.page.get_by_role("radio", name="Español").click()

        expect(shown.page.locator("html")).to_have_attribute("lang", "es")
        expect(shown.page.get_by_role("menuitem", name="Archivo")).to_be_visible()
        shown.page.get_by_role("button", name="Estado wait,").click()
        shown.edit_code()
        expect(shown.page.locator("hfsm-code-panel .cm-content")).to_contain_text("# typed")

        shown.choose_in("Ver", "Idioma")
        expect(shown.page.get_by_role("radio", name="Español")).to_be_checked()
        shown.page.get_by_role("radio", name="English").click()
        expect(shown.button("No problems")).to_be_visible()


def test_the_language_does_not_change_while_typed_text_waits_for_the_server(
    browser: Browser, followed: Editor
) -> None:
    with editor_page(browser, followed, cached=False) as shown:
        shown.state("wait").click()
        shown.edit_code()
        shown.connections.cut()
        shown.press("Control+End")
        shown.type("\n# typed")
        shown.choose_in("View", "Language")
        shown.page.get_by_role("radio", name="Español").click()
        expect(shown.page.locator(".notice.error")).to_contain_text(
            "The language changes once the editor is connected"
        )
        expect(shown.page.locator("html")).to_have_attribute("lang", "en")
        expect(shown.page.locator("hfsm-code-panel .cm-content")).to_contain_text("# typed")
        shown.connections.restore()


def test_what_was_said_in_an_exported_run_is_in_the_language_of_its_reader(
    browser: Browser, tmp_path: Path
) -> None:
    path = tmp_path / "run.html"
    write_run_page(path, ExportedRun("dance", dance_and_follow(), recorded(3.0)))
    for language, event in (
        ("es", "parada: su velocidad no se renovó en 0,5 s"),
        ("en", "stopped: its velocity was not renewed within 0.5 s"),
    ):
        with new_context(browser, language) as context:
            page = context.new_page()
            page.goto(path.as_uri())
            expect(page.locator("hfsm-live-errors .message")).to_have_text(event)
