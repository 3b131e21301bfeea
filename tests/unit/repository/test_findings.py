"""Findings about libraries of others have the form that CONTRIBUTING.md describes; `make findings` runs them."""

from __future__ import annotations

import os
import re
from itertools import takewhile
from pathlib import Path
from typing import Final

import pytest

from tests.support.places import ROOT

FINDINGS: Final = sorted((ROOT / "findings").iterdir())
HEAD: Final = ("Setting: ", "Guess: ", "Seen", "Fails if ")
"""How the paragraphs of a head begin, in their order."""
CLEANED: Final = """\
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"""
LONGEST: Final = 120
HOST: Final = re.compile(r"https?://\S|--(?:extra-)?index-url|\bpypi\b|(?:^|\s)-i\s+http", re.IGNORECASE)
NAMESPACE: Final = "http://www.ros.org/wiki/xacro"  # the only address: that of a vocabulary of XML


@pytest.mark.parametrize("path", FINDINGS, ids=lambda path: path.name)
def test_a_finding_has_its_form(path: Path) -> None:
    text = path.read_text("utf-8")
    lines = text.splitlines()
    assert path.suffix == ".sh"
    assert os.access(path, os.X_OK), "it is not executable"
    assert (lines[0], lines[2]) == ("#!/bin/sh", "#")
    assert re.fullmatch(r"# \S.*\.", lines[1]), "the surprise is one sentence"
    head = [line.removeprefix("# ") for line in takewhile(lambda line: line.startswith("#"), lines[3:])]
    begun = [next((each for each in HEAD if line.startswith(each)), "") for line in head]
    assert [each for each in begun if each] == [*HEAD]
    assert "Needs " in head[-1] or "Needs " in head[-2]
    assert "Python Package Index" in " ".join(head)
    assert CLEANED in text
    assert text.endswith('diff "$folder/expected" "$folder/seen"\necho "as found"\n')
    assert [line for line in lines if len(line) > LONGEST] == []
    assert HOST.search(text.replace(NAMESPACE, "")) is None, "it names a registry's host or an address"


@pytest.mark.parametrize("path", FINDINGS, ids=lambda path: path.name)
def test_a_finding_pins_what_it_installs(path: Path) -> None:
    (command,) = re.findall(r'pip" install --quiet --no-compile((?:[^\\\n]|\\\n)*)', path.read_text("utf-8"))
    packages = command.replace("\\\n", " ").split()
    assert packages
    assert [each for each in packages if not re.fullmatch(r"[\w-]+==[\w.]+", each)] == []
