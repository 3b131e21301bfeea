"""Clients and servers when processes die, hang, return, or never started."""

from __future__ import annotations

import signal
import subprocess
import sys
import textwrap
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing, contextmanager
from functools import partial
from itertools import product

import pytest
import zenoh

from tests.support.calculator import CalculatorPrx, Reading
from tests.support.calculator_servant import CalculatorI
from tests.support.carriers import LOCAL, NETWORK, is_used, over_both, over_one
from tests.support.limited import HASTY, limited_pair
from tests.support.limits import CALL_LIMIT, END_LIMIT, EVENT_LIMIT, FOREVER, LONGEST_CALL, RUN_LIMIT
from tests.support.processes import REPOSITORY, STEADY, ComponentProcess, free_endpoint, module
from tests.support.relay import Relay
from tests.support.serving import serve
from tests.support.soak import cases
from tests.support.suite import Pair
from tests.support.waiting import call_until_it_works, links, listened, until
from zenoh_ice import (
    Communicator,
    CommunicatorDestroyedException,
    ConfigurationException,
    ConnectFailedException,
    ConnectionLostException,
    Current,
    EndpointInUseException,
    ObjectNotExistException,
    SystemException,
    TimeoutException,
    initialize,
)
from zenoh_ice.routes._transport import RoutedTransport
from zenoh_ice.threads.limits import Limits

SERVER = "tests.support.calculator_server"
CALLER = """
import sys, time
from tests.support.calculator import CalculatorPrx
from zenoh_ice import SystemException, initialize
with initialize(clock="wall", lease=0.5, connect=[sys.argv[1]]) as client:
    calculator = CalculatorPrx.checkedCast(client.stringToProxy("Calculator"))
    while True:
        try:
            calculator.count()
            print("called by", client.client_id, flush=True)
        except SystemException:
            pass
        time.sleep(0.05)
"""

ONE_CALL = """
import os, sys
from tests.support.calculator import CalculatorPrx
from zenoh_ice import initialize
from zenoh_ice.carriers.zenoh._network import Network
if sys.argv[2] == "quick":  # the process ends before anybody has got its token
    Network.appear = lambda self, realm: None
with initialize(clock="wall", connect=[sys.argv[1]]) as client:
    calculator = CalculatorPrx.checkedCast(client.stringToProxy("Calculator"))
    print("calls", flush=True)
    print("called by", calculator.who(), flush=True)
    os._exit(0)
"""

ORDERS = ("both at once", "server first", "client first", "twice", "from a callback")

MakeCommunicator = Callable[..., Communicator]


@pytest.fixture
def server(endpoint: str) -> Iterator[ComponentProcess]:
    with ComponentProcess(module(SERVER, "--listen", endpoint), STEADY) as process:
        process.wait_for("^ready")
        yield process


@pytest.fixture(scope="module")
def lasting() -> Iterator[tuple[ComponentProcess, str]]:
    """A server that outlives tests which freeze it or lose their other peers, and its endpoint."""
    endpoint = free_endpoint()
    with ComponentProcess(module(SERVER, "--listen", endpoint), {"VISUALHFSM_LEASE": "1.0"}) as process:
        process.wait_for("^ready")
        yield process, endpoint


@contextmanager
def frozen(process: ComponentProcess) -> Iterator[None]:
    """Stop a process, and let it go on at the end."""
    process.freeze()
    try:
        yield
    finally:
        process.process.send_signal(signal.SIGCONT)


@pytest.fixture
def client(endpoint: str, make_communicator: MakeCommunicator) -> Communicator:
    return make_communicator(connect=[endpoint])


