"""Findings about others' libraries have the form of CONTRIBUTING.md; `make findings` runs them."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from itertools import takewhile
from pathlib import Path
from typing import Final

from tools.lint.sources import ROOT

HEAD: Final = ("Setting: ", "Guess: ", "Seen", "Fails if ")
"""How the paragraphs of a head begin, in their order."""
CLEANED: Final = """\
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"""
END: Final = 'diff "$folder/expected" "$folder/seen"\necho "as found"\n'
LONGEST: Final = 120
HOST: Final = re.compile(r"https?://\S|--(?:extra-)?index-url|\bpypi\b|(?:^|\s)-i\s+http", re.IGNORECASE)
NAMESPACE: Final = "http://www.ros.org/wiki/xacro"  # the only address: that of a vocabulary of XML
INSTALLS: Final = re.compile(r'pip" install --quiet --no-compile((?:[^\\\n]|\\\n)*)')


def mistakes() -> Iterator[str]:
    """Yield what is wrong with each finding."""
    for path in sorted((*ROOT.glob("findings/*"), *ROOT.glob("plugins/*/findings/*"))):
        for mistake in _mistakes_of(path):
            yield f"{path.relative_to(ROOT)}: {mistake}"


def _mistakes_of(path: Path) -> Iterator[str]:
    text = path.read_text("utf-8")
    lines = text.splitlines()
    head = [line.removeprefix("# ") for line in takewhile(lambda line: line.startswith("#"), lines[3:])]
    begun = [next((each for each in HEAD if line.startswith(each)), "") for line in head]
    wrong = {
        "its name does not end with .sh": path.suffix != ".sh",
        "it is not executable": not os.access(path, os.X_OK),
        "it does not begin with #!/bin/sh, a sentence and an empty comment": (
            (lines[0], lines[2]) != ("#!/bin/sh", "#") or not re.fullmatch(r"# \S.*\.", lines[1])
        ),
        f"its head does not have {', '.join(HEAD)} in this order": [each for each in begun if each]
        != [*HEAD],
        "the end of its head does not say what it needs": not any("Needs " in line for line in head[-2:]),
        "it does not say that it uses the Python Package Index": (
            "Python Package Index" not in " ".join(head)
        ),
        "it does not work in a folder that is removed": CLEANED not in text,
        "it does not end with the comparison": not text.endswith(END),
        f"a line is longer than {LONGEST}": any(len(line) > LONGEST for line in lines),
        "it names a registry's host or an address": HOST.search(text.replace(NAMESPACE, "")) is not None,
    }
    yield from (mistake for mistake, is_so in wrong.items() if is_so)
    installed = [command.replace("\\\n", " ").split() for command in INSTALLS.findall(text)]
    if len(installed) != 1 or not installed[0]:
        yield "it does not install packages with one command"
    for package in (each for packages in installed for each in packages):
        if not re.fullmatch(r"[\w-]+==[\w.]+", package):
            yield f"{package} has no version"
