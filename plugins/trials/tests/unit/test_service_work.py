"""Trials of documents in any order: each has one child, all of them are known, and none lives after the close."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from functools import partial
from pathlib import Path

import pytest

from tests.support.document_work import check_interleaved, two_sources
from visualhfsm.plugins import Source
from visualhfsm_trials._messages import Choices, TrialsPush
from visualhfsm_trials._service import RunningTrials


def requests(service: RunningTrials, source: Source) -> list[Callable[[], Awaitable[object]]]:
    return [partial(service.run, source, Choices()), partial(service.read, source)]


def shown(push: TrialsPush) -> int:
    """Return how many children of a document the page knows."""
    return push.status != "idle"


@pytest.mark.slow
def test_whatever_is_asked_in_any_order_no_two_children_do_the_same_and_none_is_left(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    check_interleaved(RunningTrials, requests, shown, two_sources(tmp_path), monkeypatch)
