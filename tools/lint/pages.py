"""Pages of docs/: links lead somewhere, lines are short, indexes are whole, and what is named is there."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Final

from tools.lint.sources import ROOT, TESTS

DOCS: Final = ROOT / "docs"
PAGES: Final = sorted(
    (*DOCS.rglob("*.md"), *ROOT.glob("plugins/*/docs/*.md"), *ROOT.glob("plugins/*/README.md"))
)
LONGEST: Final = 120
LINK: Final = re.compile(r"\]\((?!https?:)([^)#]+)[^)]*\)")
AS_WRITTEN: Final = re.compile(r"\||<scxml ")
"""Rows of tables, and a line that is shown as our program writes it, may be longer."""
SHORTENED: Final = ROOT / "visualhfsm/_editor/static"
"""The folder of the page's modules, which a step of contribute.md names once."""
MADE: Final = {"naoserver/bodies/rover/rover.json"}
"""What a step of contribute.md makes."""


def mistakes() -> Iterator[str]:
    """Yield the mistakes of all pages."""
    yield from _links()
    yield from _long_lines()
    yield from _index()
    yield from _index_of_decisions()
    yield from _recipes()
    yield from _promises()


def _links() -> Iterator[str]:
    if sum(len(LINK.findall(page.read_text("utf-8"))) for page in PAGES) <= len(PAGES):
        yield "docs/: its links are not found any more"
    for page in (ROOT / "README.md", *PAGES):
        for link in LINK.findall(page.read_text("utf-8")):
            if not (page.parent / link).exists() and not _is_of_absent_plug_in(page.parent / link):
                yield f"{page.relative_to(ROOT)}: {link} is not there"


def _is_of_absent_plug_in(path: Path) -> bool:
    """Return whether a path is one of a plug-in whose folder was deleted, which breaks no page."""
    parts = Path(os.path.normpath(path)).relative_to(ROOT).parts
    return parts[0] == "plugins" and len(parts) > 1 and not (ROOT / "plugins" / parts[1]).exists()


def _long_lines() -> Iterator[str]:
    for page in (*ROOT.glob("*.md"), *PAGES):
        for number, line in enumerate(page.read_text("utf-8").splitlines(), start=1):
            if len(line) > LONGEST and not AS_WRITTEN.match(line.lstrip()):
                yield f"{page.relative_to(ROOT)}:{number}: the line is longer than {LONGEST}"


def _index() -> Iterator[str]:
    index = (DOCS / "README.md").read_text("utf-8")
    for page in PAGES:
        name = os.path.relpath(page, DOCS)
        if page.parent.name != "decisions" and page.name != "README.md" and f"({name})" not in index:
            yield f"docs/README.md: it has no link to {name}"


def _index_of_decisions() -> Iterator[str]:
    folder = DOCS / "decisions"
    index = (folder / "README.md").read_text("utf-8")
    listed = {
        (name, f"{int(number):04}: {title}")
        for number, title, name in re.findall(r"^- \[(\d+): (.*)\]\((.*)\)$", index, re.M)
    }
    there = {
        (page.name, page.read_text("utf-8").split("\n", 1)[0].removeprefix("# "))
        for page in folder.glob("[0-9]*.md")
    }
    for name, title in sorted(listed ^ there):
        yield f"docs/decisions/README.md: {name}, {title!r}, is in one of index and folder alone"


def _recipes() -> Iterator[str]:
    """Yield the files and folders that the steps of contribute.md name, and that are not there."""
    page = (DOCS / "how-to/contribute.md").read_text("utf-8")
    named = {*re.findall(r"[\w.-]+/[\w./-]+", " ".join(re.findall(r"`([^`]+)`", page)))} - MADE
    if len(named) <= 30:
        yield "docs/how-to/contribute.md: what it names is not found any more"
    for name in sorted(named):
        if _is_of_absent_plug_in(ROOT / name):
            continue
        if not ((ROOT / name).exists() or (SHORTENED / name).exists()):
            yield f"docs/how-to/contribute.md: {name} is not there"


def _promises() -> Iterator[str]:
    """Yield the rows of pages on safety without a test of their house, or with one that is not there."""
    shipped = ROOT / "naoserver" / "conformance"
    yield from _promises_of(DOCS / "explanation/robot-safety.md", [TESTS, shipped])
    for page in ROOT.glob("plugins/*/docs/safety.md"):
        yield from _promises_of(page, [page.parents[1] / "tests"])


def _promises_of(page: Path, folders: Iterable[Path]) -> Iterator[str]:
    rows = re.findall(r"^\| (?!promise|-)(.*?) \| (.*) \|$", page.read_text("utf-8"), re.M)
    if not rows:
        yield f"{page.relative_to(ROOT)}: its promises are not found any more"
    files = (file for folder in folders for file in folder.rglob("test_*.py"))
    code = "\n".join(file.read_text("utf-8") for file in files)
    defined = set(re.findall(r"^\s*(?:def|class) (\w+)", code, re.M))
    for promise, tests in rows:
        named = re.findall(r"`(\w+)`", tests)
        if not named or set(named) - defined:
            missing = ", ".join(sorted(set(named) - defined)) or "a test"
            yield f"{page.relative_to(ROOT)}: {promise!r} lacks {missing}"
