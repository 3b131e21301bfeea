"""NOTICES.txt: it names whatever the distributions hold of others."""

from __future__ import annotations

import re
import tomllib
from typing import Final

from tests.support.places import ROOT

NOTICES: Final = (ROOT / "NOTICES.txt").read_text("utf-8")


def test_each_package_of_ros_has_its_licence() -> None:
    folders = [*ROOT.glob("*/definitions"), *ROOT.glob("plugins/*/definitions")]
    packages = {path.name for folder in folders for path in folder.iterdir()}
    assert packages
    assert packages == {*re.findall(r"^   (\w+) +ros.*(?:Apache-2\.0|BSD-3-Clause)", NOTICES, re.MULTILINE)}


def test_the_notices_of_others_are_shipped() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    assert "NOTICES.txt" in project["license-files"]
    assert all((ROOT / name).is_file() for name in project["license-files"])
