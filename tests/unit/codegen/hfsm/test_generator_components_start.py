"""Every generated component can be imported, finds its proxies and starts, with stand-ins for what it uses."""

from __future__ import annotations

from pathlib import Path

import pytest

from codegen.source_rows import SOURCE_MAP
from tests.support.codegen_command import ROOT
from tests.support.documents import load
from visualhfsm.simulation import Behavior

COMPONENTS = [
    path
    for folder in ("behaviors", "examples", "tests/data/components")
    for path in sorted((ROOT / folder).rglob("*.py"))
    if f"{SOURCE_MAP} = " in path.read_text()
]


@pytest.mark.parametrize("file", COMPONENTS, ids=lambda path: path.stem)
def test_it_starts(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(file.parent)  # for hand-written code beside it
    component = load(file)
    with Behavior(component, robot="fake", stand_ins=True) as run:
        run.advance(1.0)
        assert run.tree.root.cycle.count > 1


def test_all_of_them_are_there() -> None:
    assert len(COMPONENTS) > 15
