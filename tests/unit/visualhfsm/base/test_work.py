"""Work for documents in any order: each has one child, all of them are known, and none lives after the close."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from tests.support.document_work import check_interleaved, two_sources
from visualhfsm._monitor.messages import PartLimits, Source, StartedPush
from visualhfsm._processes import components
from visualhfsm._processes.components import StartedComponents
from visualhfsm._processes.test_results import TestsPush
from visualhfsm._processes.tests import StartedTests

Service = StartedComponents | StartedTests


def requests(service: Service, source: Source) -> list[Callable[[], Awaitable[object]]]:
    match service:
        case StartedComponents():
            return [partial(service.start, source, []), partial(service.generate, source)]
        case StartedTests():
            return [partial(service.start, source), partial(service.find, source)]


def shown(push: StartedPush | TestsPush) -> int:
    """Return how many children of a document the page knows."""
    return push.status != ("ended" if isinstance(push, StartedPush) else "idle")


@pytest.mark.slow
@pytest.mark.parametrize("make", [
    lambda pushes, folder: StartedComponents(pushes, limits=PartLimits(preparation=0.0)),
    lambda pushes, folder: StartedTests(pushes, folder),
], ids=["components", "tests"])  # fmt: skip
def test_whatever_is_asked_in_any_order_no_two_children_do_the_same_and_none_is_left(
    make: Callable[[Callable[[Any], None], Path], Service], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(components, "generate_component", lambda file, target, *_, **__: target / "walk.py")
    monkeypatch.setattr(components, "read_origins", lambda *_, **__: None)
    check_interleaved(
        lambda pushes: make(pushes, tmp_path), requests, shown, two_sources(tmp_path), monkeypatch
    )