class TestNoServer:
    def test_cast_names_the_endpoint_and_how_to_start_a_server(
        self, endpoint: str, client: Communicator
    ) -> None:
        calculator = client.stringToProxy("Calculator").ice_invocationTimeout(200)
        with pytest.raises(ConnectFailedException, match="start a server") as caught:
            CalculatorPrx.checkedCast(calculator)
        assert endpoint in str(caught.value)

    def test_call_and_wait_and_future_say_the_same(self, client: Communicator) -> None:
        calculator = CalculatorPrx.uncheckedCast(client.stringToProxy("Calculator")).ice_invocationTimeout(
            200
        )
        with pytest.raises(ConnectFailedException):
            calculator.add(1.0, 2.0)
        with pytest.raises(ConnectFailedException):
            calculator.add.begin(1.0, 2.0).result(CALL_LIMIT)
        with pytest.raises(ConnectFailedException):
            calculator.getReading.wait(timeout=0.1)

    def test_server_that_starts_while_a_client_looks_for_it_is_found(
        self, endpoint: str, client: Communicator, make_communicator: MakeCommunicator
    ) -> None:
        found: list[CalculatorPrx] = []
        looking = threading.Thread(
            target=lambda: found.append(CalculatorPrx.checkedCast(client.stringToProxy("Calculator")))
        )
        looking.start()
        serve(make_communicator(listen=[endpoint]), CalculatorI(), "Calculator")
        looking.join(EVENT_LIMIT)
        assert found[0].add(1.0, 2.0) == 3.0

    def test_destroy_ends_the_search(self, endpoint: str, make_communicator: MakeCommunicator) -> None:
        client = make_communicator(connect=[endpoint], timeout=LONGEST_CALL)
        outcome: list[BaseException] = []

        def look() -> None:
            try:
                CalculatorPrx.checkedCast(client.stringToProxy("Calculator"))
            except SystemException as error:
                outcome.append(error)

        looking = threading.Thread(target=look)
        looking.start()
        client.destroy()
        looking.join(EVENT_LIMIT)
        assert isinstance(outcome[0], CommunicatorDestroyedException)


class TestServerKilled:
    @over_both
    def test_it_is_reported_at_once_and_proxies_and_streams_survive_the_restart(
        self, carrier: str, endpoint: str, make_communicator: MakeCommunicator
    ) -> None:
        client = make_communicator(connect=[endpoint], timeout=LONGEST_CALL)
        seen: list[int] = []
        outcome: list[BaseException] = []
        silent = CalculatorPrx.uncheckedCast(client.stringToProxy("SilentCalculator"))

        def follow() -> None:
            try:
                silent.getReading.wait(timeout=LONGEST_CALL)
            except SystemException as error:
                outcome.append(error)

        with ComponentProcess(module(SERVER, "--listen", endpoint), STEADY) as first:
            server_id = first.wait_for("^ready (.*)")[1].strip()
            calculator = CalculatorPrx.checkedCast(client.stringToProxy("Calculator"))
            assert [calculator.count() for _ in range(3)] == [1, 2, 3]
            assert is_used(carrier)
            assert is_used(carrier, first.process.pid)
            subscription = calculator.getReading.subscribe(lambda sample: seen.append(sample.value.count))
            until(lambda: seen and seen[-1] >= 5)
            call = calculator.sleep.begin(FOREVER)
            follower = threading.Thread(target=follow)
            follower.start()
            # A wait that begins after the loss would last until the server is back.
            until(lambda: client.processStatus(server_id).servants["SilentCalculator@nao"].listened)
            first.process.kill()
            with pytest.raises(ConnectionLostException):
                call.result(CALL_LIMIT)
            with pytest.raises(ConnectionLostException, match="is offline"):
                calculator.count()
            follower.join(EVENT_LIMIT)
            assert isinstance(outcome[0], ConnectionLostException)
        until(lambda: not links(client))
        for _ in range(10):
            with pytest.raises(ConnectionLostException):
                calculator.count()
        before = len(seen)
        with ComponentProcess(module(SERVER, "--listen", endpoint), STEADY) as second:
            second.wait_for("^ready")
            call_until_it_works(calculator)
            assert calculator.count() == 1  # none of those that failed was executed later
            assert is_used(carrier, second.process.pid)
            until(lambda: len(seen) > before)
            assert calculator.getReading.wait(timeout=EVENT_LIMIT).value.count > 0
        subscription.close()

    @over_one
    def test_idempotent_call_is_sent_once_more_and_no_other(
        self, endpoint: str, make_communicator: MakeCommunicator
    ) -> None:
        """The first server dies in the middle of the calls; the second is there as soon as the machine lets it."""
        limits = Limits(retry=EVENT_LIMIT)
        client = make_communicator(connect=[endpoint], timeout=LONGEST_CALL, limits=limits)
        second = make_communicator(connect=[endpoint])
        with ComponentProcess(module(SERVER, "--listen", endpoint), STEADY) as first:
            server_id = first.wait_for("^ready (.*)")[1].strip()
            calculator = CalculatorPrx.checkedCast(client.stringToProxy("Calculator"))
            calculator.add(1.0, 2.0)
            calculator.count()
            calculator.sleep.begin(FOREVER)  # both calls wait behind this one
            outcomes: dict[str, object] = {}

            def call(name: str, function: Callable[[], object]) -> None:
                try:
                    outcomes[name] = function()
                except SystemException as error:
                    outcomes[name] = error

            threads = [
                threading.Thread(target=call, args=("idempotent", lambda: calculator.add(1.0, 2.0))),
                threading.Thread(target=call, args=("other", calculator.count)),
            ]
            for thread in threads:
                thread.start()

            def waiting() -> int:
                return client.processStatus(server_id).servants["Calculator@nao"].waiting

            until(lambda: waiting() == 2)
            until(lambda: second.client_id in links(client))  # made with the help of the first, which dies
            first.process.kill()
            until(lambda: "Calculator" not in second.identities())
            servant = CalculatorI()
            serve(second, servant, "Calculator")
            for thread in threads:
                thread.join(CALL_LIMIT)
        assert outcomes["idempotent"] == 3.0
        assert isinstance(outcomes["other"], ConnectionLostException)
        assert servant.counted == 0


