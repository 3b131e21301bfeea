"""Object adapters: servants by identity, and their lifetime."""

from __future__ import annotations

import gc
import threading
import weakref
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import pytest

from tests.support.carriers import anywhere, everywhere, is_used, over_one
from tests.support.gripper import GripperI, GripperPrx
from tests.support.limited import limited, limited_pair
from tests.support.limits import CALL_LIMIT, EVENT_LIMIT, FOREVER
from tests.support.suite import Pair
from tests.support.waiting import until
from zenoh_ice import (
    AlreadyRegisteredException,
    Communicator,
    ConfigurationException,
    Current,
    ObjectNotExistException,
)
from zenoh_ice.objects.home import Home
from zenoh_ice.threads.limits import LIMITS, Limits

MakeCommunicator = Callable[..., Communicator]


@pytest.fixture
def limits() -> Limits:
    """The limits of the pair: those of every day, unless a test is marked otherwise."""
    return LIMITS


@pytest.fixture
def pair(endpoint: str, make_communicator: MakeCommunicator, limits: Limits) -> Pair:
    return limited_pair(endpoint, make_communicator, limits)


def gripper(communicator: Home, text: str) -> GripperPrx:
    return GripperPrx.checkedCast(communicator.stringToProxy(text))


def test_a_destroyed_adapter_leaves_nothing_behind(pair: Pair) -> None:
    adapter = pair.server.createObjectAdapter("Short")
    adapter.add(GripperI(), "Ball")
    adapter.activate()
    adapter.destroy()
    gone = weakref.ref(adapter)
    del adapter
    gc.collect()
    assert gone() is None


class TestIdentities:
    def test_impossible_identity_is_refused(self, pair: Pair) -> None:
        for identity in ("", "a/b", "/a", "a/", "=", "+a", "a b", "*", "x" * 129):
            with pytest.raises(ConfigurationException):
                pair.adapter.add(GripperI(), identity)

    def test_servant_with_a_coroutine_is_refused(self, pair: Pair) -> None:
        class Later(GripperI):
            async def who(self, current: Current) -> str:  # type: ignore[override]
                return "somebody"

        with pytest.raises(ConfigurationException, match=r"^Ball\.who is a coroutine: a servant answers"):
            pair.adapter.add(Later(), "Ball")
        assert pair.adapter.find("Ball") is None
        pair.adapter.add(GripperI(), "Ball")

    @anywhere
    def test_what_was_added_is_found_and_removed(self, pair: Pair, caller: Communicator) -> None:
        servant = GripperI("plain")
        assert pair.adapter.add(servant, "Ball").ice_toString() == "Ball"
        assert pair.adapter.find("Ball") is servant
        proxy = gripper(caller, "Ball")
        assert proxy.who() == "plain:Ball"
        assert pair.adapter.removeAll(["Ball"]) == {"Ball": servant}
        assert pair.adapter.find("Ball") is None
        with pytest.raises(ObjectNotExistException):
            proxy.who()
        assert pair.adapter.removeAll(["Ball"]) == {}
        pair.adapter.add(servant, "Ball")
        assert GripperPrx.checkedCast(proxy).who() == "plain:Ball"
        assert proxy.who() == "plain:Ball"

    def test_identity_is_served_once(self, pair: Pair, make_communicator: MakeCommunicator) -> None:
        pair.adapter.add(GripperI(), "Ball")
        other_adapter = pair.server.createObjectAdapter("Other")
        other_adapter.activate()
        other_process = make_communicator(connect=[pair.endpoint]).createObjectAdapter("Other")
        other_process.activate()
        gripper(other_process.getCommunicator(), "Ball")  # it is heard of there
        for adapter in (pair.adapter, other_adapter, other_process):
            with pytest.raises(AlreadyRegisteredException, match="'Ball'"):
                adapter.add(GripperI(), "Ball")

    @over_one
    def test_calls_of_one_servant_run_one_at_a_time_under_all_its_names(self, pair: Pair) -> None:
        servant = GripperI()
        servant.leave.clear()
        for name in ("Left", "Right"):
            pair.adapter.add(servant, name)
        threads = [
            threading.Thread(target=gripper(pair.client, name).move, args=(1.0,))
            for name in ("Left", "Right")
        ]
        for thread in threads:
            thread.start()
        assert servant.entered.acquire(timeout=EVENT_LIMIT)
        assert not servant.entered.acquire(timeout=0.2)
        servant.leave.set()
        for thread in threads:
            thread.join(EVENT_LIMIT)
        assert servant.moved == [1.0, 1.0]

    @over_one
    def test_servant_may_call_itself_under_any_name(self, pair: Pair) -> None:
        class Nested(GripperI):
            def text(self, size: int, current: Current) -> str:
                return ", ".join(gripper(current.communicator, name).who() for name in ("Left", "Right"))

        servant = Nested("nested")
        for name in ("Left", "Right"):
            pair.adapter.add(servant, name)
        assert gripper(pair.client, "Left").text(1) == "nested:Left, nested:Right"


