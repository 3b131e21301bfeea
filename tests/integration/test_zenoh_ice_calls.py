"""Calls between two sessions over loopback: values, exceptions, limits and their order."""

from __future__ import annotations

import logging
import math
import signal
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor, wait

import pytest

from tests.support.calculator import (
    CalculatorError,
    CalculatorPrx,
    DivisionByZero,
    NewerCalculatorPrx,
    Node,
    ScientificPrx,
    UnrelatedPrx,
)
from tests.support.calculator_servant import CalculatorI, drains
from tests.support.carriers import anywhere, everywhere, is_used, over_both, over_one
from tests.support.limited import HASTY, limited_pair
from tests.support.limits import CALL_LIMIT, EVENT_LIMIT, FOREVER
from tests.support.suite import Pair
from tests.support.waiting import links, until
from zenoh_ice import (
    Communicator,
    CommunicatorDestroyedException,
    InterfaceMismatchException,
    MarshalException,
    ObjectNotExistException,
    ObjectPrx,
    OperationNotExistException,
    TimeoutException,
    UnknownException,
)
from zenoh_ice.data.interface import Operation
from zenoh_ice.data.values import Struct
from zenoh_ice.threads.limits import Limits


@pytest.fixture
def hasty(pair: Pair, make_communicator: Callable[..., Communicator]) -> Communicator:
    """A client that does not wait for servants that are not there."""
    hasty = make_communicator(connect=[pair.endpoint], limits=HASTY)
    until(lambda: links(hasty))
    return hasty


@pytest.fixture
def calculator(caller: Communicator, servant: CalculatorI) -> ScientificPrx:
    return ScientificPrx.checkedCast(caller.stringToProxy("Calculator"))


@pytest.fixture
def remote(pair: Pair, servant: CalculatorI) -> ScientificPrx:
    return ScientificPrx.checkedCast(pair.client.stringToProxy("Calculator"))


class TestValues:
    @everywhere
    def test_arguments_and_result_arrive(self, carrier: str, calculator: ScientificPrx) -> None:
        assert calculator.add(1.5, 2.0) == 3.5
        assert is_used(carrier)

    @anywhere
    def test_values_of_each_kind_arrive(self, calculator: ScientificPrx) -> None:
        assert calculator.power(2.0, 10.0) == 1024.0  # its own operation; the others are inherited
        assert CalculatorPrx.checkedCast(calculator).add(1.0, 1.0) == 2.0
        assert math.isnan(calculator.add(math.nan, 1.0))
        assert calculator.add(math.inf, 1.0) == math.inf
        assert calculator.total(Node(1, Node(2, Node(3, None)))) == 6
        assert calculator.divide(7.0, 2.0) == (3.0, 1.0)  # out parameters follow the return value
        assert calculator.split([1.0, 2.0, 3.0]) == ([1.0], [2.0, 3.0])  # or stand alone

    @everywhere
    def test_large_byte_sequences_arrive(self, calculator: ScientificPrx) -> None:
        data = bytes(range(256)) * 16_000  # 4 MB
        assert calculator.echo(data) == data

    @anywhere
    def test_arrays_of_numpy_travel_as_bytes_and_lists(self, calculator: ScientificPrx) -> None:
        numpy = pytest.importorskip("numpy")
        assert calculator.echo(numpy.arange(6, dtype=numpy.uint8).reshape(2, 3)) == bytes(range(6))
        assert calculator.split(numpy.array([1.0, 2.0])) == ([1.0], [2.0])
        assert calculator.add(numpy.float64(1.0), numpy.float32(2.0)) == 3.0

    @anywhere
    def test_first_call_of_a_proxy_may_be_asynchronous(
        self, caller: Communicator, servant: CalculatorI
    ) -> None:
        proxy = CalculatorPrx.uncheckedCast(caller.stringToProxy("Calculator"))
        assert proxy.add.begin(1.0, 2.0).result(CALL_LIMIT) == 3.0

    @everywhere
    def test_servant_knows_the_caller(self, calculator: ScientificPrx) -> None:
        assert calculator.who() == calculator.ice_getCommunicator().client_id

    @anywhere
    def test_built_in_operations_answer(self, calculator: ScientificPrx) -> None:
        calculator.ice_ping()
        assert calculator.ice_id() == "::test::Scientific"
        assert calculator.ice_ids() == ["::Ice::Object", "::test::Calculator", "::test::Scientific"]
        assert calculator.ice_isA("::test::Calculator")
        assert not calculator.ice_isA("::test::Unrelated")


