"""What a page gets of a moment, in its language."""

from __future__ import annotations

from typing import Any

import msgspec

from interfaces.hfsm import ComponentSnapshot, ErrorReport
from interfaces.nao import HealthEvent, HealthReport, Severity
from visualhfsm._base.languages import encoder
from visualhfsm._monitor.realm.moments import translate_moment, translate_snapshot
from visualhfsm._monitor.realm.robot import RobotState
from visualhfsm._monitor.realm.run_log import LiveSnapshot, RunLog


def snapshot() -> LiveSnapshot:
    """Return a snapshot with a refusal, an error and an event of the robot."""
    stopped = "CommandRefusedException: the robot is not connected"
    error = ErrorReport(1.0, 1, 1, "walk.xml:3", "ZeroDivisionError: division by zero")
    event = HealthEvent(1.0, Severity.Error, "Nao", "fallen: the torso tilts by 80 deg")
    moment = ComponentSnapshot(time=1.0, startedAt=1.0, errors=[error], refusal=f"walk/go: {stopped}")
    return LiveSnapshot(1.0, moment, RobotState(health=HealthReport(events=[event])))


def texts_in_spanish(moment: object) -> list[str]:
    said: dict[str, Any] = msgspec.json.decode(encoder("es").encode(moment))
    component, events = said["component"], said["robot"]["health"]["events"]
    return [component["refusal"], component["errors"][0]["message"], events[0]["message"]]


def test_a_snapshot_is_said_in_spanish_now_and_later() -> None:
    expected = [
        "walk/go: CommandRefusedException: el robot no está conectado",
        "ZeroDivisionError: división entre cero",
        "caído: el torso se inclina 80°",
    ]
    assert texts_in_spanish(translate_snapshot(snapshot())) == expected
    log = RunLog()
    log.add(snapshot())
    assert texts_in_spanish(translate_moment(log.at(1.0))) == expected
    assert translate_moment(None) is None
