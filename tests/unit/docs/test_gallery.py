"""docs/gallery.md has every behavior, exercise and ready state, a picture that moves, and a line that is taken."""

from __future__ import annotations

import shlex

import pytest
from PIL import Image

from tests.support.pages import DOCS
from tests.support.processes import REPOSITORY
from tests.support.programs import app_of, take
from tools.gallery.page import PICTURES, Entry, entries

pytest.importorskip("visualhfsm_classes", reason="the page shows exercises")
ENTRIES = list(entries())
MOST_BYTES = 3_000_000
"""Of all pictures together: a page that is looked at over a slow network."""
MOST_SECONDS = 12.0


def test_nothing_is_left_out() -> None:
    shown = {each.document for each in ENTRIES}
    solutions = {
        path.parent / "solution/solution.xml" for path in REPOSITORY.glob("exercises/*/exercise.toml")
    }
    there = {*REPOSITORY.glob("behaviors/*.xml"), *REPOSITORY.glob("shelf/*.xml"), *solutions}
    assert shown == there
    assert [each.name for each in ENTRIES if each.part == "Goals"] == ["score", "score_T1", "score_G1"]


@pytest.mark.parametrize("entry", ENTRIES, ids=lambda entry: f"{entry.part} {entry.name}")
def test_an_entry_says_what_it_shows_and_its_line_is_taken(
    entry: Entry, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert entry.scene is not None, "film it: tools/gallery/scenes.py"
    assert entry.text or entry.part == "Goals"
    monkeypatch.chdir(REPOSITORY)
    program, *words = shlex.split(entry.line)
    if words[0] == "match":
        pytest.importorskip("visualhfsm_match", reason="the line is that of a match")
    take(app_of(program), program, words)


@pytest.mark.parametrize("name", sorted({each.picture for each in ENTRIES} | {"goals"}))
def test_a_picture_moves_for_some_seconds(name: str) -> None:
    lasts, different = 0.0, set()
    with Image.open(PICTURES / f"{name}.webp") as picture:
        for number in range(getattr(picture, "n_frames", 1)):
            picture.seek(number)
            different.add(picture.convert("RGB").tobytes())
            lasts += picture.info["duration"] / 1000.0
    assert len(different) > 5
    assert 2.0 < lasts < MOST_SECONDS


def test_the_pictures_are_small_and_none_is_left_over() -> None:
    files = list(PICTURES.iterdir())
    assert sum(file.stat().st_size for file in files) < MOST_BYTES
    assert {file.stem for file in files} == {each.picture for each in ENTRIES} | {"goals"}


def test_the_first_pages_lead_there() -> None:
    assert "docs/gallery.md" in (REPOSITORY / "README.md").read_text("utf-8")
    assert "docs/pictures/gallery/goals.webp" in (REPOSITORY / "README.md").read_text("utf-8")
    assert "(gallery.md)" in (DOCS / "README.md").read_text("utf-8")
