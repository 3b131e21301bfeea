"""Measure how soon callers are notified of faults: the figures of docs/explanation/faults.md.

Servers and routers run in separate processes, with the default settings of components: calls of at most 2 s,
a lease of 2 s. Each fault is caused several times; the median and the longest time are printed.
"""

from __future__ import annotations

import logging
import signal
import statistics
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import contextmanager, suppress
from typing import Final

from benchmarks.common import options
from tests.support.calculator import CalculatorPrx, NewerCalculatorPrx, Reading
from tests.support.calculator_servant import CalculatorI
from tests.support.processes import ComponentProcess, free_endpoint, module
from tests.support.relay import Relay
from tests.support.waiting import links
from zenoh_ice import Communicator, Sample, SystemException, ZenohIceError, initialize

SERVER: Final = "tests.support.calculator_server"
LONG: Final = 60.0  # s
LIMIT: Final = 120.0  # s within which every fault has been reported

_logger = logging.getLogger("zenoh_ice")

Figures = dict[str, list[float]]
"""The measured seconds by fault."""


@contextmanager
def serving(endpoint: str) -> Iterator[ComponentProcess]:
    """Serve a calculator in a separate process."""
    with ComponentProcess(module(SERVER, "--listen", endpoint)) as server:
        server.wait_for("^ready")
        yield server


@contextmanager
def calling(
    endpoint: str, *, mode: str = "peer", listen: tuple[str, ...] = ("tcp/127.0.0.1:0",)
) -> Iterator[tuple[Communicator, CalculatorPrx]]:
    """Connect to an endpoint, and wait until the calculator answers."""
    with initialize(connect=[endpoint], clock="wall", mode=mode, listen=listen) as communicator:
        calculator = CalculatorPrx.uncheckedCast(communicator.stringToProxy("Calculator"))
        until_it_works(calculator)
        yield communicator, calculator


def patient(calculator: CalculatorPrx) -> CalculatorPrx:
    """Return a proxy with a limit so long that calls end for another reason."""
    return calculator.ice_invocationTimeout(LONG * 1000)


def failing(call: Callable[[], object]) -> float:
    """Return the duration in s of a call that fails."""
    began = time.monotonic()
    try:
        call()
    except (ZenohIceError, StopIteration):
        return time.monotonic() - began
    raise AssertionError("the call did not fail")


def until(condition: Callable[[], object]) -> float:
    """Return the time in s until a condition holds."""
    began = time.monotonic()
    while not condition():
        if time.monotonic() - began > LIMIT:
            raise AssertionError("it took too long")
        time.sleep(0.0005)
    return time.monotonic() - began


def until_it_works(calculator: CalculatorPrx) -> float:
    """Return the time in s until the server answers again."""

    def works() -> bool:
        with suppress(SystemException):
            return calculator.add(1.0, 2.0) == 3.0
        return False

    return until(works)


def pending(calculator: CalculatorPrx) -> Future[None]:
    """Start a call that takes long."""
    future = patient(calculator).sleep.begin(LONG)
    time.sleep(0.05)  # lets it arrive
    return future


def server_killed(figures: Figures) -> None:
    """Send SIGKILL, and start another server."""
    endpoint = free_endpoint()
    with calling_without_server(endpoint) as (communicator, calculator):
        with serving(endpoint) as server:
            until_it_works(calculator)
            calculator.getReading.wait(timeout=LONG)
            call = pending(calculator)
            server.process.kill()
            note(figures, "server killed: a call that runs", failing(lambda: call.result(LONG)))
            note(figures, "server killed: the next call", failing(calculator.count))
            until(lambda: not links(communicator))
        with serving(endpoint) as server:
            note(figures, "server restarted: calls work again", until_it_works(calculator))
            sample = calculator.getReading.wait(timeout=LONG)
            server.process.kill()
            note(
                figures,
                "server killed: waiting for a sample",
                failing(lambda: last(calculator, sample)),
            )


