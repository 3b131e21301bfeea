"""Constants say what they are: a bare verb or adjective says neither what nor in which unit.

A limit of time is a `_LIMIT`, what repeats has a `_PERIOD`, what comes later a `_DELAY`; a limit of size is that of
something (`_MOST_CALLS`, `_LONGEST_TEXT`). The unit stands in the comment beside it, or in the docstring below it.
"""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Final

import pytest

from tests.support.places import ROOT

BARE: Final = re.compile(
    r"^_?(?:AGAIN|ANSWER|ASK|ASKING|CLOSE|CONNECTING|DEEPEST|END|ENDING|FARTHEST|FASTEST|HANGS|HIGHEST|HOLD|LARGEST|LATE"
    r"|LONG|LONGEST|LOOK|LOOK_AGAIN|LOWEST|MOST|PATIENCE|PAUSE|POLL|QUIET|RETRY|SETTLING|SHORTEST|SLOWEST|STOP|TRIES"
    r"|WAIT|WIDEST)(?:: [^=]+)? = (?![\"'])",
    re.MULTILINE,
)
"""Such a constant, except texts."""


def packages() -> list[Path]:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
    return [ROOT / name for name in project["tool"]["hatch"]["build"]["targets"]["wheel"]["packages"]]


@pytest.mark.parametrize("package", packages(), ids=lambda path: path.name)
def test_constants_say_what_they_are(package: Path) -> None:
    bare = {
        str(path.relative_to(ROOT)): found[0].rstrip(" =")
        for path in sorted(package.rglob("*.py"))
        if (found := BARE.search(path.read_text("utf-8"))) is not None
    }
    assert bare == {}


@pytest.mark.parametrize("line", ["_END: Final = 2.0", "MOST = 10", "_PATIENCE: Final = (5.0, 3.0)"])
def test_bare_words_are_found(line: str) -> None:
    assert BARE.search(line)


@pytest.mark.parametrize("line", ["_END_LIMIT: Final = 2.0", 'END = "end"', '_STOP: Final = "emergencyStop"'])
def test_names_and_texts_are_left_alone(line: str) -> None:
    assert not BARE.search(line)
