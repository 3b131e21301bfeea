"""The words that were retired stay retired: what users read uses the field's words instead.

That is the documentation, the comments of interfaces, documents and examples, and the texts of the code, of
which docstrings are shown as help and as the reference of the API. Comments and names of the code are left to
their authors.
"""

from __future__ import annotations

import ast
import json
import os
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from tools.lint.sources import ROOT

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

READ: Final = (
    *(
        "ballmover",
        "behaviors",
        "codegen",
        "deploy",
        "docs",
        "examples",
        "exercises",
        "hfsm_runtime",
        "interfaces",
    ),
    *("nao_tools", "naoserver", "naoserver_sim", "shelf", "visualhfsm", "zenoh_ice", "zenoh_ros2"),
    *("ARCHITECTURE.md", "CONTRIBUTING.md", "README.md", "mkdocs.yml"),
)
SUFFIXES: Final = frozenset({".csv", ".html", ".idl", ".json", ".md", ".py", ".toml", ".xml", ".yml"})
HIDDEN: Final = frozenset({"node_modules", "__pycache__"})
VENDORED: Final = frozenset(
    ROOT / each for each in ("visualhfsm/_editor/static/languages", "visualhfsm/_editor/static/vendor")
)
"""Libraries of others, and translations."""
PAGE: Final = ROOT / "visualhfsm/_editor/static/languages/es.json"
"""The texts of the editor's page, each with its translation."""
SEARCHED: Final = "speak talk voice text tell word sentence hello"
"""Words that users of the page may search for."""


WORDS: Final = {
    re.compile(rf"(?<!\.)\b(?:{pattern})\b", re.IGNORECASE): instead for pattern, instead in RETIRED.items()
}
"""Each as a word by itself; `file.tell()` is Python's."""
ANY: Final = re.compile(rf"\b(?:{'|'.join(RETIRED)})\b")
"""Any of them, in lower case."""
SPACES: Final = str.maketrans(dict.fromkeys("\n\r\t\f\v\xa0", " "))


def _retired(text: str) -> Iterator[tuple[int, str, str]]:
    """Yield the line, the retired word and what to write instead, for each in a text."""
    flat = text.translate(SPACES)  # a phrase may go on in the next line
    if ANY.search(flat.lower()) is None:  # as nearly always: it takes a tenth of the time
        return
    for pattern, instead in WORDS.items():
        for found in pattern.finditer(flat):
            yield text.count("\n", 0, found.start()) + 1, found[0], instead


def _retired_in_code(code: str) -> Iterator[tuple[int, str, str]]:
    """Yield the same for each in the texts of Python code."""
    if ANY.search(code.translate(SPACES).lower()) is None:
        return
    for node in ast.walk(ast.parse(code)):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            for line, word, instead in _retired(node.value):
                yield node.lineno + line - 1, word, instead


def _files(place: Path) -> Iterator[Path]:
    if place.is_file():
        yield place
        return
    for folder, folders, names in os.walk(place):
        here = Path(folder)
        folders[:] = [each for each in folders if each not in HIDDEN and here / each not in VENDORED]
        yield from (here / name for name in names if Path(name).suffix in SUFFIXES)


def mistakes() -> Iterator[str]:
    """Yield the retired words, and the packages that are not read."""
    for name in READ:
        for path in sorted(_files(ROOT / name)):
            text = path.read_text("utf-8", "replace").replace(SEARCHED, "")
            for line, word, instead in (_retired_in_code if path.suffix == ".py" else _retired)(text):
                yield f"{path.relative_to(ROOT)}:{line}: {word!r} is retired, write: {instead}"
    for text in json.loads(PAGE.read_text("utf-8")).keys() - {SEARCHED}:
        for _, word, instead in _retired(text):
            yield f"{PAGE.relative_to(ROOT)}: {text!r}: {word!r} is retired, write: {instead}"
    packages = {path.parent.name for path in ROOT.glob("*/__init__.py")}
    for package in sorted(packages - {*READ, "tests"}):
        yield f"{Path(__file__).relative_to(ROOT)}: READ lacks the package {package}"
