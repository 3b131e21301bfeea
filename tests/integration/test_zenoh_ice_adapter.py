"""What an adapter serves: identities with categories, facets, default servants, servant locators, replicas."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor, wait

import pytest

from tests.conftest import Pair
from tests.support.gripper import GripperI, GripperPrx
from tests.support.limits import AT_ONCE, LIMIT
from tests.support.waiting import until
from zenoh_ice import (
    AlreadyRegisteredException,
    Communicator,
    ConfigurationException,
    Current,
    FacetNotExistException,
    Identity,
    Object,
    ObjectAdapter,
    ObjectNotExistException,
    ServantLocator,
    TwowayOnlyException,
    UnknownException,
)

MakeCommunicator = Callable[..., Communicator]


def gripper(communicator: Communicator, text: str) -> GripperPrx:
    return GripperPrx.checkedCast(communicator.stringToProxy(text))


@pytest.fixture(params=["client", "server"])
def caller(request: pytest.FixtureRequest, pair: Pair) -> Communicator:
    communicator: Communicator = getattr(pair, request.param)
    return communicator


class TestIdentities:
    def test_servants_of_the_same_name_differ_by_category_and_facet(
        self, pair: Pair, caller: Communicator
    ) -> None:
        pair.adapter.add(GripperI("plain"), "Ball")
        pair.adapter.add(GripperI("in category"), Identity("Ball", "soccer"))
        pair.adapter.addFacet(GripperI("facet"), "Ball", "debug")
        pair.adapter.addFacet(GripperI("facet in category"), "soccer/Ball", "debug")
        answers = [
            gripper(caller, text).who()
            for text in ("Ball", "soccer/Ball", "Ball -f debug", "soccer/Ball -f debug")
        ]
        assert answers == [
            "plain:Ball",
            "in category:soccer/Ball",
            "facet:Ball -f debug",
            "facet in category:soccer/Ball -f debug",
        ]

    def test_name_that_is_a_category_as_well_is_no_obstacle(self, pair: Pair, caller: Communicator) -> None:
        pair.adapter.add(GripperI("category"), "soccer")
        pair.adapter.add(GripperI("who"), "soccer/who")  # as an operation is called
        assert gripper(caller, "soccer").who() == "category:soccer"
        assert gripper(caller, "soccer/who").who() == "who:soccer/who"

    def test_added_with_uuid_is_called_by_its_proxy(self, pair: Pair) -> None:
        first, second = (pair.adapter.addWithUUID(GripperI("own")) for _ in range(2))
        assert first != second
        assert gripper(pair.client, first.ice_toString()).who() == f"own:{first.ice_toString()}"

    @pytest.mark.parametrize("identity", ["", "a/b/c", "/a", "a/", "=", "+a", "a b", "soccer/="])
    def test_impossible_identity_is_refused(self, pair: Pair, identity: str) -> None:
        with pytest.raises(ConfigurationException):
            pair.adapter.add(GripperI(), identity)

    def test_impossible_facet_is_refused(self, pair: Pair) -> None:
        with pytest.raises(ConfigurationException, match="'a/b' is no facet"):
            pair.adapter.addFacet(GripperI(), "Ball", "a/b")

    def test_what_was_added_is_found_and_removed(self, pair: Pair) -> None:
        adapter, plain, debug = pair.adapter, GripperI(), GripperI()
        proxy = adapter.add(plain, "soccer/Ball")
        adapter.addFacet(debug, "soccer/Ball", "debug")
        assert adapter.find("soccer/Ball") is plain
        assert adapter.find(Identity("Ball", "soccer")) is plain
        assert adapter.findByProxy(proxy) is plain
        assert adapter.findByProxy(pair.server.stringToProxy("soccer/Ball -f debug")) is debug
        assert adapter.findByProxy(pair.server.stringToProxy("soccer/Ball@elsewhere")) is None
        assert adapter.findFacet("soccer/Ball", "debug") is debug
        assert adapter.findAllFacets("soccer/Ball") == {"": plain, "debug": debug}
        assert adapter.remove("soccer/Ball") is plain
        with pytest.raises(FacetNotExistException):
            adapter.remove("soccer/Ball")
        assert adapter.removeAllFacets("soccer/Ball") == {"debug": debug}
        with pytest.raises(ObjectNotExistException):
            adapter.removeAllFacets("soccer/Ball")

    def test_removed_facet_is_gone_and_the_others_stay(self, pair: Pair, caller: Communicator) -> None:
        pair.adapter.add(GripperI("plain"), "Ball")
        pair.adapter.addFacet(GripperI(), "Ball", "debug")
        debug = gripper(caller, "Ball -f debug")
        debug.who()
        pair.adapter.removeFacet("Ball", "debug")
        with pytest.raises(ObjectNotExistException):
            debug.who()
        assert gripper(caller, "Ball").who() == "plain:Ball"

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
        assert servant.entered.acquire(timeout=LIMIT)
        assert not servant.entered.acquire(timeout=0.2)
        servant.leave.set()
        for thread in threads:
            thread.join(LIMIT)
        assert servant.moved == [1.0, 1.0]

    def test_servant_may_call_itself_under_another_name(self, pair: Pair) -> None:
        class Nested(GripperI):
            def text(self, size: int, current: Current) -> str:
                return gripper(current.communicator, "Right").who()

        servant = Nested("nested")
        for name in ("Left", "Right"):
            pair.adapter.add(servant, name)
        assert gripper(pair.client, "Left").text(1) == "nested:Right"


class TestCurrent:
    def test_servant_is_told_all_about_the_call(self, pair: Pair, caller: Communicator) -> None:
        servant = GripperI()
        pair.adapter.addFacet(servant, "soccer/Ball", "debug")
        proxy = gripper(caller, "soccer/Ball -f debug").ice_invocationTimeout(3000)
        proxy.ice_context({"who": "me"}).who()
        (current,) = servant.currents
        assert (current.identity, current.facet, current.operation) == ("soccer/Ball", "debug", "who")
        assert current.client == caller.client_id
        assert current.call_id.startswith(f"{caller.client_id}/")
        assert current.ctx == {"who": "me"}
        assert current.timeout == 3.0
        assert current.communicator is pair.server
        assert current.adapter is pair.adapter

    def test_context_of_a_call_without_one_is_empty_and_cannot_be_changed(self, pair: Pair) -> None:
        servant = GripperI()
        pair.adapter.add(servant, "Ball")
        gripper(pair.client, "Ball").who()
        assert servant.currents[0].ctx == {}


class TestDefaultServants:
    def test_default_servant_serves_what_has_none_of_its_own(self, pair: Pair, caller: Communicator) -> None:
        pair.adapter.add(GripperI("own"), "soccer/Ball")
        pair.adapter.addDefaultServant(GripperI("default"), "soccer")
        pair.adapter.addDefaultServant(GripperI("any"))
        answers = [
            gripper(caller, text).who()
            for text in ("soccer/Ball", "soccer/Goal", "soccer/Goal -f debug", "Head", "tennis/Ball -f x")
        ]
        assert answers == [
            "own:soccer/Ball",
            "default:soccer/Goal",
            "default:soccer/Goal -f debug",
            "any:Head",
            "any:tennis/Ball -f x",
        ]

    @pytest.mark.parametrize("category", ["", "soccer"])
    def test_servant_of_another_process_comes_first(
        self, pair: Pair, make_communicator: MakeCommunicator, category: str
    ) -> None:
        pair.adapter.add(GripperI("own"), "soccer/Ball")
        other = make_communicator(connect=[pair.endpoint])
        adapter = other.createObjectAdapter("Other")
        adapter.addDefaultServant(GripperI("default"), category)
        adapter.activate()
        assert gripper(pair.client, "soccer/Goal").who() == "default:soccer/Goal"
        for communicator in (pair.client, pair.server, other):
            assert gripper(communicator, "soccer/Ball").who() == "own:soccer/Ball"

    def test_default_servant_takes_oneway_calls(self, pair: Pair) -> None:
        default, own = GripperI(), GripperI()
        pair.adapter.add(own, "soccer/Ball")
        pair.adapter.addDefaultServant(default, "soccer")
        oneway(gripper(pair.client, "soccer/Ball")).move(1.0)
        oneway(gripper(pair.client, "soccer/Goal")).move(2.0)
        oneway(gripper(pair.client, "soccer/Goal -f debug")).move(3.0)
        for _ in range(2):
            assert default.entered.acquire(timeout=LIMIT)
        assert own.entered.acquire(timeout=LIMIT)
        until(lambda: (own.moved, default.moved) == ([1.0], [2.0, 3.0]))

    def test_default_servant_may_say_that_there_is_no_such_object(self, pair: Pair) -> None:
        class Choosy(GripperI):
            def who(self, current: Current) -> str:
                raise ObjectNotExistException(f"nobody is called {current.identity}")

        pair.adapter.addDefaultServant(Choosy(), "soccer")
        with pytest.raises(ObjectNotExistException, match="nobody is called soccer/Goal"):
            gripper(pair.client, "soccer/Goal").who()

    def test_slow_default_servant_delays_no_other(self, pair: Pair) -> None:
        slow = GripperI()
        slow.leave.clear()
        pair.adapter.add(GripperI("own"), "soccer/Ball")
        pair.adapter.addDefaultServant(slow, "soccer")
        busy = threading.Thread(target=gripper(pair.client, "soccer/Goal").move, args=(1.0,))
        busy.start()
        assert slow.entered.acquire(timeout=LIMIT)
        for _ in range(100):  # more than wait in any queue
            assert gripper(pair.client, "soccer/Ball").who() == "own:soccer/Ball"
        slow.leave.set()
        busy.join(LIMIT)
        assert slow.moved == [1.0]

    def test_what_was_added_is_found_and_removed(self, pair: Pair, caller: Communicator) -> None:
        servant = GripperI("default")
        pair.adapter.addDefaultServant(servant, "soccer")
        with pytest.raises(AlreadyRegisteredException, match="category 'soccer'"):
            pair.adapter.addDefaultServant(servant, "soccer")
        proxy = gripper(caller, "soccer/Goal")
        assert proxy.who() == "default:soccer/Goal"
        assert pair.adapter.findDefaultServant("soccer") is servant
        assert pair.adapter.findDefaultServant() is None
        assert pair.adapter.removeDefaultServant("soccer") is servant
        with pytest.raises(ObjectNotExistException):
            proxy.who()
        with pytest.raises(ObjectNotExistException):
            pair.adapter.removeDefaultServant("soccer")

    def test_what_waits_for_too_long_at_the_end_is_told_so(self, pair: Pair, caller: Communicator) -> None:
        servant = GripperI()
        servant.leave.clear()
        pair.adapter.addDefaultServant(servant, "yard")
        proxy = gripper(caller, "yard/7").ice_invocationTimeout(LIMIT * 1000)
        first = proxy.moveAsync(1.0)
        assert servant.entered.acquire(timeout=LIMIT)
        second = proxy.moveAsync(2.0)
        incoming = next(iter(pair.server.local_servants.all()))
        until(lambda: incoming._lane._waiting)
        pair.adapter.removeDefaultServant("yard")
        assert isinstance(second.exception(AT_ONCE), ObjectNotExistException)
        pair.adapter.deactivate()
        servant.leave.set()
        assert pair.adapter.waitForDeactivate(AT_ONCE)
        assert first.exception(LIMIT) is None
        assert servant.moved == [1.0]

    def test_servant_that_removes_itself_hangs_nobody(self, pair: Pair) -> None:
        class Leaving(GripperI):
            def move(self, position: float, current: Current) -> None:
                super().move(position, current)
                pair.adapter.removeDefaultServant("yard")

        servant = Leaving()
        servant.leave.clear()
        pair.adapter.addDefaultServant(servant, "yard")
        proxy = gripper(pair.client, "yard/7").ice_invocationTimeout(LIMIT * 1000)
        first = proxy.moveAsync(1.0)
        assert servant.entered.acquire(timeout=LIMIT)
        second = proxy.moveAsync(2.0)
        incoming = next(iter(pair.server.local_servants.all()))
        until(lambda: incoming._lane._waiting)
        servant.leave.set()
        assert first.exception(LIMIT) is None
        assert isinstance(second.exception(AT_ONCE), ObjectNotExistException)


class Players(ServantLocator):
    """Makes the servants of a team when they are called."""

    def __init__(self) -> None:
        self.finished_calls: list[tuple[str, object]] = []
        self.done = threading.Semaphore(0)
        self.deactivated: list[str] = []

    def locate(self, current: Current) -> Object | tuple[Object, str] | None:
        name = current.identity.rpartition("/")[2]
        if name == "Broken":
            raise RuntimeError("out of paint")
        return (GripperI(name), f"made for {current.operation}") if name.startswith("Player") else None

    def finished(self, current: Current, servant: Object, cookie: object) -> None:
        assert isinstance(servant, GripperI)
        self.finished_calls.append((servant.name, cookie))
        self.done.release()

    def deactivate(self, category: str) -> None:
        self.deactivated.append(category)


class TestServantLocators:
    def test_located_servant_is_called_and_the_locator_told_of_the_end(
        self, pair: Pair, caller: Communicator
    ) -> None:
        locator = Players()
        pair.adapter.addServantLocator(locator, "team")
        proxy = GripperPrx.uncheckedCast(caller.stringToProxy("team/Player7"))
        assert proxy.who() == "Player7:team/Player7"
        assert locator.done.acquire(timeout=LIMIT)
        assert locator.finished_calls == [("Player7", "made for who")]

    def test_type_of_a_located_servant_is_asked_of_itself(self, pair: Pair, caller: Communicator) -> None:
        pair.adapter.addServantLocator(Players(), "team")
        assert gripper(caller, "team/Player7").who() == "Player7:team/Player7"

    def test_locator_may_find_nobody_and_may_fail(
        self, pair: Pair, caller: Communicator, caplog: pytest.LogCaptureFixture
    ) -> None:
        pair.adapter.addServantLocator(Players(), "team")
        with pytest.raises(ObjectNotExistException, match="'team/Coach'"):
            GripperPrx.uncheckedCast(caller.stringToProxy("team/Coach")).who()
        with caplog.at_level(logging.ERROR, "zenoh_ice"), pytest.raises(UnknownException) as caught:
            GripperPrx.uncheckedCast(caller.stringToProxy("team/Broken")).who()
        assert str(caught.value) == "RuntimeError: out of paint"
        assert "Traceback" in caplog.text

    def test_located_servant_may_call_another(self, pair: Pair, caller: Communicator) -> None:
        class Passing(Players):
            def locate(self, current: Current) -> Object | tuple[Object, str] | None:
                class Passer(GripperI):
                    def text(self, size: int, current: Current) -> str:
                        following = current.communicator.stringToProxy(f"team/Player{size - 1}")
                        return self.name if size == 0 else GripperPrx.uncheckedCast(following).text(size - 1)

                return Passer(current.identity)

        pair.adapter.addServantLocator(Passing(), "team")
        assert GripperPrx.uncheckedCast(caller.stringToProxy("team/Player9")).text(9) == "team/Player0"

    def test_oneway_call_is_refused_rather_than_lost(self, pair: Pair) -> None:
        pair.adapter.addServantLocator(Players(), "team")
        with pytest.raises(TwowayOnlyException):
            oneway(GripperPrx.uncheckedCast(pair.client.stringToProxy("team/Player7"))).move(1.0)

    def test_locator_is_told_when_it_is_removed(self, pair: Pair) -> None:
        locator = Players()
        pair.adapter.addServantLocator(locator, "team")
        assert pair.adapter.findServantLocator("team") is locator
        assert pair.adapter.removeServantLocator("team") is locator
        assert locator.deactivated == ["team"]
        with pytest.raises(ObjectNotExistException):
            pair.adapter.removeServantLocator("team")


class TestReplicas:
    @pytest.fixture
    def second(self, pair: Pair, make_communicator: MakeCommunicator) -> ObjectAdapter:
        communicator = make_communicator(connect=[pair.endpoint], lease=LIMIT)
        adapter = communicator.createObjectAdapter("Second")
        adapter.activate()
        return adapter

    def wait_for_both(self, pair: Pair) -> None:
        """Wait until the client has heard of two."""
        until(lambda: len([info for info in pair.client.servants() if info.identity == "Ball"]) == 2)

    def test_replicas_serve_one_identity_and_each_can_be_called(
        self, pair: Pair, second: ObjectAdapter
    ) -> None:
        pair.adapter.add(GripperI("first"), "Ball", replica=True)
        second.add(GripperI("second"), "Ball", replica=True)
        self.wait_for_both(pair)
        proxy = gripper(pair.client, "Ball").ice_replicas("spread")
        assert {proxy.who() for _ in range(2)} == {"first:Ball", "second:Ball"}

    def test_oneway_call_reaches_one_of_them(self, pair: Pair, second: ObjectAdapter) -> None:
        servants = [GripperI(), GripperI()]
        for adapter, servant in zip((pair.adapter, second), servants, strict=True):
            adapter.add(servant, "Ball", replica=True)
        self.wait_for_both(pair)
        proxy = oneway(gripper(pair.client, "Ball").ice_replicas("spread"))
        for position in range(20):
            proxy.move(float(position))
        until(lambda: sum(len(servant.moved) for servant in servants) >= 20)
        assert sorted(servants[0].moved + servants[1].moved) == list(range(20))

    def test_the_others_go_on_when_one_is_removed(self, pair: Pair, second: ObjectAdapter) -> None:
        pair.adapter.add(GripperI("first"), "Ball", replica=True)
        second.add(GripperI("second"), "Ball", replica=True)
        self.wait_for_both(pair)
        started = time.monotonic()
        pair.adapter.remove("Ball")
        assert time.monotonic() - started < AT_ONCE
        until(lambda: len([info for info in pair.client.servants() if info.identity == "Ball"]) == 1)
        assert gripper(pair.client, "Ball").who() == "second:Ball"

    def test_replica_shares_with_replicas_alone(self, pair: Pair, second: ObjectAdapter) -> None:
        pair.adapter.add(GripperI(), "Ball", replica=True)
        pair.adapter.add(GripperI(), "Head")
        for name in ("Ball", "Head"):
            gripper(second.getCommunicator(), name)  # they are heard of there
        with pytest.raises(AlreadyRegisteredException):
            second.add(GripperI(), "Ball")
        with pytest.raises(AlreadyRegisteredException):
            second.add(GripperI(), "Head", replica=True)


class TestLife:
    def test_call_that_waits_when_its_servant_is_removed_is_not_executed(
        self, pair: Pair, caller: Communicator
    ) -> None:
        servant = GripperI()
        servant.leave.clear()
        pair.adapter.add(servant, "Gripper")
        proxy = gripper(caller, "Gripper").ice_invocationTimeout(LIMIT * 1000)
        with ThreadPoolExecutor(2) as threads:
            first = threads.submit(proxy.move, 1.0)
            assert servant.entered.acquire(timeout=LIMIT)
            second = threads.submit(proxy.move, 2.0)
            wait([second], 0.2)  # has it wait its turn; one that came too late would be told the same
            pair.adapter.remove("Gripper")
            assert isinstance(second.exception(AT_ONCE), ObjectNotExistException)
            servant.leave.set()
            assert first.exception(LIMIT) is None
        assert servant.moved == [1.0]

    def test_adapter_can_be_deactivated_and_activated_again(self, pair: Pair, caller: Communicator) -> None:
        pair.adapter.add(GripperI("own"), "Ball")
        pair.adapter.addDefaultServant(GripperI("default"), "soccer")
        proxies = [gripper(caller, text) for text in ("Ball", "soccer/Goal")]
        pair.adapter.deactivate()
        assert pair.adapter.isDeactivated()
        assert pair.adapter.waitForDeactivate(LIMIT)
        for proxy in proxies:
            with pytest.raises(ObjectNotExistException):
                proxy.who()
        pair.adapter.activate()
        assert not pair.adapter.isDeactivated()
        assert [GripperPrx.checkedCast(proxy).who() for proxy in proxies] == [
            "own:Ball",
            "default:soccer/Goal",
        ]

    def test_waiting_for_the_end_covers_calls_that_took_too_long(
        self, pair: Pair, caplog: pytest.LogCaptureFixture
    ) -> None:
        slow = GripperI()
        slow.leave.clear()
        pair.adapter.add(slow, "Ball")
        busy = threading.Thread(target=gripper(pair.client, "Ball").move, args=(1.0,))
        busy.start()
        assert slow.entered.acquire(timeout=LIMIT)
        assert not pair.adapter.waitForDeactivate(0.0)
        pair.adapter.deactivate()
        assert "a call of Ball@nao still runs" in caplog.text
        assert not pair.adapter.waitForDeactivate(0.1)
        slow.leave.set()
        assert pair.adapter.waitForDeactivate(LIMIT)
        assert slow.moved == [1.0]
        busy.join(LIMIT)


def oneway(proxy: GripperPrx) -> GripperPrx:
    return proxy.ice_oneway()
