"""What other distributions add to a seam, and what is said of those that do not load."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.support import plugins as plugin
from zenoh_ice import plugins

SEAM = "zenoh_ice.test_seam"


@contextmanager
def installed(folder: Path, code: str | None) -> Iterator[None]:
    """Let a distribution be installed that adds `stranger:made` to the seam as `one`."""
    modules = {} if code is None else {"stranger": code}
    with plugin.installed(folder, {SEAM: {"one": "stranger:made"}}, **modules):
        yield


def test_what_is_installed_is_named_without_loading_it_and_loaded_once(tmp_path):
    with installed(tmp_path, "made = object()"):
        assert plugins.names(SEAM) == ("one",)
        assert "stranger" not in sys.modules
        assert plugins.find(SEAM, "one") is plugins.find(SEAM, "one") is sys.modules["stranger"].made
        assert list(plugins.each(SEAM)) == [("one", sys.modules["stranger"].made)]


def test_nothing_is_installed():
    assert (plugins.names(SEAM), plugins.find(SEAM, "one"), list(plugins.each(SEAM))) == ((), None, [])


def test_what_was_removed_since_it_was_installed_is_not_there(tmp_path):
    with installed(tmp_path, None):
        assert plugins.find(SEAM, "one") is None
        assert list(plugins.each(SEAM)) == []


def test_a_plug_in_adds_a_package_of_which_modules_are_loaded_when_they_are_asked_for(tmp_path):
    modules = {"stranger.wheels": "made = 1", "stranger.legs": "raise ValueError('no legs')"}
    with plugin.installed(tmp_path, {SEAM: {"one": "stranger"}}, **modules):
        assert plugins.find(SEAM, "one", "wheels") is sys.modules["stranger.wheels"]
        assert [(name, module.made) for name, module in plugins.each(SEAM, "wheels")] == [("one", 1)]
        assert "stranger.legs" not in sys.modules
        assert plugins.find(SEAM, "one", "arms") is None
        assert list(plugins.each(SEAM, "arms")) == []
        with pytest.raises(
            plugins.PluginError, match=r"one of a-stranger \(stranger\) cannot be loaded: no legs"
        ):
            plugins.find(SEAM, "one", "legs")


def test_a_plug_in_of_ours_is_imported_by_its_name_or_says_what_installs_it(tmp_path, monkeypatch):
    (tmp_path / "visualhfsm_kites.py").touch()
    (tmp_path / "visualhfsm_wind.py").write_text("import a_library_that_nobody_has")
    wanted = r"visualhfsm_kites is not installed; type: pip install 'visualhfsm\[kites\]'"
    with pytest.raises(plugins.NotInstalledError, match=wanted):
        plugins.optional("visualhfsm_kites", "visualhfsm[kites]")
    monkeypatch.syspath_prepend(tmp_path)
    assert plugins.optional("visualhfsm_kites", "visualhfsm[kites]").__name__ == "visualhfsm_kites"
    with pytest.raises(ModuleNotFoundError, match="a_library_that_nobody_has"):
        plugins.optional("visualhfsm_wind", "visualhfsm[wind]")


@pytest.mark.parametrize(
    ("code", "why"),
    [
        ("import a_library_that_nobody_has", "No module named 'a_library_that_nobody_has'"),
        ("raise ValueError('no wheels')", "no wheels"),
        ("x = 1 +", "invalid syntax"),
        ("", "has no attribute 'made'"),
    ],
)
def test_what_cannot_be_loaded_is_named_with_its_distribution(tmp_path, code, why):
    with installed(tmp_path, code):
        with pytest.raises(plugins.PluginError) as caught:
            plugins.find(SEAM, "one")
        assert "the plug-in one of a-stranger (stranger:made) cannot be loaded: " in str(caught.value)
        assert why in str(caught.value)


def test_what_cannot_be_loaded_is_named_in_the_log_and_leaves_the_others(tmp_path, caplog):
    points = {SEAM: {"broken": "breaks:made", "one": "stranger:made"}}
    with plugin.installed(tmp_path, points, stranger="made = 1", breaks="raise ValueError('no wheels')"):
        assert list(plugins.each(SEAM)) == [("one", 1)]
    assert "the plug-in broken of a-stranger (breaks:made) cannot be loaded: no wheels" in caplog.text
