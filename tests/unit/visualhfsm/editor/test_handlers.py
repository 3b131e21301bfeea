"""The table of requests."""

from __future__ import annotations

from typing import get_args

from visualhfsm._editor import protocol as p
from visualhfsm._editor.handlers import HANDLERS, Lane, lane_of


def test_every_request_has_a_handler() -> None:
    assert set(HANDLERS) == set(get_args(p.Request))


def test_changes_of_documents_are_executed_in_order() -> None:
    edits = {kind for kind in HANDLERS if issubclass(kind, p.TabEdit)}
    assert edits
    assert {HANDLERS[kind].lane for kind in edits} == {Lane.IN_ORDER}


def test_the_stop_of_the_operator_waits_for_nothing() -> None:
    assert lane_of(p.Control(id=1, component="", action=p.EMERGENCY_STOP)) is Lane.STOP
    assert lane_of(p.Control(id=1, component="dance", action="pause")) is Lane.BESIDE
    assert lane_of(p.StopRun(id=1, tab=1)) is Lane.STOP_OF_RUN
