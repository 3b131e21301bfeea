"""Where trials run, and what searches parameters, with no plug-in for it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support.plugins import without
from visualhfsm.trials import Plan, TrialsError, find_sandbox
from visualhfsm.trials._runners import find_runner, find_tuner

CLUSTER = r"visualhfsm_cluster is not installed; type: pip install 'visualhfsm\[cluster\]'"


@pytest.fixture(autouse=True)
def nothing_is_installed() -> Iterator[None]:
    with without("visualhfsm_classes", "visualhfsm_cluster"):
        yield


def test_without_a_plug_in_a_cluster_says_what_to_install() -> None:
    with pytest.raises(TrialsError, match=CLUSTER):
        find_runner("tcp://127.0.0.1:8786")


def test_without_a_plug_in_a_search_says_what_to_install(tmp_path: Path) -> None:
    with pytest.raises(TrialsError, match=CLUSTER):
        find_tuner(Plan(document=str(tmp_path / "a.xml")), settings=1, cost="time")


def test_without_a_plug_in_no_code_of_others_runs_and_what_contains_it_is_named() -> None:
    with pytest.raises(
        TrialsError, match="visualhfsm_classes is not installed; type: pip install 'visualhfsm'"
    ):
        find_sandbox(files=(), unsafe=True)
