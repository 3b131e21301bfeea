"""Calls of servants that must be found first: within their limit, in order, without blocking others."""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import wait
from typing import Any

import pytest

from tests.support.calculator import CalculatorPrx
from tests.support.calculator_servant import CalculatorI
from tests.support.carriers import is_used, over_both, over_one
from tests.support.limited import limited_pair
from tests.support.limits import CALL_LIMIT, EVENT_LIMIT, FOREVER
from tests.support.notebook import Notebook, NotebookPrx
from tests.support.processes import free_endpoint
from tests.support.serving import serve
from tests.support.suite import Pair
from tests.support.waiting import until
from zenoh_ice import (
    Communicator,
    CommunicatorDestroyedException,
    ConnectFailedException,
    ConnectionLostException,
    Current,
    ObjectNotExistException,
    initialize,
)
from zenoh_ice.data.keys import Target
from zenoh_ice.threads.limits import Limits


@pytest.mark.parametrize("named", [False, True])
def test_a_lost_link_is_warned_of_where_somebody_named_an_endpoint(
    make_communicator: Callable[..., Communicator], caplog: pytest.LogCaptureFixture, named: bool
) -> None:
    endpoint = free_endpoint()
    others: dict[str, Any] = {"connect": [free_endpoint()]} if named else {}
    with initialize(clock="wall", realm="listening", listen=[endpoint], **others) as listener:
        target = Target("listening", "Notebook")
        listener.presence.watch(target.realm)
        tool = make_communicator(connect=[endpoint], realm=target.realm)
        serve(tool, Notebook(), "Notebook")
        until(lambda: target in listener.presence.present)
        tool.destroy()
        # Not that no link is left: where nobody named an endpoint, somebody's robot may be at the default one.
        until(lambda: isinstance(listener.presence.explain_absence(target), ConnectionLostException))
    assert ("no process is linked any more" in caplog.text) is named


def test_calls_of_an_absent_servant_hold_up_no_others(make_communicator: Callable[..., Communicator]) -> None:
    """Many more calls than the pool has threads, each waiting for a server that does not appear."""
    communicator = make_communicator(connect=[free_endpoint()])
    serve(communicator, Notebook("here"), "Local")
    absent = NotebookPrx.uncheckedCast(communicator.stringToProxy("Absent"))
    futures = [absent.ice_invocationTimeout(1000 * FOREVER).note.begin("lost") for _ in range(40)]
    assert NotebookPrx.uncheckedCast(communicator.stringToProxy("Local")).about()["servant"] == "here"
    assert not any(future.done() for future in futures)
    communicator.destroy()
    assert {type(future.exception(CALL_LIMIT)) for future in futures} == {CommunicatorDestroyedException}


@over_both
def test_calls_made_before_the_servant_came_arrive_in_their_order(
    carrier: str,
    make_communicator: Callable[..., Communicator],
) -> None:
    endpoint = free_endpoint()
    client = make_communicator(connect=[endpoint])
    proxy = NotebookPrx.uncheckedCast(client.stringToProxy("Late"))
    futures = [proxy.note.begin(str(number)) for number in range(50)]
    server = make_communicator(listen=[endpoint], connect=[])
    notebook = Notebook()
    serve(server, notebook, "Late")
    while len(futures) < 60:  # while the first are being sent
        futures.append(proxy.note.begin(str(len(futures))))
    assert [future.result(CALL_LIMIT) for future in futures] == [None] * len(futures)
    assert notebook.wait_for(len(futures)) == [str(number) for number in range(len(futures))]
    proxy.ice_ping()
    assert is_used(carrier)


@over_both
def test_a_call_that_waits_does_not_overtake_those_begun_before_it(pair: Pair) -> None:
    for turn in range(5):  # it depends on when the servant comes
        proxy = NotebookPrx.uncheckedCast(pair.client.stringToProxy(f"Late{turn}"))
        futures = [proxy.note.begin(str(number)) for number in range(40)]
        notebook = Notebook()
        pair.adapter.add(notebook, f"Late{turn}")
        futures[0].result(EVENT_LIMIT)
        proxy.note("last")
        assert notebook.wait_for(41)[-1] == "last"


@over_one
def test_call_that_was_cancelled_before_it_was_sent_is_not(
    make_communicator: Callable[..., Communicator],
) -> None:
    endpoint = free_endpoint()
    client = make_communicator(connect=[endpoint])
    proxy = CalculatorPrx.uncheckedCast(client.stringToProxy("Late"))
    given_up, wanted = proxy.count.begin(), proxy.count.begin()
    assert given_up.cancel()
    server = make_communicator(listen=[endpoint], connect=[])
    serve(server, CalculatorI(), "Late")
    assert wanted.result(EVENT_LIMIT) == 1


@over_one
def test_first_call_and_its_search_end_within_one_limit(
    make_communicator: Callable[..., Communicator],
) -> None:
    """The servant appears late, and is slow."""
    endpoint = free_endpoint()
    client = make_communicator(connect=[endpoint])
    limit = CALL_LIMIT / 2
    proxy = CalculatorPrx.uncheckedCast(client.stringToProxy("Late")).ice_invocationTimeout(1000 * limit)
    limits: list[float] = []

    class Slow(CalculatorI):
        def sleep(self, seconds: float, current: Current) -> None:
            limits.append(current.timeout)

    future = proxy.sleep.begin(FOREVER)
    threading.Event().wait(0.06 * limit)  # more than what is left out of account
    server = make_communicator(listen=[endpoint], connect=[])
    serve(server, Slow(), "Late")
    assert future.result(CALL_LIMIT) is None
    proxy.sleep(FOREVER)
    first, second = limits
    assert first <= 0.94 * limit
    assert second == limit


def test_short_limit_does_not_wait_for_a_long_one(make_communicator: Callable[..., Communicator]) -> None:
    communicator = make_communicator(connect=[free_endpoint()])
    absent = NotebookPrx.uncheckedCast(communicator.stringToProxy("Absent"))
    patient = absent.ice_invocationTimeout(1000 * FOREVER).note.begin("lost")
    hurried = absent.ice_invocationTimeout(50)
    assert isinstance(hurried.note.begin("lost").exception(EVENT_LIMIT), ConnectFailedException)
    with pytest.raises(ConnectFailedException):
        hurried.who()
    assert not patient.done()


def test_calls_of_nobody_are_reported_together(
    endpoint: str, make_communicator: Callable[..., Communicator]
) -> None:
    """Each waits for half a second from when it was made, not after the one before it."""
    pair = limited_pair(endpoint, make_communicator, Limits(token_delay=0.125, longest_grace=0.0))
    absent = NotebookPrx.uncheckedCast(pair.client.stringToProxy("Absent"))
    futures = [absent.note.begin("lost") for _ in range(160)]
    assert not wait(futures, CALL_LIMIT).not_done
    assert {type(future.exception()) for future in futures} == {ObjectNotExistException}
