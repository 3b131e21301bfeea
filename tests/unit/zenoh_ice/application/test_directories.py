"""The directories of the user's files."""

from __future__ import annotations

from pathlib import Path

import pytest

from zenoh_ice.application.directories import state_directory


@pytest.mark.parametrize(
    ("state", "folder"), [("", "~/.local/state"), ("relative", "~/.local/state"), ("/s", "/s")]
)
def test_states_are_where_the_specification_says(
    state: str, folder: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("XDG_STATE_HOME", state)
    if not state:
        monkeypatch.delenv("XDG_STATE_HOME")
    assert state_directory() == Path(folder).expanduser() / "visualhfsm"


def test_without_a_home_the_error_says_what_to_set(monkeypatch: pytest.MonkeyPatch) -> None:
    def homeless() -> Path:
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.setattr(Path, "home", homeless)
    monkeypatch.delenv("XDG_STATE_HOME")
    with pytest.raises(OSError, match="set XDG_STATE_HOME to a folder that can be written"):
        state_directory()
