"""`nao stop`, to whose end nobody listens."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import suppress

import pytest

from nao_tools._stop import stop
from tests.support.limits import CALL_LIMIT, END_LIMIT
from tests.support.processes import free_endpoint
from tests.support.scripted_robot import ScriptedRobot, error, listening
from zenoh_ice import Settings


@pytest.fixture
def unread(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Have a standard error whose reader has gone."""
    reader, writer = os.pipe()
    os.close(reader)
    monkeypatch.setattr("nao_tools._stopping._REPORT_PERIOD", 0.05)
    unread = os.fdopen(writer, "w", buffering=1)
    monkeypatch.setattr(sys, "stderr", unread)
    yield
    with suppress(BrokenPipeError):
        unread.close()


@pytest.mark.usefixtures("unread")
def test_a_stop_goes_on_though_nobody_reads_what_it_says(capsys: pytest.CaptureFixture[str]) -> None:
    endpoint = free_endpoint()
    with listening(endpoint) as session:
        robot = ScriptedRobot(session)
        robot.stops = [error("the cable is out")] * 4 + robot.stops
        settings = Settings(mode="client", connect=(endpoint,), listen=(), timeout=CALL_LIMIT)
        stop(settings, "a hand", END_LIMIT, as_json=False)
        assert len(robot.sent) > 4
    assert "stopped: the robot refuses commands" in capsys.readouterr().out
