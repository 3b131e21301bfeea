"""A promise that `make soak` repeats has a case in `make test-all`, too."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.places import ROOT
from tests.support.soak import LEFT_TO_SOAK, OTHERS


def function(nodeid: str) -> str:
    """Return the id of a test without its parameters."""
    return nodeid.partition("[")[0]


def case(item: pytest.Item) -> str:
    """Return the id of the test that holds the promise of one that only `make soak` runs, as its mark says."""
    mark = item.get_closest_marker("soak")
    assert mark is not None
    if not mark.args:  # one of the parameters of a test that has others
        return function(item.nodeid)
    named = str(mark.args[0])
    return named if "::" in named else f"{item.nodeid.partition('::')[0]}::{named}"


def test_what_only_a_soak_repeats_has_a_case_here(request: pytest.FixtureRequest) -> None:
    stash = request.session.stash
    runs = {function(item.nodeid) for item in stash[OTHERS]}
    files = {item.path for item in stash[OTHERS]}
    lost = {
        item.nodeid: case(item)
        for item in stash[LEFT_TO_SOAK]
        if case(item) not in runs and (ROOT / Path(case(item).partition("::")[0])) in files
    }
    assert not lost, f"left to `make soak`, and no such test in `make test-all`: {lost}"
