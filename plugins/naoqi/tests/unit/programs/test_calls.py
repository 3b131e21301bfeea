"""The calls of clients: what is counted of them, and how they end with the server."""

import threading
from typing import Any

import pytest

pytest.importorskip("qi")

from tests.support.limits import CALL_LIMIT, EVENT_LIMIT
from tests.support.waiting import until
from visualhfsm_naoqi.programs._calls import Calls
from visualhfsm_naoqi.programs._clients import (
    MOST_WAITING,
    MOST_WAITING_URGENT,
    Activity,
    Call,
    CallTable,
    Client,
    QiLimits,
    begins,
)
from zenoh_ice import WallClock

IMPATIENT = 0.1


class Service:
    """A service with an operation of each kind."""

    def __init__(self, client):
        self.client = client
        self.begun = threading.Event()
        self.free = threading.Event()

    @begins(Activity.JOINTS)
    def short(self):
        """Return how many calls the program awaits meanwhile."""
        return self.client.awaited_calls

    def long(self, call: Call) -> None:
        """Wait until the call is stopped."""
        call.stopped.wait(CALL_LIMIT)

    @begins(urgent=True)
    def stop(self, call: Call) -> None:
        """Wait until the call is stopped."""
        call.stopped.wait(CALL_LIMIT)

    def fail(self):
        """End as a driver may that calls `sys.exit`."""
        raise SystemExit("no bus")

    def fail_late(self, call: Call) -> None:
        """End so in a thread."""
        raise SystemExit("no bus")

    def hang(self, call: Call) -> None:
        """Wait for the test, even if the call is stopped."""
        assert not call.stopped.is_set()
        self.begun.set()
        self.free.wait(CALL_LIMIT)


@pytest.fixture
def service(client):
    return Service(client)


@pytest.fixture
def calls():
    calls = Calls(CallTable(WallClock()))
    yield calls
    calls.close()


@pytest.fixture
def client():
    client = Client("Ada")
    yield client
    client.close()


@pytest.fixture
def facade(calls, client, service):
    return calls.facade("Service", [service])(client)


def test_a_program_awaits_its_long_calls_but_not_its_tasks(facade, client):
    facade.pCall(["long"])
    assert client.awaited_calls == 0
    facade.long()
    assert client.awaited_calls == 1
    assert facade.short() == 1


def test_too_many_stops_of_a_program_are_refused_but_not_after_too_many_other_calls(facade):
    for _ in range(MOST_WAITING):
        facade.long()
    assert "1000 calls of this program run or wait already" in facade.long().error()
    stops = [facade.stop() for _ in range(MOST_WAITING_URGENT - MOST_WAITING)]
    assert all(stop.isRunning() for stop in stops)
    assert "1016 calls of this program run or wait already" in facade.stop().error()
    assert facade.short() == MOST_WAITING_URGENT


@pytest.mark.parametrize("operation", ["fail", "fail_late"])
def test_a_driver_that_calls_sys_exit_leaves_no_program_waiting(facade, client, operation, caplog):
    said = getattr(facade, operation)().error(round(CALL_LIMIT * 1000))
    assert said == f"Service::{operation}: SystemExit: no bus"
    assert f"Service::{operation} failed" in caplog.text
    until(lambda: client.awaited_calls == 0)


def test_closing_does_not_wait_for_ever_for_a_call_that_hangs(client, service, caplog):
    calls = Calls(CallTable(WallClock()), QiLimits(end=IMPATIENT))
    facade: Any = calls.facade("Service", [service])(client)
    facade.hang()
    assert service.begun.wait(EVENT_LIMIT)
    calls.close()
    service.free.set()
    assert "calls of programs did not end within 0.1 s" in caplog.text


@pytest.mark.parametrize("operation", ["long", "short"])
def test_nothing_begins_after_the_end(calls, facade, operation):
    calls.close()
    assert "the robot is shutting down" in getattr(facade, operation)().error()
