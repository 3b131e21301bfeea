"""`visualhfsm document`: what a project says, proves, and is tested for, as one page that needs no network."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, Page, expect

from tests.support.browser import new_context
from tests.support.commands import run_here
from tests.support.documents import document, state, sub, transition
from tests.support.exported_pages import TOO_WIDE, check
from tests.support.watching import content
from visualhfsm._commands.app import app

pytestmark = pytest.mark.slow

HOSTILE = "</script><script>alert(1)</script><img src=x onerror=alert(2)>"
GOES = transition(3, 1, 2, "500", type="time", name="soon")
BACK = transition(4, 2, 1, "60000", type="time", name="back")
TESTS = '''"""Tests of patrol.xml."""


def test_it_goes_soon(behavior):
    patrol = behavior("patrol.xml")
    patrol.advance(1.0)
    assert patrol.is_active("go")


def test_it_never_waits(behavior):
    assert behavior("patrol.xml").is_active("go")
'''


def stated(kind: str, name: str, says: str) -> str:
    return f'<property kind="{kind}"><name>{name}</name><expression>{says}</expression></property>'


@pytest.fixture(scope="module")
def project(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a project whose page is written: a tested, a refuted, a hostile, a wrong and a broken document."""
    folder = tmp_path_factory.mktemp("robots")

    def patrol(*properties: str) -> str:
        return document(
            sub(1, 0, state(1, "wait", initial=True), state(2, "go", "self.sent = 1", child=2), GOES, BACK),
            sub(2, 1, state(1, "inside", initial=True)),
            head=f"<description>Walk about.</description><properties>{''.join(properties)}</properties>",
        )

    for name, text in {
        "patrol": patrol(stated("eventually", "arrives", "go")),
        "refuted": patrol(stated("never", "stays", "go")),
        "hostile": document(sub(1, 0, state(1, HOSTILE, f"'{HOSTILE}'", initial=True))),
        "wrong": document(sub(1, 0, state(1, "only", "if True", initial=True))),
        "broken": patrol().replace("</SubAutomata>", ""),
    }.items():
        (folder / f"{name}.xml").write_text(text)
    (folder / "pyproject.toml").write_text("[tool.pytest.ini_options]\naddopts = '-p no:anyio'\n")
    (folder / "test_patrol.py").write_text(TESTS)
    done = run_here(app, "visualhfsm", "document", ".", "--out", "page.html", cwd=folder)
    assert done.returncode == 0, done.stderr
    return folder


@pytest.fixture(scope="module")
def chapters(project: Path) -> Mapping[str, Any]:
    shown, _ = content((project / "page.html").read_text("utf-8"))
    assert shown["name"] == project.name
    return {each["name"]: each for each in shown["chapters"]}


@pytest.fixture
def page(browser: Browser) -> Iterator[Page]:
    with new_context(browser) as context:
        yield context.new_page()


def test_a_document_is_there_with_its_proofs_its_tests_and_what_they_reach(
    chapters: Mapping[str, Any],
) -> None:
    patrol = chapters["patrol"]
    assert patrol["path"] == "patrol.xml"
    assert patrol["proved"]
    assert patrol["failures"] == []
    assert {each["name"]: each["outcome"] for each in patrol["tests"]} == {
        "test_it_goes_soon": "passed",
        "test_it_never_waits": "failed",
    }
    entered = {(each["automaton"], each["id"]) for each in patrol["passed"] if each["kind"] == "state"}
    assert entered == {(1, 1), (1, 2), (2, 1)}


def test_what_is_wrong_with_a_document_is_said_and_nothing_else_is_lost(chapters: Mapping[str, Any]) -> None:
    assert [*chapters] == ["broken", "hostile", "patrol", "refuted", "wrong"]
    assert chapters["broken"]["document"] is None
    assert "mismatched tag" in json.dumps(chapters["broken"]["failures"])
    wrong = chapters["wrong"]
    assert wrong["document"]["automata"][0]["states"][0]["name"] == "only"
    assert [each["severity"] for each in wrong["problems"]].count("error") == 1
    assert wrong["seconds"] == 0  # nothing of it ran


def test_nothing_runs_if_that_is_not_wanted_and_a_page_is_not_overwritten(tmp_path: Path) -> None:
    (tmp_path / "ran.xml").write_text(
        document(sub(1, 0, state(1, "only", f"open({str(tmp_path / 'ran')!r}, 'w')", initial=True)))
    )
    arguments = ("document", "ran.xml", "--no-run")
    assert run_here(app, "visualhfsm", *arguments, cwd=tmp_path).returncode == 0
    assert not (tmp_path / "ran").exists()
    again = run_here(app, "visualhfsm", *arguments, cwd=tmp_path)
    assert again.returncode == 2
    assert "--force" in again.stderr


def test_the_page_shows_it_all_and_a_state_leads_to_its_automaton(project: Path, page: Page) -> None:
    asked: list[str] = []
    page.on("request", lambda request: asked.append(request.url))
    page.on("dialog", lambda dialog: pytest.fail(f"a document ran a script: {dialog.message}"))
    check(page, project / "page.html")
    assert all(url.startswith(("file:", "data:")) for url in asked)
    patrol = page.get_by_role("article").nth(2)
    for text in (
        "Walk about.",
        "Holds in every run.",
        "test_it_goes_soon",
        "1 of 1 lines passed",
        "after 1 min",
    ):
        expect(patrol.get_by_text(text).first).to_be_visible()
    expect(patrol.get_by_text("patrol / back: never fired")).to_be_visible()
    expect(page.get_by_role("article").nth(3).get_by_text("Violated.")).to_be_visible()
    expect(page.get_by_role("heading", name=f"State {HOSTILE}")).to_be_visible()
    patrol.locator("figure").first.get_by_role("link", name="go").click()
    assert page.url.endswith("#d2a2")
    expect(patrol.get_by_role("heading", name="State inside, initial")).to_be_in_viewport()


def test_the_page_is_spanish_for_who_reads_spanish_and_fits_a_phone(project: Path, browser: Browser) -> None:
    with new_context(browser, "es-ES") as context:
        page = context.new_page()
        page.set_viewport_size({"width": 390, "height": 844})
        page.goto((project / "page.html").as_uri())
        expect(page.get_by_text("Se cumple en todas las ejecuciones.").first).to_be_visible()
        expect(page.get_by_role("columnheader", name="Veredicto").first).to_be_visible()
        assert page.evaluate(TOO_WIDE) == []
