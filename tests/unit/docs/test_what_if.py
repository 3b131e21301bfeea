"""docs/how-to/what-if.md names each kind of failure, and how much is usual."""

from __future__ import annotations

import re

import pytest

from naoserver.bodies import find_body
from naoserver.bodies.faults import kinds_of
from tests.support.pages import DOCS

PAGE = (DOCS / "how-to/what-if.md").read_text("utf-8")
ROWS: dict[str, str] = {}
for kind_, text_ in re.findall(r"^\| [^|]*\| `(\w+)` \| (.*) \|$", PAGE, re.M):
    if kind_ != "stuck":
        ROWS[kind_] = ROWS.get(kind_, "") + text_  # a camera and a link are late


@pytest.mark.parametrize("name", ["H25", "T1", "G1", "Cart"])
def test_every_kind_has_its_row(name: str) -> None:
    kinds = {kind for each in kinds_of(find_body(name), physics=True).values() for kind in each}
    assert {kind.name for kind in kinds} - {"stuck"} <= ROWS.keys()
    for kind in kinds:
        if kind.unit and kind.name != "hot":
            assert f"({kind.usual:g}" in ROWS[kind.name] or f"({kind.usual:g})" in ROWS[kind.name], kind


def test_every_row_is_of_a_kind() -> None:
    kinds = {kind.name for each in kinds_of(find_body("H25"), physics=True).values() for kind in each}
    assert ROWS.keys() <= kinds