def last(calculator: CalculatorPrx, sample: Sample[Reading]) -> None:
    """Follow a stream to its end."""
    while True:
        sample = calculator.getReading.wait(after=sample, timeout=LONG)


@contextmanager
def calling_without_server(endpoint: str) -> Iterator[tuple[Communicator, CalculatorPrx]]:
    """Connect to an endpoint without a server."""
    with initialize(connect=[endpoint], clock="wall") as communicator:
        yield communicator, CalculatorPrx.uncheckedCast(communicator.stringToProxy("Calculator"))


def no_server(figures: Figures) -> None:
    """Cast while nothing answers."""
    with calling_without_server(free_endpoint()) as (_, calculator):
        note(figures, "no server: a cast", failing(lambda: CalculatorPrx.checkedCast(calculator)))


def server_frozen(figures: Figures) -> None:
    """SIGSTOP and SIGCONT."""
    endpoint = free_endpoint()
    with serving(endpoint) as server, calling(endpoint) as (_, calculator):
        server.freeze()
        note(
            figures,
            "server frozen: a call of at most 0.5 s",
            failing(calculator.ice_invocationTimeout(500).count),
        )
        server.process.send_signal(signal.SIGCONT)
        until_it_works(calculator)
        server.freeze()
        note(figures, "server frozen: a call of any length", failing(patient(calculator).count))
        server.process.send_signal(signal.SIGCONT)
        note(figures, "server continues: calls work again", until_it_works(calculator))


def network(figures: Figures) -> None:
    """Cut, hold and corrupt a connection with a relay."""
    endpoint = free_endpoint()
    with serving(endpoint), Relay(endpoint) as relay, calling(relay.endpoint, listen=()) as (_, calculator):
        relay.cut()
        note(figures, "connection cut: the next call", failing(patient(calculator).count))
        relay.resume()
        note(figures, "connection cut: calls work again", until_it_works(calculator))
        relay.hold()
        note(figures, "network silent: a call of any length", failing(patient(calculator).count))
        relay.resume()
        note(figures, "network silent: calls work again", until_it_works(calculator))
        relay.garble(_flip)
        began = time.monotonic()
        until(lambda: not works(calculator))
        until(lambda: not _linked(calculator))
        note(figures, "network corrupts data: the link is closed", time.monotonic() - began)
        relay.resume()
        note(figures, "network corrupts data: calls work again", until_it_works(calculator))