class TestExceptions:
    @everywhere
    def test_declared_exception_arrives_whole(self, calculator: ScientificPrx) -> None:
        with pytest.raises(CalculatorError, match="as declared") as caught:
            calculator.fail("declared")
        assert type(caught.value) is CalculatorError

    @anywhere
    def test_exception_derived_from_a_declared_one_arrives_as_itself(self, calculator: ScientificPrx) -> None:
        with pytest.raises(DivisionByZero) as caught:
            calculator.divide(4.0, 0.0)
        assert (caught.value.what, caught.value.dividend) == ("the divisor is 0", 4.0)

    @anywhere
    def test_undeclared_user_exception_is_unknown(self, calculator: ScientificPrx) -> None:
        with pytest.raises(UnknownException, match="::test::OtherError"):
            calculator.fail("undeclared")

    @anywhere
    def test_other_exception_is_unknown_with_its_text_alone(
        self, calculator: ScientificPrx, caplog: pytest.LogCaptureFixture
    ) -> None:
        with caplog.at_level(logging.ERROR, "zenoh_ice"), pytest.raises(UnknownException) as caught:
            calculator.fail("the gripper is stuck")
        assert str(caught.value) == "RuntimeError: the gripper is stuck"
        assert "Traceback" in caplog.text  # the server's log has what the client does not get

    @anywhere
    @pytest.mark.parametrize(
        ("how", "reported"),
        [
            ("exit", "SystemExit: 3"),
            ("cancelled", "CancelledError"),
            ("generator", "GeneratorExit"),
            ("mute", "Mute: its text failed with ValueError"),
        ],
    )
    def test_nothing_that_a_servant_raises_ends_its_thread(
        self, calculator: ScientificPrx, how: str, reported: str
    ) -> None:
        with pytest.raises(UnknownException) as caught:
            calculator.fail(how)
        assert str(caught.value) == reported
        assert calculator.add(1.0, 1.0) == 2.0

    @anywhere
    def test_missing_operation_is_named(self, calculator: ScientificPrx) -> None:
        class _Nothing(Struct):
            pass

        with pytest.raises(OperationNotExistException, match="'fly'"):
            calculator.ice_invoke(Operation("fly", arguments=_Nothing, result=_Nothing))

    @pytest.mark.parametrize(
        ("operation", "argument", "message", "path"),
        [
            pytest.param("add", "one", r"Calculator\.add", "$.a", id="type"),
            pytest.param(
                "total", Node(1, Node(1 << 40, None)), r"Calculator\.total", "$.head.next.value", id="nested"
            ),
            pytest.param("add", object(), "object", "", id="what cannot travel"),
            pytest.param("split", [0.5] * 200_000, "bytes; at most", "", id="size"),
        ],
    )
    def test_wrong_arguments_are_refused(
        self, calculator: ScientificPrx, operation: str, argument: object, message: str, path: str
    ) -> None:
        call = getattr(calculator, operation)
        with pytest.raises(MarshalException, match=message) as caught:
            call(argument, 2.0) if operation == "add" else call(argument)
        assert not path or caught.value.path == path
        assert calculator.add(1.0, 1.0) == 2.0

    @over_one
    def test_result_that_does_not_fit_is_reported(self, pair: Pair) -> None:
        class Careless(CalculatorI):
            def divide(self, a, b, current):
                return a / b

            def count(self, current):
                return "many"

        pair.adapter.add(Careless(), "Careless")
        proxy = CalculatorPrx.checkedCast(pair.client.stringToProxy("Careless"))
        with pytest.raises(MarshalException, match=r"expected a tuple \(returnValue, remainder\), got float"):
            proxy.divide(1.0, 2.0)
        with pytest.raises(MarshalException) as caught:
            proxy.count()
        assert caught.value.path == "$.returnValue"


