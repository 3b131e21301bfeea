"""The pages of docs/: the site has all of them, and they explain every option of `codegen`."""

from __future__ import annotations

from types import SimpleNamespace

import pytest
import typer

from codegen.command import app
from tests.support.pages import DOCS

PAGES = sorted(DOCS.rglob("*.md"))


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


def test_every_option_of_codegen_is_explained() -> None:
    text = (DOCS / "reference/codegen.md").read_text("utf-8")
    names = {option for param in typer.main.get_command(app).params for option in param.opts}
    options = {name for name in names if name.startswith("-")}
    assert "--watch" in options
    assert {
        name for name in options - {"--help"} if f"`{name}" not in text and f" {name}" not in text
    } == set()


def test_links_out_of_the_site_become_paths_whatever_stands_before_them() -> None:
    hooks = pytest.importorskip("docs.hooks", reason="needs the packages of visualhfsm[docs]")
    page = SimpleNamespace(file=SimpleNamespace(generated_by=None, src_uri="how-to/x.md"))
    text = "[`--far`](#far) and `near`\n\n[a](lab.md#b) `c` [d](../../interfaces/motions.idl)"
    turned = hooks.on_page_markdown(text, page, None, None)
    assert turned == text.replace("[d](../../interfaces/motions.idl)", "d (`interfaces/motions.idl`)")
