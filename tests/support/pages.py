"""Read the pages of docs/ and of plug-ins: their sections and their blocks of code."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass, field
from pathlib import Path

DOCS = Path(__file__).parents[2] / "docs"


def pages(*folders: str) -> list[str]:
    """Return the pages in folders of docs/ and those of all plug-ins, as paths from docs/."""
    paths = [path for folder in folders for path in (DOCS / folder).rglob("*.md")]
    return sorted(os.path.relpath(path, DOCS) for path in (*paths, *DOCS.parent.glob("plugins/*/docs/*.md")))


_BLOCK = re.compile(r"(?:^`(?P<name>[^`\n]+)`:\n\n)?^```(?P<info>[^\n]*)\n(?P<text>.*?)^```$", re.M | re.S)


@dataclass(frozen=True)
class Block:
    """A block of code: its language and the words after it, its text, and the name of its file."""

    info: str
    text: str
    name: str | None = None

    @property
    def language(self) -> str:
        return self.info.split()[0] if self.info else ""


@dataclass(frozen=True)
class Section:
    """The content below a heading."""

    title: str
    text: str
    blocks: list[Block] = field(default_factory=list)


def blocks_of(text: str) -> list[Block]:
    """Return the blocks of code in order."""
    return [Block(match["info"].strip(), match["text"], match["name"]) for match in _BLOCK.finditer(text)]


def sections_of(page: str) -> list[Section]:
    """Return the sections of the second level of a page."""
    text = (DOCS / page).read_text("utf-8")
    _, *parts = re.split(r"^## ", text, flags=re.M)
    return [Section(part.partition("\n")[0], part, blocks_of(part)) for part in parts]
