"""plugins/learning/docs/learning.md: its programs print the documented output, and it lists every environment."""

from __future__ import annotations

import sys
from pathlib import Path
from types import ModuleType

import pytest

from tests.support.pages import Block, blocks_of
from tests.support.places import ROOT
from visualhfsm_learning import ENVIRONMENTS

pytestmark = pytest.mark.sim

PAGE = (ROOT / "plugins/learning/docs/learning.md").read_text("utf-8")
BLOCKS = blocks_of(PAGE)


def example(name: str, monkeypatch: pytest.MonkeyPatch, **smaller: object) -> ModuleType:
    """Load one of the examples, with constants that make it shorter."""
    module = ModuleType(name)
    monkeypatch.setitem(sys.modules, name, module)
    folders = Path(__file__).parents[2] / "examples", ROOT / "examples"
    file = next(file for folder in folders if (file := folder / f"{name}.py").exists())
    exec(file.read_text("utf-8"), vars(module))
    for constant, value in smaller.items():
        assert isinstance(getattr(module, constant), type(value))
        monkeypatch.setattr(module, constant, value)
    return module


@pytest.mark.parametrize(
    ("code", "output"), list(zip(BLOCKS[::2], BLOCKS[1::2], strict=True)), ids=["robot", "learning"]
)
def test_a_program_prints_what_the_page_says(
    code: Block, output: Block, capsys: pytest.CaptureFixture[str]
) -> None:
    assert (code.language, output.language) == ("python", "text")
    exec(code.text, {"__name__": "__main__"})
    assert capsys.readouterr().out == output.text


def test_every_environment_has_its_row() -> None:
    for name, steps in ENVIRONMENTS.items():
        (row,) = [
            line for line in PAGE.splitlines() if line.startswith(f"| `{name}` | ") and " steps |" in line
        ]
        assert f"| {steps} steps |" in row


def test_the_walk_of_the_example_goes_round(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    example("one_process", monkeypatch, SIDE=0.1).main()
    *_, last = capsys.readouterr().out.splitlines()
    assert last.startswith("side 4: believes to be at (")


def test_the_example_learns(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    example("learn_to_reach", monkeypatch, PAIRS=2, STEPS=10).main(1)
    before, after = (float(line.split()[-3]) for line in capsys.readouterr().out.splitlines())
    assert -1.0 < before < 1.0
    assert -1.0 < after < 1.0