class TestServerFrozen:
    @over_both
    def test_call_ends_within_its_timeout_and_the_loss_is_noticed(
        self, lasting: tuple[ComponentProcess, str], make_communicator: MakeCommunicator
    ) -> None:
        server, endpoint = lasting
        client = make_communicator(connect=[endpoint])
        calculator = CalculatorPrx.checkedCast(client.stringToProxy("Calculator"))
        calculator.add(1.0, 2.0)
        impatient = calculator.ice_invocationTimeout(300)

        def is_lost() -> bool:
            try:
                impatient.count()
            except TimeoutException:
                return False
            except ConnectionLostException:
                return True
            raise AssertionError("a server that stands still has answered")

        with frozen(server), ThreadPoolExecutor(1) as thread:
            error = thread.submit(impatient.count).exception(EVENT_LIMIT)
            assert isinstance(error, (TimeoutException, ConnectionLostException))
            until(is_lost, CALL_LIMIT)
        call_until_it_works(calculator)

    @over_both
    def test_sending_to_a_frozen_server_ends_within_the_timeout(
        self, endpoint: str, server: ComponentProcess, make_communicator: MakeCommunicator
    ) -> None:
        """More data than all buffers hold: the sender must not wait for room, after 1 s the link is lost."""
        client = make_communicator(connect=[endpoint], timeout=1.0)
        calculator = CalculatorPrx.checkedCast(client.stringToProxy("Calculator"))
        data = bytes(8 << 20)
        assert calculator.ice_invocationTimeout(CALL_LIMIT * 1000).echo(data) == data
        with frozen(server):
            with pytest.raises(TimeoutException):
                calculator.ice_invocationTimeout(300).echo(data)
            with pytest.raises((TimeoutException, ConnectionLostException)):
                calculator.ice_invocationTimeout(1000).echo(data)

    @over_one
    def test_what_was_given_up_meanwhile_is_not_executed_when_it_goes_on(
        self, lasting: tuple[ComponentProcess, str], make_communicator: MakeCommunicator
    ) -> None:
        server, endpoint = lasting
        client = make_communicator(connect=[endpoint])
        calculator = CalculatorPrx.checkedCast(client.stringToProxy("Calculator"))
        before = calculator.count()
        with frozen(server):
            for _ in range(4):  # so long that the server notices that it stood still
                with pytest.raises((TimeoutException, ConnectionLostException)):
                    calculator.ice_invocationTimeout(200).count()
        call_until_it_works(calculator)
        assert calculator.count() == before + 1


