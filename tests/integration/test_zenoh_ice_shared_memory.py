"""Large payloads between two sessions, through shared memory and without."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from tests.conftest import Pair
from tests.support.calculator import CalculatorPrx, Reading
from tests.support.calculator_servant import CalculatorI
from tests.support.limits import CALL_LIMIT, LIMIT
from tests.support.waiting import until
from zenoh_ice import Communicator
from zenoh_ice.wire import shared_memory, shared_segments

IMAGE = bytes(range(256)) * 4000


@pytest.fixture
def small_pool(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shared_memory, "POOL_SIZE", 64 << 10)


@pytest.fixture(autouse=True)
def server(request: pytest.FixtureRequest) -> Communicator:
    """Serve a calculator, which can echo."""
    if "small" in request.node.name:
        request.getfixturevalue("small_pool")
    pair: Pair = request.getfixturevalue("pair")
    pair.adapter.add(CalculatorI(), "Calculator")
    return pair.server


def echo(client: Communicator) -> bytes:
    calculator = CalculatorPrx.checkedCast(client.stringToProxy("Calculator"))
    return calculator.echo(IMAGE)


@pytest.mark.skipif(not shared_memory.may_lock_enough(), reason="this user may not lock enough memory")
def test_answers_travel_through_shared_memory(pair: Pair) -> None:
    for _ in range(100):  # more than fit into the pool at once
        assert echo(pair.client) == IMAGE
    assert pair.server.shared_memory.used
    assert pair.client.shared_memory.used  # an echo is asked for with as much


def test_answers_beyond_a_small_pool_travel_over_the_network(pair: Pair) -> None:
    assert echo(pair.client) == IMAGE


def test_client_without_shared_memory_gets_the_same(
    pair: Pair, make_communicator: Callable[..., Communicator]
) -> None:
    client = make_communicator(connect=[pair.endpoint], shared_memory=False, lease=CALL_LIMIT)
    assert echo(client) == IMAGE
    assert echo(pair.client) == IMAGE


@pytest.mark.skipif(not shared_memory.may_lock_enough(), reason="this user may not lock enough memory")
def test_sample_whose_server_ended_before_it_was_read_is_skipped(pair: Pair) -> None:
    calculator = CalculatorPrx.checkedCast(pair.client.stringToProxy("Calculator"))
    assert calculator.getReading.latest() is None
    servant = pair.adapter.find("Calculator")
    assert isinstance(servant, CalculatorI)
    assert servant.getReadingPublisher.wait_for_listener(LIMIT)
    servant.getReadingPublisher.publish(Reading(1, [0.5] * 20_000))
    assert pair.server.shared_memory.used
    pair.server.destroy()
    until(lambda: not pair.client.identities())
    assert calculator.getReading.latest() is None


def test_collocated_call_gets_the_same(pair: Pair) -> None:
    assert echo(pair.server) == IMAGE
    assert not pair.server.shared_memory.used


@pytest.mark.skipif(not shared_memory.may_lock_enough(), reason="this user may not lock enough memory")
def test_pool_is_claimed_while_its_communicator_lives(pair: Pair) -> None:
    assert echo(pair.client) == IMAGE
    sizes = {path.stat().st_size for path in Path("/dev/shm").glob("*.zenoh") if path.stat().st_mode & 0o1000}
    assert shared_memory.POOL_SIZE in sizes
    for _ in range(3):
        shared_segments.sweep(0.0)
    assert echo(pair.client) == IMAGE
