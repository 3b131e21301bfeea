"""The table of requests."""

from __future__ import annotations

from typing import get_args

import msgspec
import pytest

from visualhfsm._editor import protocol as p
from visualhfsm._editor.handlers import HANDLERS, Lane
from visualhfsm._editor.views import TabEdit


def test_every_request_has_a_handler() -> None:
    assert set(HANDLERS) == set(get_args(p.Request))


def test_changes_of_documents_are_executed_in_order() -> None:
    edits = {kind for kind in HANDLERS if issubclass(kind, TabEdit)}
    assert edits
    assert {HANDLERS[kind].lane for kind in edits} == {Lane.IN_ORDER}


def test_the_stop_of_the_operator_waits_for_nothing() -> None:
    assert HANDLERS[p.EmergencyStop].lane is Lane.STOP
    assert HANDLERS[p.Pause].lane is Lane.BESIDE
    assert HANDLERS[p.Stop].lane is Lane.STOP_STARTED


@pytest.mark.parametrize(
    "wrong",
    [
        '{"id": 1, "op": "body", "hash": 7}',
        '{"id": 1, "op": "pushRobot", "force": {"x": 1, "y": 0, "z": 0}, "seconds": "long"}',
        '{"id": 1, "op": "pushRobot", "force": {"x": 1, "y": 0, "z": 0}, "seconds": 1, "power": 9000}',
        '{"id": 1, "op": "inject", "part": "HeadYaw"}',
        '{"id": 1, "op": "inject", "part": "HeadYaw", "kind": "stuck", "amount": "much"}',
        '{"id": 1, "op": "heal", "part": ["HeadYaw"]}',
        '{"id": 1, "op": "force", "component": "dance"}',
        '{"id": 1, "op": "pause", "component": "dance", "automaton": 1}',
        '{"id": 1, "op": "setVariable", "component": "d", "automaton": 1, "name": "n", "value": "1", "more": 1}',
        '{"id": 1, "op": "step", "component": "dance", "automaton": "1"}',
        '{"id": 1, "op": "step", "component": "dance"}',
        '{"id": 1, "op": "getStructure", "component": "dance"}',
        '{"id": 1, "op": "dance", "component": "dance"}',
        '{"id": 1, "op": "moment", "component": "dance"}',
        '{"id": 1, "op": "series", "component": "dance", "names": [1]}',
    ],
)
def test_what_no_component_and_no_robot_can_be_asked_is_malformed(wrong: str) -> None:
    with pytest.raises(msgspec.DecodeError):
        p.decode_request(wrong)
