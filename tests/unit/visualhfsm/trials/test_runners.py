"""Where trials run, with no plug-in for it."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.support.plugins import without
from visualhfsm.trials import TrialsError, find_runner, find_sandbox

CLUSTER = r"visualhfsm_trials is not installed; type: pip install 'visualhfsm\[cluster\]'"


@pytest.fixture(autouse=True)
def nothing_is_installed() -> Iterator[None]:
    with without("visualhfsm_classes", "visualhfsm_trials"):
        yield


def test_without_a_plug_in_a_cluster_says_what_to_install() -> None:
    with pytest.raises(TrialsError, match=CLUSTER):
        find_runner("tcp://127.0.0.1:8786")


def test_without_a_plug_in_no_code_of_others_runs_and_what_contains_it_is_named() -> None:
    with pytest.raises(
        TrialsError, match=r"visualhfsm_classes is not installed; type: pip install 'visualhfsm\[classes\]'"
    ):
        find_sandbox(files=(), unsafe=True)
