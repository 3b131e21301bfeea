"""The words that were retired stay retired in what users read: documentation, texts, and the docstrings of the API."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import pytest

from tests.support.places import ROOT

RETIRED: Final = {
    r"tells?|told|telling": "report, log, return, notify, say or distinguish",
    r"whoever": "the caller, anybody who",
    r"anew": "again; begin anew: restart",
    r"lately": "recently",
    r"beforehand": "in advance",
    r"manners?": "way, mode",
    r"errands?": "call, job",
    r"strands?": "thread",
    r"mends?|mended|mending": "fix, repair",
    r"of (?:its|their) own": "its own, separate, another",
    r"those who": "users, clients, callers",
    r"amiss": "wrong",
    r"in vain": "without success",
    r"bound for": "on the way to",
    r"now and then": "sometimes, periodically",
    r"any longer": "any more",
    r"be had": "available",
    r"all the same": "anyway, nevertheless",
    r"as it were": "nothing",
    r"went away": "was lost, is offline",
    r"for ever": "forever, without end",
    r"(?:by|in) turns": "alternately",
    r"of old(?! \w)": "old, former",
    r"take commands again|takes commands again": "accept commands again",
}
"""Patterns of retired words, and what to write instead."""

SUFFIXES: Final = frozenset({".html", ".idl", ".md", ".toml", ".xml", ".yml"})
"""Files that are read whole; of Python the docstrings and texts."""
TEXTS: Final = re.compile(r'"""(.+?)"""|"((?:[^"\\\n]|\\.)*)"', re.DOTALL)
UNREAD: Final = frozenset({"benchmarks", "node_modules", "tests", "tools", "vendor"})
PAGE: Final = "visualhfsm/_editor/static/languages/es.json"
"""The texts of the editor's page, each with its translation."""
SEARCHED: Final = "speak talk voice text tell word sentence hello"
"""Words that users of the page may search for."""
WORDS: Final = {
    re.compile(rf"(?<!\.)\b(?:{pattern})\b".replace(" ", r"\s+"), re.IGNORECASE): instead
    for pattern, instead in RETIRED.items()
}
"""Each as a word by itself; `file.tell()` is Python's."""


def retired(text: str) -> Iterator[tuple[str, str]]:
    """Yield each retired word of a text, and what to write instead."""
    for pattern, instead in WORDS.items():
        yield from ((found[0], instead) for found in pattern.finditer(text))


def texts(path: Path) -> str:
    """Return what users read of a file."""
    text = path.read_text("utf-8")
    if path.suffix != ".py":
        return text
    return "\n".join(first or second for first, second in TEXTS.findall(text))


def test_retired_words_stay_retired() -> None:
    paths = [
        path
        for folder in ROOT.iterdir()
        if folder.is_dir() and not folder.name.startswith(".") and folder.name not in UNREAD
        for path in folder.rglob("*")
        if path.suffix in SUFFIXES | {".py"} and not UNREAD & {*path.parts}
    ]
    paths += [ROOT / name for name in ("ARCHITECTURE.md", "CONTRIBUTING.md", "README.md", "mkdocs.yml")]
    assert len(paths) > 1000
    problems = [
        f"{path.relative_to(ROOT)}: {word!r} is retired, write: {instead}"
        for path in paths
        for word, instead in retired(texts(path).replace(SEARCHED, ""))
    ]
    assert not problems, "\n" + "\n".join(problems)


def test_retired_words_stay_retired_on_the_page() -> None:
    shown = json.loads((ROOT / PAGE).read_text("utf-8"))
    assert [(text, found) for text in shown.keys() - {SEARCHED} for found in retired(text)] == []


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("Errors are told.", ["told"]),
        ("a process of\nits own", ["of\nits own"]),
        ("place = file.tell(), storytelling and intelligent strangers, retold", []),
    ],
)
def test_retired_words_are_found(text: str, words: list[str]) -> None:
    assert [word for word, _ in retired(text)] == words
