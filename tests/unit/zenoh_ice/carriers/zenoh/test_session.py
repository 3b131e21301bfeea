"""Opening a session with several endpoints, and closing one whose peer no longer accepts data."""

from __future__ import annotations

import logging
import subprocess
import sys
import threading
from typing import cast

import pytest
import zenoh

from tests.support.limits import FOREVER, START_LIMIT
from tests.support.processes import free_endpoint
from tests.support.soak import repeated
from zenoh_ice.carriers.zenoh import session as module
from zenoh_ice.carriers.zenoh.session import close_session, open_session
from zenoh_ice.settings import Settings


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


@pytest.mark.slow
def test_opening_waits_for_links_to_all_endpoints_and_no_longer(monkeypatch: pytest.MonkeyPatch) -> None:
    """Gossip makes some of these links: Zenoh itself would go on waiting for the endpoint."""
    monkeypatch.setattr(module, "_DELAY", FOREVER * 1000)
    first, second = free_endpoint(), free_endpoint()
    with (
        open_session(Settings(connect=(), listen=(first,))) as robot,
        open_session(Settings(connect=(first,), listen=(second,))) as editor,
    ):
        for _ in range(10):
            with open_session(Settings(connect=(second, first))) as session:
                # With them may be the last one, of whose end they have not heard yet.
                assert {*session.info.peers_zid()} >= {robot.zid(), editor.zid()}


_ENDS_BEFORE_ITS_SESSION = """
import time
from zenoh_ice.carriers.zenoh.session import close_session, open_session
from zenoh_ice.settings import Settings

class Watched:
    def __init__(self, session):
        self._session = session

    def close(self):
        time.sleep(0.1)  # the end of the program comes first
        self._session.close()
        print("closed", flush=True)

close_session(Watched(open_session(Settings(connect=(), listen=("{endpoint}",)))), 0.0)
"""


@pytest.mark.slow
def test_a_program_ends_with_its_own_code_and_after_its_session() -> None:
    """The end of the interpreter would tear the closing thread off inside Zenoh: SIGABRT."""
    for _ in range(repeated(test=3, soak=2000)):
        code = _ENDS_BEFORE_ITS_SESSION.format(endpoint=free_endpoint())
        done = subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, timeout=START_LIMIT
        )
        assert (done.returncode, done.stdout) == (0, "closed\n"), done.stderr