class TestLinkThatStandsStill:
    @pytest.mark.parametrize(("limit", "still"), [(FOREVER, 1.3), (CALL_LIMIT, 0.4)])
    def test_large_call_is_not_lost(
        self, pair: Pair, make_communicator: MakeCommunicator, limit: float, still: float
    ) -> None:
        """More data than all buffers hold: the sender waits for room, as long as the limit of the call."""
        pair.adapter.add(CalculatorI(), "Calculator")
        with Relay(pair.endpoint) as relay:
            client = make_communicator(connect=[relay.endpoint], local_sockets=False)
            calculator = CalculatorPrx.checkedCast(client.stringToProxy("Calculator"))
            data = bytes(8 << 20)
            assert calculator.echo(data) == data
            relay.hold()
            resume = threading.Timer(still, relay.resume)
            resume.start()
            try:
                assert calculator.ice_invocationTimeout(limit * 1000).echo(data) == data
            finally:
                resume.join()
            client.destroy()

    def test_large_call_in_the_background_is_not_lost(
        self, pair: Pair, make_communicator: MakeCommunicator
    ) -> None:
        pair.adapter.add(CalculatorI(), "Calculator")
        with Relay(pair.endpoint) as relay:
            client = make_communicator(connect=[relay.endpoint], local_sockets=False, timeout=LONGEST_CALL)
            calculator = CalculatorPrx.checkedCast(client.stringToProxy("Calculator"))
            data = bytes(8 << 20)
            assert calculator.echo(data) == data
            relay.hold()
            resume = threading.Timer(0.4, relay.resume)
            resume.start()
            large, small = calculator.echo.begin(data), calculator.add.begin(1.0, 2.0)
            assert large.result(CALL_LIMIT) == data
            assert small.result(CALL_LIMIT) == 3.0
            resume.join()
            client.destroy()

    def test_a_call_that_may_not_take_so_long_is_given_up(
        self, pair: Pair, make_communicator: MakeCommunicator
    ) -> None:
        """More data than all buffers hold: a call with a shorter limit than others does not wait for room."""
        pair.adapter.add(CalculatorI(), "Calculator")
        with Relay(pair.endpoint) as relay:
            client = make_communicator(connect=[relay.endpoint], local_sockets=False, timeout=LONGEST_CALL)
            calculator = CalculatorPrx.checkedCast(client.stringToProxy("Calculator"))
            hurried = calculator.ice_invocationTimeout(200)
            relay.hold()
            large = hurried.echo.begin(bytes(8 << 20))
            with pytest.raises(TimeoutException):
                large.result(CALL_LIMIT)
            for call in [hurried.count.begin() for _ in range(1100)]:
                with pytest.raises(TimeoutException):
                    call.result(CALL_LIMIT)
            relay.resume()
            call_until_it_works(calculator)
            client.destroy()