class TestCurrent:
    @everywhere
    def test_servant_gets_all_about_the_call(self, carrier: str, pair: Pair, caller: Communicator) -> None:
        servant = GripperI()
        pair.adapter.add(servant, "Ball")
        gripper(caller, "Ball").ice_invocationTimeout(3000).who()
        (current,) = servant.currents
        assert (current.identity, current.operation) == ("Ball", "who")
        assert current.client == caller.client_id
        assert current.call_id.startswith(f"{caller.client_id}/")
        assert current.timeout == 3.0
        assert current.communicator is pair.server
        assert is_used(carrier)


@limited(drain=0.2)
class TestLife:
    @everywhere
    def test_call_that_waits_when_its_servant_is_removed_is_not_executed(
        self, pair: Pair, caller: Communicator
    ) -> None:
        servant = GripperI()
        servant.leave.clear()
        pair.adapter.add(servant, "Gripper")
        proxy = gripper(caller, "Gripper").ice_invocationTimeout(FOREVER * 1000)
        with ThreadPoolExecutor(2) as threads:
            first = threads.submit(proxy.move, 1.0)
            assert servant.entered.acquire(timeout=EVENT_LIMIT)
            second = threads.submit(proxy.move, 2.0)
            until(lambda: waiting(pair, "Gripper") == 1)
            pair.adapter.removeAll(["Gripper"])
            assert isinstance(second.exception(EVENT_LIMIT), ObjectNotExistException)
            servant.leave.set()
            assert first.exception(EVENT_LIMIT) is None
        assert servant.moved == [1.0]

    @over_one
    def test_servant_that_removes_itself_hangs_nobody(self, pair: Pair) -> None:
        class Leaving(GripperI):
            def move(self, position: float, current: Current) -> None:
                super().move(position, current)
                pair.adapter.removeAll(["Gripper"])

        servant = Leaving()
        servant.leave.clear()
        pair.adapter.add(servant, "Gripper")
        proxy = gripper(pair.client, "Gripper").ice_invocationTimeout(FOREVER * 1000)
        first = proxy.move.begin(1.0)
        assert servant.entered.acquire(timeout=EVENT_LIMIT)
        second = proxy.move.begin(2.0)
        until(lambda: waiting(pair, "Gripper") == 1)
        servant.leave.set()
        assert first.exception(EVENT_LIMIT) is None
        assert isinstance(second.exception(EVENT_LIMIT), ObjectNotExistException)

    @anywhere
    def test_adapter_can_be_deactivated_and_activated_again(self, pair: Pair, caller: Communicator) -> None:
        pair.adapter.add(GripperI("own"), "Ball")
        proxy = gripper(caller, "Ball")
        pair.adapter.deactivate()
        with pytest.raises(ObjectNotExistException):
            proxy.who()
        pair.adapter.activate()
        assert GripperPrx.checkedCast(proxy).who() == "own:Ball"

    @over_one
    def test_call_that_outlasts_the_withdrawal_is_answered(
        self, pair: Pair, caplog: pytest.LogCaptureFixture
    ) -> None:
        slow = GripperI()
        slow.leave.clear()
        pair.adapter.add(slow, "Ball")
        busy = gripper(pair.client, "Ball").ice_invocationTimeout(FOREVER * 1000).move.begin(1.0)
        assert slow.entered.acquire(timeout=EVENT_LIMIT)
        pair.adapter.deactivate()
        assert "a call of Ball@nao still runs" in caplog.text
        slow.leave.set()
        assert busy.exception(CALL_LIMIT) is None
        assert slow.moved == [1.0]


def waiting(pair: Pair, identity: str) -> int:
    """Return how many calls of a servant wait for their turn."""
    gripper(pair.client, identity)  # who has heard of a servant can ask its process
    status = pair.client.processStatus(pair.server.client_id)
    return status.servants[f"{identity}@nao"].waiting
