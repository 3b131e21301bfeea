"""The pages of docs/: their links work, and they explain every option of `codegen`."""

from __future__ import annotations

import re

import pytest
import typer

from codegen.command import app
from tests.support.pages import DOCS

PAGES = sorted(DOCS.rglob("*.md"))
LONGEST_LINE = 120


def test_links_lead_somewhere() -> None:
    links = [
        (page, link)
        for page in PAGES
        for link in re.findall(r"\]\((?!https?:)([^)#]+)[^)]*\)", page.read_text("utf-8"))
    ]
    assert len(links) > len(PAGES)
    assert [(str(page), link) for page, link in links if not (page.parent / link).exists()] == []


def test_lines_are_short_enough_for_a_diff() -> None:
    written = re.compile(r"\||<scxml ")  # rows of tables, and a line that is shown as our program writes it
    long = [
        f"{page.relative_to(DOCS.parent)}:{number}"
        for page in [*DOCS.parent.glob("*.md"), *PAGES]
        for number, line in enumerate(page.read_text("utf-8").splitlines(), start=1)
        if len(line) > LONGEST_LINE and not written.match(line.lstrip())
    ]
    assert long == []


def test_the_site_has_no_program_of_the_folder() -> None:
    config = pytest.importorskip("mkdocs.config", reason="needs the packages of visualhfsm[docs]")
    left_out = config.load_config(str(DOCS.parent / "mkdocs.yml")).exclude_docs
    assert left_out.match_file("hooks.py")
    assert left_out.match_file("__pycache__/hooks.cpython-311.pyc")


def test_the_navigation_has_every_page() -> None:
    yaml = pytest.importorskip("yaml", reason="needs the packages of visualhfsm[docs]")
    nav = yaml.safe_load((DOCS.parent / "mkdocs.yml").read_text("utf-8"))["nav"]
    written = {str(page.relative_to(DOCS)) for page in PAGES if page.parent.name != "decisions"}
    made = {"explanation/architecture.md", "changelog.md", "contributing.md"}  # by docs/hooks.py
    assert sorted(leaves(nav)) == sorted(written | made)


def leaves(nav: object) -> list[str]:
    match nav:
        case str():
            return [nav]
        case list():
            return [page for entry in nav for page in leaves(entry)]
        case dict():
            return [page for entry in nav.values() for page in leaves(entry)]
    raise TypeError(nav)


def test_the_index_links_to_every_page() -> None:
    index = (DOCS / "README.md").read_text("utf-8")
    listed = {page for page in PAGES if page.parent.name != "decisions" and page.name != "README.md"}
    assert [page.name for page in listed if f"({page.relative_to(DOCS)})" not in index] == []


def test_the_index_of_decisions_has_each_once_by_its_title() -> None:
    index = (DOCS / "decisions" / "README.md").read_text("utf-8")
    pages = [page for page in PAGES if page.parent.name == "decisions" and page.name != "README.md"]
    titles = {page.name: page.read_text("utf-8").split("\n", 1)[0].removeprefix("# ") for page in pages}
    listed = re.findall(r"^- \[(\d+): (.*)\]\((.*)\)$", index, re.MULTILINE)
    assert sorted((name, f"{int(number):04}: {title}") for number, title, name in listed) == sorted(
        titles.items()
    )


def test_every_option_of_codegen_is_explained() -> None:
    text = (DOCS / "reference/codegen.md").read_text("utf-8")
    names = {option for param in typer.main.get_command(app).params for option in param.opts}
    options = {name for name in names if name.startswith("-")}
    assert "--watch" in options
    assert {
        name for name in options - {"--help"} if f"`{name}" not in text and f" {name}" not in text
    } == set()