class TestClients:
    @pytest.fixture
    def other(
        self, by_environment: None, lasting: tuple[ComponentProcess, str], carrier: str
    ) -> Iterator[tuple[ComponentProcess, str]]:
        """A process that calls the lasting server again and again over the carrier, and its id."""
        _, endpoint = lasting
        with ComponentProcess([sys.executable, "-c", CALLER, endpoint]) as process:
            client_id = process.wait_for("^called by (.*)")[1].strip()
            assert is_used(carrier, process.process.pid)
            yield process, client_id

    @over_one
    def test_server_is_notified_of_a_killed_client(
        self, lasting: tuple[ComponentProcess, str], other: tuple[ComponentProcess, str]
    ) -> None:
        server, _ = lasting
        process, client_id = other
        process.process.kill()
        server.wait_for(f"^lost {client_id}")

    @over_both
    def test_server_is_notified_of_a_frozen_client(
        self, lasting: tuple[ComponentProcess, str], other: tuple[ComponentProcess, str], carrier: str
    ) -> None:
        server, _ = lasting
        process, client_id = other
        with frozen(process):
            server.wait_for(f"^lost {client_id}")
            before = process.output.count("called by")
        until(lambda: process.output.count("called by") > before)
        until(lambda: is_used(carrier, process.process.pid))

    def test_server_is_notified_of_a_client_that_ends(
        self, pair: Pair, make_communicator: MakeCommunicator
    ) -> None:
        lost: list[str] = []
        names: list[str] = []

        def callback(client: str) -> None:
            names.append(threading.current_thread().name)
            lost.append(client)

        pair.server.onClientLost(callback)
        pair.adapter.add(CalculatorI(), "Calculator")
        who = CalculatorPrx.checkedCast(pair.client.stringToProxy("Calculator")).who()
        pair.client.destroy()
        until(lambda: who in lost)
        assert names[0].startswith("zenoh_ice")

    @over_one
    def test_a_client_that_ended_before_its_token_came_is_lost(
        self, by_environment: None, endpoint: str, make_communicator: MakeCommunicator
    ) -> None:
        pair = limited_pair(endpoint, make_communicator, Limits(token_checks=10))
        lost: list[str] = []
        pair.server.onClientLost(lost.append)
        pair.adapter.add(CalculatorI(), "Calculator")
        with ComponentProcess([sys.executable, "-c", ONE_CALL, endpoint, "quick"]) as process:
            client_id = process.wait_for("^called by (.*)")[1].strip()
            until(lambda: lost == [client_id])

    @over_one
    def test_a_client_whose_call_is_executed_after_its_end_is_lost_again(
        self, by_environment: None, endpoint: str, make_communicator: MakeCommunicator
    ) -> None:
        pair = limited_pair(endpoint, make_communicator, Limits(token_checks=25))
        lost: list[str] = []
        callers: list[str] = []
        leave = threading.Event()

        class Slow(CalculatorI):
            def who(self, current: Current) -> str:
                callers.append(current.client)
                assert leave.wait(EVENT_LIMIT)
                return current.client

        pair.server.onClientLost(lost.append)
        pair.adapter.add(Slow(), "Calculator")
        with ComponentProcess([sys.executable, "-c", ONE_CALL, pair.endpoint, "slow"]) as process:
            until(lambda: callers)
            process.process.kill()
            until(lambda: lost == callers)
            leave.set()
            until(lambda: lost == 2 * callers)

    def test_a_server_that_calls_itself_is_no_lost_client(
        self, endpoint: str, make_communicator: MakeCommunicator
    ) -> None:
        pair = limited_pair(endpoint, make_communicator, Limits(token_checks=2))
        lost: list[str] = []
        pair.server.onClientLost(lost.append)
        pair.adapter.add(CalculatorI(), "Calculator")
        assert CalculatorPrx.checkedCast(pair.server.stringToProxy("Calculator")).who()
        with ComponentProcess([sys.executable, "-c", ONE_CALL, pair.endpoint, "quick"]) as process:
            other = process.wait_for("^called by (.*)")[1].strip()
            until(lambda: lost)
        assert set(lost) == {other}

    def test_closed_watch_reports_nobody(self, pair: Pair) -> None:
        pair.adapter.add(CalculatorI(), "Calculator")
        who = CalculatorPrx.checkedCast(pair.client.stringToProxy("Calculator")).who()
        reported: dict[str, list[str]] = {"closed": [], "open": []}
        with (
            closing(pair.server.onClientLost(reported["closed"].append)) as watch,
            closing(pair.server.onClientLost(reported["open"].append)),
        ):
            watch.close()
            pair.client.destroy()
            until(lambda: who in reported["open"])
            assert reported["closed"] == []

    def test_clients_of_one_server_reach_each_other_without_a_router(
        self, endpoint: str, server: ComponentProcess, make_communicator: MakeCommunicator
    ) -> None:
        behavior, monitor = (make_communicator(connect=[endpoint]) for _ in range(2))
        servant = serve(behavior, CalculatorI(), "Behavior")
        proxy = CalculatorPrx.checkedCast(monitor.stringToProxy("Behavior"))
        assert proxy.add(1.0, 2.0) == 3.0
        until(lambda: behavior.client_id in links(monitor))
        server.process.kill()  # the direct link does not need the server
        until(lambda: "Calculator" not in monitor.identities())
        assert proxy.add(1.0, 2.0) == 3.0
        proxy.getReading.latest()
        assert listened(servant.getReadingPublisher, EVENT_LIMIT)
        servant.getReadingPublisher.publish(Reading(1, []))
        assert proxy.getReading.wait(timeout=EVENT_LIMIT)


