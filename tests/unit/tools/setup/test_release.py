"""What a release is made from: the version and its section in the changelog."""

from __future__ import annotations

import re
import subprocess
import tomllib

import pytest

from tests.support.limits import END_LIMIT
from tests.support.places import ROOT
from tools.workspace import DISTRIBUTIONS

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
HEADINGS = re.findall(r"^## (.*)$", (ROOT / "CHANGELOG.md").read_text("utf-8"), re.MULTILINE)


def test_the_version_is_that_of_the_newest_section_of_the_changelog_or_under_development() -> None:
    version = PROJECT["project"]["version"]
    if re.search(r"\.dev\d+$", version):
        assert HEADINGS[0] == "Unreleased"
    else:
        assert HEADINGS[0].partition(" - ")[0] == version


@pytest.mark.slow
def test_only_versions_with_a_tag_are_called_released() -> None:
    released = [heading.partition(" - ") for heading in HEADINGS if heading != "Unreleased"]
    assert all(re.fullmatch(r"\d{4}-\d\d-\d\d", date) for _, _, date in released)
    numbers = [tuple(map(int, version.split("."))) for version, _, _ in released]
    assert numbers == sorted(set(numbers), reverse=True)
    assert [date for _, _, date in released] == sorted((date for _, _, date in released), reverse=True)
    listed = subprocess.run(
        ["git", "tag"], cwd=ROOT, capture_output=True, text=True, check=True, timeout=END_LIMIT
    )
    assert {f"v{version}" for version, _, _ in released} <= set(listed.stdout.split())


def test_the_version_stands_in_one_place() -> None:
    version = re.escape(PROJECT["project"]["version"])
    pattern = re.compile(rf"__version__|^version = [\"']{version}", re.MULTILINE)
    places = {
        str(path.relative_to(ROOT))
        for package in (path for each in DISTRIBUTIONS for path in each.packages)
        for path in package.rglob("*.py")
        if pattern.search(path.read_text("utf-8"))
    }
    assert not places
