"""The paths that the architecture and the decisions name are there."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Final

import pytest

from tests.support.pages import DOCS
from tests.support.places import ROOT
from tests.support.plugins import OF_THE_WHOLE

_TABLE: Final = re.compile(r"(?P<before>[^\n]*)\n\n(?P<rows>(?:\|.*\n)+)")
_PATH: Final = re.compile(r"`((?:[\w.-]+/)*(?:[\w-]+\.(?:py|js|toml|idl|xml|md|json|sh)|[\w.-]+/))`")
_PACKAGE: Final = re.compile(r"`((?:hfsm|nao|naoserver|visualhfsm|zenoh)_\w+)[`.]")
_GONE: Final = re.compile(r"^Gone or renamed since: .*?(?=\n\n|\Z)", re.MULTILINE | re.DOTALL)
_BRACKETS: Final = re.compile(r"\([^)]*\)")


def test_each_path_in_a_table_of_the_architecture_is_there() -> None:
    """A path stands below the root, what heads its table, a folder of its row, or beside a file before it."""
    for table in _TABLE.finditer((ROOT / "ARCHITECTURE.md").read_text("utf-8")):
        head, _, *rows = table["rows"].splitlines()
        heads = [ROOT / each for each in _PATH.findall(table["before"] + head) if each.endswith("/")]
        for row in rows:
            bases = [ROOT, *heads]
            for path in _PATH.findall(row):
                found = [base / path for base in bases if (base / path).exists()]
                assert found, f"ARCHITECTURE.md names {path}, which is not there, in {row[:60]}..."
                bases += [each if each.is_dir() else each.parent for each in found]


@pytest.fixture(scope="module")
def there() -> set[str]:
    """All files and folders of the repository, each by every end of its path."""
    whole: set[Path] = set()
    for folder, folders, files in os.walk(ROOT):
        folders[:] = [
            each for each in folders if each[0] != "." and each not in ("__pycache__", "node_modules")
        ]
        whole |= {Path(folder, each).relative_to(ROOT) for each in (*folders, *files)}
    return {"/".join(path.parts[begin:]) for path in whole for begin in range(len(path.parts))}


@OF_THE_WHOLE
@pytest.mark.parametrize("page", sorted(DOCS.glob("decisions/0*.md")), ids=lambda page: page.stem)
def test_what_a_decision_names_is_there_or_is_said_to_be_gone(page: Path, there: set[str]) -> None:
    """A page ends with the names that are gone, and in brackets those that they have now."""
    text = page.read_text("utf-8")
    said = _BRACKETS.sub("", "".join(_GONE.findall(text)))
    named = {*_PATH.findall(text), *_PACKAGE.findall(text)}
    gone = {each for each in named if each.rstrip("/") not in there}
    assert gone == {*re.findall("`([^`]+)`", said)}