class TestEndpoints:
    def test_port_in_use_is_said(self, pair: Pair) -> None:
        with pytest.raises(EndpointInUseException, match="port in use") as caught:
            initialize(listen=[pair.endpoint], connect=[], clock="wall")
        assert pair.endpoint in str(caught.value)

    def test_address_that_is_not_ours_is_refused(self) -> None:
        with pytest.raises(ConfigurationException) as caught:
            initialize(listen=["tcp/192.0.2.1:7447"], connect=[], clock="wall")
        assert "tcp/192.0.2.1:7447" in str(caught.value)
        assert ".rs:" not in str(caught.value)  # no place in Zenoh's sources

    def test_server_may_listen_where_everybody_connects(
        self, endpoint: str, make_communicator: MakeCommunicator
    ) -> None:
        server = make_communicator(listen=[endpoint], connect=[endpoint], limits=HASTY)
        serve(server, CalculatorI(), "Calculator")
        client = make_communicator(connect=[endpoint])
        assert CalculatorPrx.checkedCast(client.stringToProxy("Calculator")).add(1.0, 2.0) == 3.0
        with pytest.raises(ObjectNotExistException):
            CalculatorPrx.checkedCast(server.stringToProxy("Absent"))

    def test_call_reaches_one_of_two_servers_of_an_identity(
        self, make_communicator: MakeCommunicator
    ) -> None:
        """Both started before either could know of the other."""
        endpoints = [free_endpoint(), free_endpoint()]
        servants = [CalculatorI(), CalculatorI()]
        for endpoint, servant in zip(endpoints, servants, strict=True):
            serve(make_communicator(listen=[endpoint]), servant, "Calculator")
        client = make_communicator(connect=endpoints)
        calculator = CalculatorPrx.checkedCast(client.stringToProxy("Calculator"))
        until(lambda: len(links(client)) == 2)
        for _ in range(20):
            calculator.count()
        assert sum(servant.counted for servant in servants) == 20


def run_script(script: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-W", "ignore", "-c", textwrap.dedent(script), *arguments],
        cwd=REPOSITORY,
        timeout=RUN_LIMIT,
        capture_output=True,
        text=True,
    )


