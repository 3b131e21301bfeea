"""What other distributions add to a seam, and what is said of those that do not load."""

import sys
from pathlib import Path

import pytest

from zenoh_ice import plugins

SEAM = "zenoh_ice.test_seam"


@pytest.fixture
def install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Install a distribution of one module `stranger` with entry points into a folder where Python looks."""

    def install(code: str | None, *points: str) -> None:
        if code is not None:
            (tmp_path / "stranger.py").write_text(code)
        about = tmp_path / "a_stranger-1.0.dist-info"
        about.mkdir()
        (about / "METADATA").write_text("Metadata-Version: 2.1\nName: a-stranger\nVersion: 1.0\n")
        (about / "entry_points.txt").write_text("\n".join([f"[{SEAM}]", *points]) + "\n")

    monkeypatch.syspath_prepend(tmp_path)
    yield install
    sys.modules.pop("stranger", None)
    plugins.names.cache_clear()
    plugins.find.cache_clear()


def test_what_is_installed_is_named_without_loading_it_and_loaded_once(install):
    install("made = object()", "one = stranger:made")
    assert plugins.names(SEAM) == ("one",)
    assert "stranger" not in sys.modules
    assert plugins.find(SEAM, "one") is plugins.find(SEAM, "one") is sys.modules["stranger"].made
    assert list(plugins.each(SEAM)) == [("one", sys.modules["stranger"].made)]


def test_nothing_is_installed():
    assert (plugins.names(SEAM), plugins.find(SEAM, "one"), list(plugins.each(SEAM))) == ((), None, [])


def test_what_was_removed_since_it_was_installed_is_not_there(install):
    install(None, "one = stranger:made")
    assert plugins.find(SEAM, "one") is None
    assert list(plugins.each(SEAM)) == []


@pytest.mark.parametrize(
    ("code", "why"),
    [
        ("import a_library_that_nobody_has", "No module named 'a_library_that_nobody_has'"),
        ("raise ValueError('no wheels')", "no wheels"),
        ("x = 1 +", "invalid syntax"),
        ("", "has no attribute 'made'"),
    ],
)
def test_what_cannot_be_loaded_is_named_with_its_distribution(install, code, why):
    install(code, "one = stranger:made")
    with pytest.raises(plugins.PluginError) as caught:
        plugins.find(SEAM, "one")
    assert "the plug-in one of a-stranger (stranger:made) cannot be loaded: " in str(caught.value)
    assert why in str(caught.value)
