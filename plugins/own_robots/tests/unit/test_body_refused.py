"""Models that are refused: the first line of each file in ../data/bad_models says what its error says."""

from __future__ import annotations

from pathlib import Path

import pytest

from naoserver.errors import RobotError
from tests.support.models import FOLDER
from visualhfsm_own_robots import read_own_body

pytestmark = pytest.mark.sim

BAD = Path(__file__).parents[1] / "data" / "bad_models"
MODELS = sorted(path for path in BAD.iterdir() if path.is_file())
"""What they include is in a folder below, and the models that files of TOML name are with the good ones."""


def expected(path: Path) -> str:
    """Return what is to be said of a model."""
    comment = path.read_text("utf-8").partition("\n")[0]
    return comment.partition("refused: ")[2].removesuffix(" -->")


@pytest.mark.parametrize("path", MODELS, ids=lambda path: path.name)
def test_a_bad_model_is_refused_with_line_and_name(path: Path) -> None:
    beside, text = (FOLDER, path.read_text("utf-8")) if path.suffix == ".toml" else (BAD, None)
    with pytest.raises(RobotError) as refused:
        read_own_body(beside / path.name, text)
    said = str(refused.value).replace(f"{beside}/", "").partition("\n")[0]
    if (begin := expected(path)).endswith("…"):
        assert said.startswith(begin.removesuffix("…"))
    else:
        assert said == begin
