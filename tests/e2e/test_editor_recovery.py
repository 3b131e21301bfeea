"""Unsaved changes of an editor that ended are offered when the file is opened again."""

from __future__ import annotations

import contextlib
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Locator, expect

from tests.support.browser import EditorPage, editor_page
from tests.support.editor import Editor, editor
from tests.support.panels import edit
from tests.support.ports import free_port


@pytest.fixture
def root(tmp_path: Path) -> Path:
    """The folder of a test alone: what is not saved is kept beside it."""
    root = tmp_path / "root"
    root.mkdir()
    return root


@pytest.fixture
def former(root: Path, path: Path) -> Iterator[Editor]:
    """The editor that ends, and whose port the next one gets."""
    with editor(root, path, port=free_port()) as former:
        yield former


@pytest.fixture
def shown(browser: Browser, former: Editor) -> Iterator[EditorPage]:
    with editor_page(browser, former) as shown:
        shown.expect_states("wait", "go")
        yield shown
        shown.mishaps.clear()  # Chromium logs each request that is refused


def said(shown: EditorPage, text: str) -> Locator:
    return shown.page.get_by_role("alert").filter(has_text=text)


def test_a_page_says_what_to_do_when_the_editor_was_restarted(
    shown: EditorPage, former: Editor, root: Path, path: Path
) -> None:
    shown.expect_states("wait", "go")
    former.stop()
    banner = said(shown, "No connection since")
    expect(banner).to_contain_text("The editor is offline")
    shutil.rmtree(root.with_name("keys"))  # with its key, the next one would let the page in
    with editor(root, path, port=former.port) as again:
        expect(banner).to_contain_text("open the address that it printed in its terminal")
        with contextlib.closing(shown.page.context.new_page()) as other:
            other.goto(again.server.new_address())
            expect(banner).to_have_count(0)
            shown.expect_states("wait", "go")


def test_a_page_connects_again_and_recovers_what_was_not_saved_when_the_editor_was_restarted(
    shown: EditorPage, former: Editor, root: Path, path: Path
) -> None:
    shown.state("go").click()
    shown.press("Delete")
    shown.expect_states("wait")
    edit(shown, "wait")
    shown.type("1")
    expect(shown.page.locator(".last-step")).to_contain_text("Edit the code of “wait”")
    former.stop()
    offline = said(shown, "No connection since")
    expect(offline).to_contain_text(f"when it runs on port {former.port}")
    shown.type("2")
    offline.get_by_role("button", name="Copy what was not sent").wait_for()

    with editor(root, path, port=former.port):
        expect(offline).to_have_count(0)
        recover = said(shown, "were not saved")
        shown.expect_states("wait", "go")
        recover.get_by_role("button", name="Recover them").click()
        shown.expect_states("wait")
        expect(recover).to_have_count(0)
        expect(shown.page.locator(".last-step")).to_contain_text("Edit the code of “wait”")
        expect(shown.page.get_by_role("tablist", name="Open documents").get_by_role("tab")).to_have_count(1)
        code = shown.page.get_by_role("textbox", name="Code of the state wait")
        expect(code).to_have_text("pass12")  # the panel is open as before, and has what was typed
        notice = shown.page.get_by_role("status").filter(has_text="is in walk again")
        expect(notice).to_be_visible()
        shown.page.reload()
        expect(code).to_have_text("pass12")
        shown.state("wait").click()
        shown.press("Control+z")
        expect(code).to_have_text("pass1")
        shown.press("Control+z", "Control+z")
        shown.expect_states("wait", "go")


def test_what_was_typed_offline_is_merged_with_a_file_that_was_changed_meanwhile_or_is_offered(
    shown: EditorPage, former: Editor, root: Path, path: Path
) -> None:
    code = edit(shown, "wait")
    former.stop()
    offline = said(shown, "No connection since")
    offline.wait_for()
    shown.press("Home")
    shown.type("typed = 1; ")
    path.write_text(path.read_text().replace("<code>pass</code>", "<code>pass\nmore = 2</code>", 1))
    with editor(root, path, port=former.port) as again:
        expect(offline).to_have_count(0)
        expect(code).to_have_text("typed = 1; passmore = 2")  # its lines
        shown.press("Control+s")
        expect(shown.page.get_by_role("status").filter(has_text="Saved")).to_be_visible()
        assert "typed = 1; pass\nmore = 2" in path.read_text()
        again.stop()
        offline.wait_for()
        code.focus()
        shown.press("End")
        shown.type("lost")
        path.write_text(path.read_text().replace('id="1">', 'id="3">', 2))
    with editor(root, path, port=former.port):
        unsent = said(shown, "did not reach a document")
        expect(unsent).to_contain_text("lost")
        unsent.get_by_role("button", name="Discard it").click()
        expect(unsent).to_have_count(0)


def test_what_was_typed_offline_is_kept_for_an_editor_that_opens_no_document(
    shown: EditorPage, former: Editor, root: Path, path: Path
) -> None:
    edit(shown, "wait")
    shown.type("1")
    expect(shown.page.locator(".last-step")).to_contain_text("Edit the code of “wait”")
    former.stop()
    copy = shown.page.get_by_role("button", name="Copy what was not sent")
    unsent = said(shown, "did not reach a document")
    shown.type("2")
    copy.wait_for()
    with editor(root, port=former.port) as again:
        shown.page.get_by_role("button", name="Recover walk").click()
        shown.expect_states("wait", "go")
        code = edit(shown, "wait")
        expect(code).to_have_text("pass12")
        expect(unsent).to_have_count(0)
        shown.press("Control+s")
        expect(shown.page.get_by_role("status").filter(has_text="Saved")).to_be_visible()
        again.stop()
        shown.type("3")
        copy.wait_for()
    with editor(root, port=former.port):
        expect(unsent).to_contain_text("pass123")
