"""The words that were retired stay retired: every text of the clean folders uses the field's words instead."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import pytest

from tests.support.processes import REPOSITORY

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

CLEAN: Final = (
    "ballmover",
    "benchmarks",
    "behaviors",
    "codegen",
    "deploy",
    "tools",
    "docs",
    "examples",
    "hfsm_runtime",
    "interfaces",
    "naoserver",
    "naoserver_sim",
    "tests",
    "visualhfsm",
    "zenoh_ice",
    "zenoh_ros2",
    "ARCHITECTURE.md",
    "CONTRIBUTING.md",
    "Makefile",
    "README.md",
    "mkdocs.yml",
    "pyproject.toml",
)
SUFFIXES: Final = frozenset(
    {
        ".css",
        ".csv",
        ".html",
        ".idl",
        ".js",
        ".json",
        ".md",
        ".py",
        ".pyi",
        ".sh",
        ".toml",
        ".xml",
        ".yml",
        "",
    }
)
HIDDEN: Final = frozenset({"node_modules", "__pycache__"})
VENDORED: Final = frozenset(
    REPOSITORY / each
    for each in ("tests/support/vendor", "visualhfsm/_web/static/languages", "visualhfsm/_web/static/vendor")
)
"""Libraries of others, and catalogs, which repeat what the code says."""


def word(pattern: str) -> re.Pattern[str]:
    """Return the pattern of a word by itself."""
    # In identifiers, too: words are apart at underscores, but `file.tell()` is Python's.
    return re.compile(rf"(?<![^\W_])(?<!\.)(?:{pattern})(?![^\W_])", re.IGNORECASE)


WORDS: Final = {word(pattern): instead for pattern, instead in RETIRED.items()}
ANY: Final = re.compile(rf"\b(?:{'|'.join(RETIRED)})\b")
"""Any of them, in lower case, where underscores are spaces."""
SPACES: Final = str.maketrans(dict.fromkeys("\n\r\t\f\v\xa0", " "))


def retired(text: str) -> Iterator[tuple[int, str, str]]:
    """Yield the line, the retired word and what to write instead, for each in a text."""
    flat = text.translate(SPACES)  # a phrase may go on in the next line
    if ANY.search(flat.lower().replace("_", " ")) is None:  # as nearly always: it takes a tenth of the time
        return
    for pattern, instead in WORDS.items():
        for found in pattern.finditer(flat):
            yield text.count("\n", 0, found.start()) + 1, found[0], instead


def texts(place: Path) -> Iterator[Path]:
    if place.is_file():
        yield place
        return
    for folder, folders, names in os.walk(place):
        here = Path(folder)
        folders[:] = [each for each in folders if each not in HIDDEN and here / each not in VENDORED]
        for path in (here / name for name in names):
            left_out = path.name == "package-lock.json" or path == Path(__file__)
            if path.suffix in SUFFIXES and not left_out:
                yield path


@pytest.mark.parametrize("name", CLEAN)
def test_retired_words_stay_retired(name: str) -> None:
    problems = [
        f"{path.relative_to(REPOSITORY)}:{line}: {word!r} is retired, write: {instead}"
        for path in sorted(texts(REPOSITORY / name))
        for line, word, instead in sorted(retired(path.read_text("utf-8", "replace")))
    ]
    assert not problems, "\n" + "\n".join(problems)


def test_every_package_is_clean() -> None:
    packages = {path.parent.name for path in REPOSITORY.glob("*/__init__.py")}
    assert packages <= set(CLEAN), "add the new package to CLEAN"


@pytest.mark.parametrize(
    ("text", "line", "word"),
    [
        ("Errors are told.", 1, "told"),
        ("def test_an_end_is_told_once(", 1, "told"),
        ("a process of\nits own", 1, "of its own"),
        ("\nBegin Anew", 2, "Anew"),
    ],
)
def test_retired_words_are_found_in_prose_and_names(text: str, line: int, word: str) -> None:
    assert [found[:2] for found in retired(text)] == [(line, word)]


@pytest.mark.parametrize("text", ["place = file.tell()", "storytelling and intelligent strangers", "retold"])
def test_other_words_are_left_alone(text: str) -> None:
    assert list(retired(text)) == []