class TestPresence:
    def test_absent_servant_is_named_with_its_like(self, hasty: Communicator, servant: CalculatorI) -> None:
        until(hasty.identities)
        with pytest.raises(ObjectNotExistException, match=r"'Calculater'.*Calculator"):
            CalculatorPrx.checkedCast(hasty.stringToProxy("Calculater"))

    @pytest.mark.parametrize("how", ["named", "all", "shutdown"])
    def test_servants_that_never_return_hold_up_their_removal_for_one_limit_together(
        self,
        endpoint: str,
        make_communicator: Callable[..., Communicator],
        how: str,
        monkeypatch: pytest.MonkeyPatch,
        caplog: pytest.LogCaptureFixture,
    ) -> None:
        waited, pair = drains(monkeypatch), limited_pair(endpoint, make_communicator, Limits(drain=0.2))
        names = [f"Busy{number}" for number in range(4)]
        servants = {name: CalculatorI() for name in names}
        for name, servant in servants.items():
            pair.adapter.add(servant, name)
        for name, servant in servants.items():
            CalculatorPrx.checkedCast(pair.client.stringToProxy(name)).sleep.begin(FOREVER)
            assert servant.entered.wait(EVENT_LIMIT)
        if how == "shutdown":
            pair.server.shutdown()
        else:
            assert pair.adapter.removeAll([*names, "Absent"] if how == "named" else None) == servants
            assert pair.adapter.find(names[0]) is None
            assert pair.adapter.removeAll() == {}
        assert len(waited) == len(servants)
        assert sum(waited) <= 0.2
        assert "a call of Busy0@nao still runs" in caplog.text
        for servant in servants.values():
            servant.leave.set()

    def test_untyped_proxy_needs_presence_alone(self, pair: Pair, servant: CalculatorI) -> None:
        ObjectPrx.checkedCast(pair.client.stringToProxy("Calculator")).ice_ping()

    @pytest.mark.parametrize("where", ["client", "server"])
    def test_other_interface_is_refused(
        self, pair: Pair, hasty: Communicator, servant: CalculatorI, where: str
    ) -> None:
        communicator = hasty if where == "client" else pair.server
        until(communicator.identities)
        with pytest.raises(InterfaceMismatchException, match="::test::Scientific, not a ::test::Unrelated"):
            UnrelatedPrx.checkedCast(communicator.stringToProxy("Calculator"))

    @pytest.mark.parametrize("where", ["client", "server"])
    def test_other_version_is_refused_with_the_difference(
        self, pair: Pair, servant: CalculatorI, where: str
    ) -> None:
        with pytest.raises(InterfaceMismatchException) as caught:
            NewerCalculatorPrx.checkedCast(getattr(pair, where).stringToProxy("Calculator"))
        assert caught.value.expected == "c0ffee0000000003"
        assert caught.value.found == "c0ffee0000000001"
        assert "add(int a, double b)" in caught.value.member
        assert "add(double a, double b)" in caught.value.member
        assert all(
            part in str(caught.value) for part in ("c0ffee0000000003", "c0ffee0000000001", "add(int a")
        )

    @pytest.mark.parametrize("where", ["client", "server"])
    def test_call_of_another_version_is_refused(self, pair: Pair, servant: CalculatorI, where: str) -> None:
        proxy = NewerCalculatorPrx.uncheckedCast(getattr(pair, where).stringToProxy("Calculator"))
        with pytest.raises(InterfaceMismatchException) as caught:
            proxy.add(1.0, 2.0)
        with pytest.raises(InterfaceMismatchException) as caught_async:
            proxy.add.begin(1.0, 2.0).result(CALL_LIMIT)
        for error in (caught.value, caught_async.value):
            assert "the proxy has `::test::Calculator::add(int a, double b): double` where" in error.member
            assert error.member in str(error)

    @over_one
    def test_realms_are_apart(self, pair: Pair, servant: CalculatorI, make_communicator) -> None:
        other = make_communicator(connect=[pair.endpoint], realm="other", limits=HASTY)
        until(lambda: links(other))
        with pytest.raises(ObjectNotExistException):
            CalculatorPrx.checkedCast(other.stringToProxy("Calculator"))
        until(lambda: other.identities("nao"))
        assert CalculatorPrx.checkedCast(other.stringToProxy("Calculator@nao")).add(1.0, 2.0) == 3.0


