"""Closing a session whose peer no longer accepts data."""

from __future__ import annotations

import logging
import threading
from typing import cast

import pytest
import zenoh

from tests.support.limits import FOREVER
from zenoh_ice.carriers.zenoh.session import close_session


class Stuck:
    """A session that does not end before it may."""

    def __init__(self) -> None:
        self.may_end = threading.Event()

    def close(self) -> None:
        self.may_end.wait(FOREVER)
        raise zenoh.ZError("close operation timed out!")


def test_session_that_does_not_end_holds_nobody_up(caplog: pytest.LogCaptureFixture) -> None:
    stuck = Stuck()
    with caplog.at_level(logging.WARNING, "zenoh_ice"):
        close_session(cast("zenoh.Session", stuck), 0.01)
        assert "has not ended after 0.01 s" in caplog.text
    stuck.may_end.set()
