"""Teach a class: marks for what is handed in, and walls around the code of strangers."""

from __future__ import annotations

import html
import re
import shutil
from pathlib import Path
from typing import Final

import pytest

from tests.support.commands import run_here
from tests.support.places import ROOT
from tests.support.plugins import needs
from visualhfsm._base.errors import VisualHfsmError
from visualhfsm._commands.app import app

LOOK: Final = ROOT / "exercises" / "look"
SOLUTION: Final = (LOOK / "solution/solution.xml").read_text("utf-8")
STEALS: Final = f"open({str(LOOK / 'solution/solution.xml')!r}).read()"
"""What a pupil could write; nothing of this machine is within reach of it."""


@needs("visualhfsm_classes")
@pytest.mark.promise(
    "exercises in English and Spanish, marks for everybody's documents, code of strangers behind walls"
)
def test_a_class_gets_marks_reasons_and_pages_and_nobody_reaches_the_solution(tmp_path: Path) -> None:
    from plugins.classes.tests.support.marks import marks_in

    exercise = tmp_path / "exercises" / "look"
    shutil.copytree(LOOK, exercise, ignore=shutil.ignore_patterns("hidden", "__pycache__"))
    brief = exercise / "exercise.toml"  # with one trial, and one mistake that is asked for
    brief.write_text(re.sub("milliseconds = 0\n|same_side = 2\n", "", brief.read_text("utf-8")), "utf-8")
    handed_in = tmp_path / "handed-in"
    handed_in.mkdir()
    (handed_in / "ana.xml").write_text(SOLUTION, "utf-8")
    shutil.copy(LOOK / "mistakes/no_way_back.xml", handed_in / "ben.xml")
    (handed_in / "eve.xml").write_text(
        SOLUTION.replace("<entry>", f"<entry>{html.escape(STEALS)}\n", 1), "utf-8"
    )

    words = ("grade", "exercises/look", "handed-in", "--language", "es")
    done = run_here(app, "visualhfsm", *words, cwd=tmp_path, expected=(VisualHfsmError,))
    assert done.returncode == 0, done.stderr
    marks = marks_in(tmp_path / "marks")
    assert [marks[name]["points"] for name in ("ana", "ben", "eve")] == ["10", "7", "0"]
    assert "cambios de lado en 9 s: 1" in marks["ben"]["reasons"]
    assert "FileNotFoundError" in marks["eve"]["reasons"]
    page = (tmp_path / "marks" / "ben.html").read_text("utf-8")
    assert "cambios de lado en 9 s: 1" in page
    assert "<iframe" in page
    assert "ben.html" in (tmp_path / "marks" / "index.html").read_text("utf-8")
