"""NOTICES.txt names whatever the distributions hold of others."""

from __future__ import annotations

import re
from collections.abc import Iterator

from tools.lint.sources import PROJECT, ROOT


def mistakes() -> Iterator[str]:
    """Yield packages of ROS without a licence there, those that are gone, and what is not shipped."""
    folders = [*ROOT.glob("*/definitions"), *ROOT.glob("plugins/*/src/*/definitions")]
    packages = {path.name for folder in folders for path in folder.iterdir()}
    notices = (ROOT / "NOTICES.txt").read_text("utf-8")
    named = {*re.findall(r"^   (\w+) +ros.*(?:Apache-2\.0|BSD-3-Clause)", notices, re.MULTILINE)}
    if not packages:
        yield "NOTICES.txt: no definitions of ROS are found any more"
    for package in sorted(packages ^ named):
        yield f"NOTICES.txt: {package} is {'not named' if package in packages else 'gone'}"
    shipped = PROJECT["project"]["license-files"]
    for name in {*shipped, "NOTICES.txt"}:
        if name not in shipped or not (ROOT / name).is_file():
            yield f"pyproject.toml: license-files: {name} is not shipped"