class TestEndOfTheProgram:
    def test_program_that_forgets_to_destroy_ends(self, lasting: tuple[ComponentProcess, str]) -> None:
        result = run_script(
            """
            import sys
            from tests.support.calculator import CalculatorPrx
            from tests.support.calculator_servant import CalculatorI
            from zenoh_ice import initialize

            communicator = initialize(connect=[sys.argv[1]], clock="wall")
            adapter = communicator.createObjectAdapter("Forgotten")
            adapter.add(CalculatorI(), "Forgotten")
            adapter.activate()
            communicator.onClientLost(print)
            calculator = CalculatorPrx.checkedCast(communicator.stringToProxy("Calculator"))
            calculator.getReading.subscribe(lambda sample: None)
            calculator.getReading.wait(timeout=60)
            calculator.sleep.begin(1.0)
            print("end")
            """,
            lasting[1],
        )
        assert (result.returncode, result.stdout.strip(), result.stderr) == (0, "end", "")

    def test_program_that_fails_shows_its_own_error_alone(self, endpoint: str) -> None:
        result = run_script(
            """
            import sys
            from zenoh_ice import initialize

            communicator = initialize(connect=[], listen=[sys.argv[1]], clock="wall")
            raise RuntimeError("its own error")
            """,
            endpoint,
        )
        assert result.returncode == 1
        assert result.stderr.strip().endswith("RuntimeError: its own error")

    def test_interrupt_ends_a_waiting_server(self, server: ComponentProcess) -> None:
        server.process.send_signal(signal.SIGINT)
        server.wait_for("^interrupted")
        assert server.wait(END_LIMIT) == 0

    def test_interrupt_ends_a_waiting_call(self, pair: Pair) -> None:
        servant = CalculatorI()
        pair.adapter.add(servant, "Calculator")
        result = run_script(
            """
            import os, signal, sys, threading
            from tests.support.calculator import CalculatorPrx
            from zenoh_ice import initialize

            with initialize(connect=[sys.argv[1]], clock="wall") as communicator:
                calculator = CalculatorPrx.checkedCast(communicator.stringToProxy("Calculator"))
                calculator.add(1.0, 2.0)
                long = calculator.ice_invocationTimeout(float(sys.argv[2]) * 1000)
                try:
                    threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT)).start()
                    long.sleep(float(sys.argv[2]))
                except KeyboardInterrupt:
                    print("interrupted")
            """,
            pair.endpoint,
            str(FOREVER),
        )
        servant.leave.set()
        assert result.stdout.strip() == "interrupted", result.stderr

    def test_forked_child_is_refused_and_ends(self, lasting: tuple[ComponentProcess, str]) -> None:
        result = run_script(
            """
            import os, sys
            from tests.support.calculator import CalculatorPrx
            from zenoh_ice import CommunicatorDestroyedException, initialize

            with initialize(connect=[sys.argv[1]], clock="wall") as communicator:
                calculator = CalculatorPrx.checkedCast(communicator.stringToProxy("Calculator"))
                calculator.add(1.0, 2.0)
                child = os.fork()
                if child == 0:
                    code = 1
                    try:
                        calculator.add(1.0, 2.0)
                    except CommunicatorDestroyedException:
                        code = 7
                    communicator.destroy()
                    os._exit(code)
                print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), calculator.add(1.0, 2.0))
            """,
            lasting[1],
        )
        assert result.stdout.strip() == "7 3.0", result.stderr


def test_session_that_fails_to_open_leaves_nothing(pair: Pair) -> None:
    before = set(threading.enumerate())  # of which some may end meanwhile
    for _ in range(3):
        with pytest.raises(EndpointInUseException):
            initialize(listen=[free_endpoint(), pair.endpoint], connect=[], clock="wall")
    assert set(threading.enumerate()) <= before