class TestTime:
    @everywhere
    def test_slow_call_ends_with_a_timeout(self, calculator: ScientificPrx, servant: CalculatorI) -> None:
        hurried = calculator.ice_invocationTimeout(200)
        with pytest.raises(TimeoutException, match=r"Calculator.sleep did not answer within 0\.2 s"):
            hurried.sleep(FOREVER)
        servant.leave.set()

    @over_both
    def test_call_whose_caller_gave_up_is_not_executed(
        self, remote: ScientificPrx, servant: CalculatorI
    ) -> None:
        busy = remote.sleep.begin(FOREVER)
        assert servant.entered.wait(EVENT_LIMIT)
        with pytest.raises(TimeoutException):
            remote.ice_invocationTimeout(100).count()
        servant.leave.set()
        busy.result(CALL_LIMIT)
        assert remote.count() == 1

    @over_one
    def test_calls_of_a_servant_run_one_at_a_time(self, remote: ScientificPrx, servant: CalculatorI) -> None:
        wait([remote.sleep.begin(0.02) for _ in range(10)], EVENT_LIMIT)
        assert servant.most_running == 1

    @over_one
    def test_calls_of_a_concurrent_servant_overlap(self, pair: Pair) -> None:
        servant = CalculatorI()
        servant.ice_concurrent = True
        pair.adapter.add(servant, "Concurrent")
        proxy = CalculatorPrx.checkedCast(pair.client.stringToProxy("Concurrent"))
        calls = [proxy.sleep.begin(FOREVER) for _ in range(2)]
        until(lambda: servant.most_running == 2)
        servant.leave.set()
        wait(calls, EVENT_LIMIT)

    @over_one
    def test_servants_that_call_each_other_do_not_use_up_the_threads(
        self, endpoint, make_communicator
    ) -> None:
        server = make_communicator(listen=[endpoint], dispatch_threads=1)
        adapter = server.createObjectAdapter("Chain")
        adapter.activate()

        class Link(CalculatorI):
            def power(self, a, b, current):
                if b == 0:
                    return a
                following = ScientificPrx.checkedCast(server.stringToProxy(f"Link{int(b) - 1}"))
                return following.power(a + 1, b - 1)

        for number in range(6):
            adapter.add(Link(), f"Link{number}")
        client = make_communicator(connect=[endpoint])
        assert ScientificPrx.checkedCast(client.stringToProxy("Link5")).power(0.0, 5.0) == 5.0


class TestThreads:
    @over_one
    def test_user_code_runs_on_threads_of_the_communicator(self, pair: Pair, remote: ScientificPrx) -> None:
        names: list[str] = []
        done = threading.Event()

        class Named(CalculatorI):
            def add(self, a, b, current):
                names.append(threading.current_thread().name)
                return a + b

        pair.adapter.add(Named(), "Named")
        future = CalculatorPrx.checkedCast(pair.client.stringToProxy("Named")).add.begin(1.0, 2.0)

        def note(_future):
            names.append(threading.current_thread().name)
            done.set()

        future.add_done_callback(note)
        assert done.wait(EVENT_LIMIT)
        assert names[0].startswith("zenoh_ice nao")
        assert names[1].startswith("zenoh_ice nao") or names[1] == "MainThread"  # if it was done already

    @over_one
    def test_call_inside_a_futures_callback_works(self, remote: ScientificPrx) -> None:
        results: list[float] = []
        done = threading.Event()

        def again(future):
            results.append(remote.add(future.result(), 1.0))
            done.set()

        remote.add.begin(1.0, 2.0).add_done_callback(again)
        assert done.wait(EVENT_LIMIT)
        assert results == [4.0]


