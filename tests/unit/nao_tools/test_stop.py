"""`nao stop`, to whose words nobody listens."""

from __future__ import annotations

import io
import sys

import pytest

from nao_tools._stop import stop
from tests.support.limits import CALL_LIMIT, END_LIMIT
from tests.support.processes import free_endpoint
from tests.support.scripted_robot import STOPPED, ScriptedRobot, error, listening
from zenoh_ice import Settings


@pytest.mark.slow
def test_a_stop_goes_on_though_nobody_reads_what_it_says(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    endpoint = free_endpoint()
    with listening(endpoint) as session:
        robot = ScriptedRobot(session)
        robot.stops = [error("the cable is out")]

        class Unread(io.StringIO):
            """A standard error whose reader has gone; once it is told something, the robot can stop."""

            def write(self, _: str) -> int:
                robot.stops = [(True, STOPPED)]
                raise BrokenPipeError

        monkeypatch.setattr("nao_tools._stopping._REPORT_PERIOD", 0.05)
        monkeypatch.setattr(sys, "stderr", Unread())
        settings = Settings(mode="client", connect=(endpoint,), listen=(), timeout=CALL_LIMIT)
        stop(settings, "a hand", END_LIMIT, as_json=False)
    assert "stopped: the robot refuses commands" in capsys.readouterr().out