def test_a_session_that_cannot_end_in_time_does_not_fail_the_end(
    make_communicator: MakeCommunicator, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """Behave like a peer that no longer accepts data."""

    class Stuck:
        def __init__(self, session: zenoh.Session) -> None:
            self.session = session

        def __getattr__(self, name: str) -> object:
            return getattr(self.session, name)

        def close(self) -> None:
            self.session.close()
            raise zenoh.ZError("close operation timed out!")

    communicator = make_communicator()
    transport = communicator.transport
    assert isinstance(transport, RoutedTransport)
    monkeypatch.setattr(transport.network, "session", Stuck(transport.network.session))
    communicator.destroy()
    assert "close operation timed out" in caplog.text


@pytest.mark.parametrize(
    ("carrier", "order"),
    cases(
        [(LOCAL, "both at once"), (NETWORK, "from a callback")],
        (pytest.param(*each) for each in product((LOCAL, NETWORK), ORDERS)),
    ),
)
def test_destroy_in_the_middle_of_everything(
    endpoint: str, make_communicator: MakeCommunicator, order: str
) -> None:
    """Threads that call, publish and follow find out; none hangs, and nothing but our exceptions is raised."""
    server, client = make_communicator(listen=[endpoint]), make_communicator(connect=[endpoint])
    adapter = server.createObjectAdapter("Test")
    servants = [CalculatorI() for _ in range(3)]
    for number, servant in enumerate(servants):
        adapter.add(servant, f"Calculator{number}")
    adapter.activate()
    proxies = [
        CalculatorPrx.checkedCast(communicator.stringToProxy(f"Calculator{number}"))
        for communicator in (server, client)
        for number in range(3)
    ]
    stop = threading.Event()
    surprises: list[BaseException] = []

    def repeat(step: Callable[[], object]) -> None:
        while not stop.wait(0.001):  # some hundred times a second, without pushing the others aside
            try:
                step()
            except CommunicatorDestroyedException:
                return
            except SystemException:
                continue
            except BaseException as error:  # noqa: BLE001
                surprises.append(error)
                return

    def publish() -> None:
        for servant in servants:
            servant.getReadingPublisher.publish(Reading(1, []))

    def use(proxy: CalculatorPrx) -> None:
        proxy.add(1.0, 2.0)
        proxy.add.begin(1.0, 2.0)
        proxy.getReading.latest()

    steps: list[Callable[[], object]] = [publish, publish]
    for proxy in proxies:
        proxy.getReading.subscribe(lambda _: None)
        steps += [partial(use, proxy), partial(proxy.getReading.wait, timeout=0.5)]
    threads = [threading.Thread(target=repeat, args=(step,)) for step in steps]
    for thread in threads:
        thread.start()
    for proxy in proxies:
        proxy.getReading.wait(timeout=EVENT_LIMIT)
    match order:
        case "both at once" | "twice":
            targets = [server, client] * (2 if order == "twice" else 1)
            destroyers = [threading.Thread(target=communicator.destroy) for communicator in targets]
            for destroyer in destroyers:
                destroyer.start()
            for destroyer in destroyers:
                destroyer.join(EVENT_LIMIT)
                assert not destroyer.is_alive()
        case "server first":
            server.destroy()
            client.destroy()
        case "client first":
            client.destroy()
            server.destroy()
        case "from a callback":
            proxies[-1].getReading.subscribe(lambda _: client.destroy())
            assert client.waitForShutdown(EVENT_LIMIT)
            server.destroy()
    stop.set()
    for thread in threads:
        thread.join(EVENT_LIMIT)
        assert not thread.is_alive()
    assert not surprises


@pytest.mark.parametrize("timeout", [0.1, 0.5])
def test_a_wait_for_a_stream_ends_in_time_although_its_server_hangs(
    timeout: float, lasting: tuple[ComponentProcess, str], make_communicator: MakeCommunicator
) -> None:
    limits = Limits(status=FOREVER)  # of the question why it is silent
    server, endpoint = lasting
    client = make_communicator(connect=[endpoint], lease=LONGEST_CALL, limits=limits)
    calculator = CalculatorPrx.checkedCast(client.stringToProxy("Calculator"))
    with frozen(server):
        waiting = threading.Thread(target=silent, args=(calculator, timeout), daemon=True)
        waiting.start()
        waiting.join(CALL_LIMIT)
        assert not waiting.is_alive()


def silent(calculator: CalculatorPrx, timeout: float) -> None:
    with pytest.raises(TimeoutException):
        calculator.getReading.wait(timeout=timeout)