class TestLife:
    @over_both
    def test_destroy_ends_a_call_that_waits_behind_another_while_no_thread_is_free(
        self, pair: Pair, servant: CalculatorI, make_communicator: Callable[..., Communicator]
    ) -> None:
        client = make_communicator(connect=[pair.endpoint], dispatch_threads=1)
        calculator = CalculatorPrx.checkedCast(client.stringToProxy("Calculator"))
        calculator.sleep.begin(FOREVER)
        assert servant.entered.wait(EVENT_LIMIT)
        busy, free = threading.Barrier(3), threading.Event()
        for _ in range(2):  # one of them usually waits for files
            client.pool.submit(lambda: (busy.wait(EVENT_LIMIT), free.wait(EVENT_LIMIT)))
        busy.wait(EVENT_LIMIT)
        (served,) = pair.server.served.values()
        with ThreadPoolExecutor(2) as threads:
            waits = threads.submit(calculator.add, 1.0, 2.0)
            until(lambda: served.status().waiting == 1)
            threads.submit(client.destroy)
            try:
                assert isinstance(waits.exception(EVENT_LIMIT), CommunicatorDestroyedException)
            finally:
                free.set()
                servant.leave.set()

    @over_both
    def test_destroyed_communicator_refuses(self, pair: Pair, remote: ScientificPrx) -> None:
        remote.add(1.0, 2.0)
        pair.client.destroy()
        with pytest.raises(CommunicatorDestroyedException):
            remote.add(1.0, 2.0)
        with pytest.raises(CommunicatorDestroyedException):
            remote.add.begin(1.0, 2.0)
        with pytest.raises(CommunicatorDestroyedException):
            remote.getReading.latest()
        with pytest.raises(CommunicatorDestroyedException):
            pair.client.createObjectAdapter("Late")

    @over_one
    def test_servant_may_destroy_its_communicator(self, pair: Pair) -> None:
        class Last(CalculatorI):
            def count(self, current):
                current.communicator.destroy()
                return 1

        pair.adapter.add(Last(), "Last")
        call = CalculatorPrx.checkedCast(pair.client.stringToProxy("Last")).count.begin()
        assert pair.server.waitForShutdown(EVENT_LIMIT)
        assert call.exception(CALL_LIMIT) is not None  # the way back was closed

    def test_a_signal_that_strikes_another_thread_ends_the_wait(self, pair: Pair) -> None:
        noticed, overslept = threading.Event(), threading.Event()

        def strike() -> None:
            signal.pthread_kill(threading.get_ident(), signal.SIGINT)
            if not noticed.wait(EVENT_LIMIT):
                overslept.set()
                pair.server.shutdown()

        def wait_for_the_strike() -> None:
            striker.start()
            pair.server.waitForShutdown()

        striker = threading.Timer(0.1, strike)
        with pytest.raises(KeyboardInterrupt):
            wait_for_the_strike()
        noticed.set()
        striker.join(EVENT_LIMIT)
        assert not overslept.is_set()

    def test_shutdown_withdraws_servants_and_keeps_proxies(
        self, pair: Pair, hasty: Communicator, servant: CalculatorI
    ) -> None:
        until(hasty.identities)
        other = pair.client.createObjectAdapter("Other")
        other.add(CalculatorI(), "Other")
        other.activate()
        proxy = CalculatorPrx.checkedCast(pair.server.stringToProxy("Other"))
        pair.server.shutdown()
        assert pair.server.waitForShutdown(0)
        assert proxy.add(1.0, 2.0) == 3.0
        until(lambda: "Calculator" not in hasty.identities())
        with pytest.raises(ObjectNotExistException):
            CalculatorPrx.checkedCast(hasty.stringToProxy("Calculator"))