def _flip(data: bytearray) -> None:
    data[len(data) // 2] ^= 0x55


def _linked(calculator: CalculatorPrx) -> bool:
    works(calculator)
    return bool(links(calculator.ice_getCommunicator()))


def works(calculator: CalculatorPrx) -> bool:
    """Return whether a call succeeds."""
    with suppress(SystemException):
        return calculator.add(1.0, 2.0) == 3.0
    return False


def router_gone(figures: Figures) -> None:
    """Kill a router that connects the processes."""
    endpoint = free_endpoint()
    command = module("nao_tools", "router", "--listen", endpoint)
    with ComponentProcess(command) as router:
        router.wait_for("the router listens")
        with initialize(connect=[endpoint], clock="wall", mode="client") as server:
            adapter = server.createObjectAdapter("Test")
            adapter.add(CalculatorI(), "Calculator")
            adapter.activate()
            with calling(endpoint, mode="client") as (_, calculator):
                call = pending(calculator)
                router.process.kill()
                note(figures, "router gone: a call that runs", failing(lambda: call.result(LONG)))
                note(figures, "router gone: the next call", failing(calculator.count))
                with ComponentProcess(command) as second:
                    second.wait_for("the router listens")
                    communicator = calculator.ice_getCommunicator()
                    note(
                        figures,
                        "router back: servants are found again",
                        until(communicator.identities),
                    )


def client_gone(figures: Figures) -> None:
    """Kill and stop a client."""
    endpoint = free_endpoint()
    lost: list[str] = []
    with initialize(listen=[endpoint], connect=[], clock="wall") as server:
        server.onClientLost(lost.append)
        for fault, name in ((signal.SIGKILL, "client killed"), (signal.SIGSTOP, "client frozen")):
            note(figures, f"{name}: the server is notified", _losing_client(endpoint, server, lost, fault))


def _losing_client(endpoint: str, server: Communicator, lost: list[str], fault: int) -> float:
    """Return the time in s until a server is notified of a lost client."""
    with ComponentProcess(module(SERVER, "--connect", endpoint, "--identity", "Other")) as client:
        client_id = client.wait_for("^ready (.*)")[1].strip()
        until(lambda: "Other" in server.identities())
        time.sleep(0.2)  # until its token has arrived, too
        client.process.send_signal(fault)
        seconds = until(lambda: client_id in lost)
        client.process.kill()
        return seconds


def refusals(figures: Figures) -> None:
    """Use another version, serve an identity twice, and overload the server."""
    endpoint = free_endpoint()
    with serving(endpoint), calling(endpoint) as (communicator, calculator):
        newer = NewerCalculatorPrx.uncheckedCast(communicator.stringToProxy("Calculator"))
        note(figures, "other version: a call", failing(lambda: newer.add(1.0, 2.0)))
        note(figures, "other version: a cast", failing(lambda: NewerCalculatorPrx.checkedCast(newer)))
        adapter = communicator.createObjectAdapter("Second")
        adapter.add(CalculatorI(), "Calculator")
        note(figures, "identity already served: `activate`", failing(adapter.activate))
        running = pending(calculator)
        calls = [patient(calculator).count.begin() for _ in range(80)]
        newest = calls[-1]
        note(figures, "overload: a call beyond the queue", failing(lambda: newest.result(LONG)))
        assert not running.done()


class _Errors(logging.Handler):
    """Collects logged errors."""

    def __init__(self) -> None:
        super().__init__(logging.ERROR)
        self.messages: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        self.messages.append(record.getMessage())


def two_servers(figures: Figures) -> None:
    """Connect two servers of one identity through a client."""
    endpoints = [free_endpoint(), free_endpoint()]
    with (
        initialize(listen=[endpoints[0]], connect=[], clock="wall") as first,
        initialize(listen=[endpoints[1]], connect=[], clock="wall") as second,
    ):
        for server in (first, second):
            adapter = server.createObjectAdapter("Test")
            adapter.add(CalculatorI(), "Calculator")
            adapter.activate()
        errors = _Errors()
        _logger.addHandler(errors)
        try:
            with initialize(connect=endpoints, clock="wall"):
                note(
                    figures, "identity served twice: both report it", until(lambda: len(errors.messages) >= 2)
                )
        finally:
            _logger.removeHandler(errors)


def note(figures: Figures, what: str, seconds: float) -> None:
    """Record a figure."""
    figures.setdefault(what, []).append(seconds)


FAULTS: Final = (
    no_server,
    server_killed,
    server_frozen,
    network,
    router_gone,
    client_gone,
    refusals,
    two_servers,
)


def main() -> None:
    """Measure and print."""
    rounds = options(__doc__, rounds=5).rounds
    _logger.propagate = False  # log messages about the faults are not of interest here
    _logger.addHandler(logging.NullHandler())
    figures: Figures = {}
    for _ in range(rounds):
        for fault in FAULTS:
            fault(figures)
    width = max(map(len, figures))
    print(f"how soon callers are notified of faults, {rounds} rounds")
    print(f"{'':{width}} {'median':>10} {'longest':>10}")
    for what, seconds in figures.items():
        print(f"{what:{width}} {shown(statistics.median(seconds)):>10} {shown(max(seconds)):>10}")


def shown(seconds: float) -> str:
    """Return a duration as text."""
    return f"{seconds * 1000:.1f} ms" if seconds < 0.1 else f"{seconds:.2f} s"


if __name__ == "__main__":
    main()
