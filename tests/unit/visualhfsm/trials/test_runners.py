"""Where trials run, and what searches parameters, with no plug-in for it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from visualhfsm.trials import Plan, TrialsError
from visualhfsm.trials._runners import find_runner, find_tuner
from zenoh_ice import plugins


@pytest.fixture(autouse=True)
def nothing_is_installed(monkeypatch: pytest.MonkeyPatch) -> None:
    def find(_seam: str, _name: str) -> Any:
        return None

    monkeypatch.setattr(plugins, "find", find)


def test_without_a_plug_in_a_cluster_says_what_to_install() -> None:
    wanted = r"a cluster needs a plug-in that is not installed: pip install 'visualhfsm\[cluster\]'"
    with pytest.raises(TrialsError, match=wanted):
        find_runner("tcp://127.0.0.1:8786")


def test_without_a_plug_in_a_search_says_what_to_install(tmp_path: Path) -> None:
    with pytest.raises(TrialsError, match="the search for parameters needs a plug-in that is not installed"):
        find_tuner(Plan(document=str(tmp_path / "a.xml")), settings=1, cost="time")
