"""An overloaded server, and what its callers see."""

from __future__ import annotations

import itertools
import threading
from collections.abc import Callable
from concurrent.futures import wait
from functools import partial

import msgpack
import psutil
import pytest

from interfaces.jderobot import ImageData, ImageProviderPrx
from tests.conftest import Pair
from tests.support.calculator import CALCULATOR, CalculatorPrx
from tests.support.calculator_servant import CalculatorI
from tests.support.image_servant import ImageI, image
from tests.support.limits import CALL_LIMIT, EVENT_LIMIT, FOREVER, LONGEST_CALL
from tests.support.memory_files import shared_maps
from tests.support.processes import ComponentProcess, module
from tests.support.stranger import stranger
from tests.support.waiting import until
from zenoh_ice import BusyException, Communicator, Sample
from zenoh_ice._presence import client_token
from zenoh_ice._wire import encode_call_attachment
from zenoh_ice._zenoh import shared_memory
from zenoh_ice._zenoh.shared_memory import memory_space

MakeCommunicator = Callable[..., Communicator]

SERVER = "tests.support.calculator_server"
WAITING = 64  # calls of a servant
MEGABYTE = 1 << 20


def test_too_many_calls_are_refused_and_take_no_memory(
    endpoint: str, make_communicator: MakeCommunicator
) -> None:
    with ComponentProcess(module(SERVER, "--listen", endpoint)) as server:
        server.wait_for("^ready")
        client = make_communicator(connect=[endpoint], timeout=LONGEST_CALL)
        calculator = CalculatorPrx.checkedCast(client.stringToProxy("Calculator"))
        data = bytes(MEGABYTE)
        assert calculator.echo(data) == data
        before = own_memory(server)
        calculator.sleep.begin(FOREVER)
        waiting = [calculator.echo.begin(data) for _ in range(WAITING)]
        for _ in range(5):
            refused = [calculator.echo.begin(data) for _ in range(30)]
            for call in refused:
                with pytest.raises(BusyException, match="not executed"):
                    call.result(CALL_LIMIT)
        assert own_memory(server) - before < 150 * MEGABYTE  # of 214: those that wait, and 30 on their way
        server.process.kill()
        wait(waiting, CALL_LIMIT)


def own_memory(process: ComponentProcess) -> int:
    """Return how many bytes a process has for itself."""
    memory = psutil.Process(process.process.pid).memory_info()
    return int(memory.rss - memory.shared)


def is_reference(payload: bytes) -> bool:
    """Return whether a payload is not a map but an array with the place of its bytes."""
    return payload[0] & 0xF0 == 0x90


@pytest.mark.skipif(not memory_space(), reason="no memory is shared here")
class TestSharedMemory:
    def test_without_room_for_it_everything_travels_over_the_network(
        self, endpoint: str, make_communicator: MakeCommunicator
    ) -> None:
        # No file of this process may be larger than 4 MB, as if there were no memory for 8 answers.
        limited = ["sh", "-c", 'ulimit -f 4096; exec "$@"', "sh", *module(SERVER, "--listen", endpoint)]
        with ComponentProcess(limited) as server:
            server.wait_for("^ready")
            client = make_communicator(connect=[endpoint])
            calculator = CalculatorPrx.checkedCast(client.stringToProxy("Calculator"))
            data = bytes(MEGABYTE)

            def reported() -> int:
                return server.output.count("large payloads go over the network")

            until(lambda: calculator.echo(data) == data and reported())
            for _ in range(3):
                assert calculator.echo(data) == data
            assert reported() == 1

    def test_what_finds_no_room_travels_over_the_network(
        self, pair: Pair, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setattr(shared_memory, "LENT_FOR", FOREVER)
        pair.adapter.add(CalculatorI(), "Calculator")
        calculator = CalculatorPrx.checkedCast(pair.client.stringToProxy("Calculator"))
        data, numbers = bytes(MEGABYTE), itertools.count(1)
        # Somebody who could read the memory, and never gives it back.
        with stranger(pair.endpoint) as hoarder:
            own = hoarder.session.liveliness().declare_token(client_token("nao", hoarder.id, memory_space()))

            def answer() -> bytes:
                about = encode_call_attachment(CALCULATOR.fingerprint, next(numbers), hoarder.id, CALL_LIMIT)
                (reply,) = hoarder.ask("nao/Calculator/echo", msgpack.packb({"data": data}), about)
                assert reply.ok is not None
                return reply.ok.payload.to_bytes()

            until(lambda: is_reference(answer()))
            assert [is_reference(answer()) for _ in range(9)] == 7 * [True] + 2 * [False]
            assert msgpack.unpackb(answer()) == {"returnValue": data}
            assert calculator.echo(data) == data
            own.undeclare()

    def test_an_image_that_is_read_too_late_counts_as_lost(self, pair: Pair) -> None:
        servant = ImageI()
        pair.adapter.add(servant, "Camera")
        publish = servant.getImageDataPublisher.publish
        images = ImageProviderPrx.checkedCast(pair.client.stringToProxy("Camera")).getImageData

        def came(number: int) -> bool:
            newest = images.latest()
            return newest is not None and newest.value.timeStamp.seconds == number

        def shares() -> bool:
            publish(image(0))
            return came(0) and shared_maps() > 0

        until(shares)
        publish(image(1))
        until(lambda: came(1))
        entered, leave = threading.Event(), threading.Event()
        received: list[tuple[int, int]] = []

        def callback(sample: Sample[ImageData]) -> None:
            received.append((sample.value.timeStamp.seconds, sample.lost))
            entered.set()
            assert leave.wait(FOREVER)

        with images.subscribe(callback, queue=100):
            publish(image(2))
            assert entered.wait(EVENT_LIMIT)
            for number in range(3, 23):
                publish(image(number))
                until(partial(came, number))  # a stream may drop what a busy machine does not take in time
            leave.set()
            until(lambda: received[-1][0] == 22)
        # There is room for 8.
        assert received == [(2, 0), (15, 12), *((number, 0) for number in range(16, 23))]
