"""Images in answers: between processes of one machine through memory that the sender lends."""

from __future__ import annotations

import errno
import gc
import os
import sys
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from threading import Semaphore

import pytest

from interfaces.jderobot import ImageData
from tests.support.calculator import CalculatorPrx
from tests.support.calculator_servant import CalculatorI
from tests.support.image_servant import ImageI, Network, camera, image
from tests.support.limited import limited_pair
from tests.support.limits import CALL_LIMIT, EVENT_LIMIT, START_LIMIT
from tests.support.memory_files import lent_bytes, open_memory_files, shared_maps
from tests.support.open_files import open_files
from tests.support.processes import ComponentProcess, free_endpoint, module
from tests.support.serving import serve
from tests.support.soak import cases, repeated
from tests.support.suite import Pair
from tests.support.waiting import until
from zenoh_ice import Communicator, Current, MarshalException, TimeoutException
from zenoh_ice.carriers._local.memory import ArenaView, Extent
from zenoh_ice.carriers._local.server import local_space
from zenoh_ice.data.codec import LARGEST_BULK
from zenoh_ice.routes import _calls as routes
from zenoh_ice.threads.limits import Limits

PIXELS = bytes(range(256)) * 400
MEGABYTE = 1 << 20

pytestmark = pytest.mark.skipif(not local_space(), reason="no memory is shared here")


@pytest.fixture
def servant(pair: Pair) -> ImageI:
    servant = ImageI()
    pair.adapter.add(servant, "Camera")
    return servant


@pytest.fixture
def calculator(pair: Pair) -> CalculatorPrx:
    pair.adapter.add(CalculatorI(), "Calculator")
    return CalculatorPrx.checkedCast(pair.client.stringToProxy("Calculator"))


def wait_for_memory(call: Callable[[], object]) -> None:
    """Call until an answer came through lent memory: before that, the route through the socket may be unknown."""

    def lends() -> bool:
        call()
        return lent_bytes() > 0

    until(lends)


class TestMemory:
    @pytest.fixture(autouse=True)
    def no_garbage(self) -> None:
        """Collect what other tests have left: its files and maps would end while this test counts them."""
        gc.collect()

    def test_answers_travel_through_it(self, pair: Pair, servant: ImageI) -> None:
        proxy = camera(pair.client)
        wait_for_memory(lambda: proxy.getImageData("GRAY8"))
        first = shared_maps()  # with those of communicators that several tests share, which may end
        for _ in range(100):
            assert proxy.getImageData("GRAY8") == image()
        assert 0 < shared_maps() <= first

    def test_what_was_read_is_used_again(self, calculator: CalculatorPrx) -> None:
        content = bytes(4 * MEGABYTE)
        wait_for_memory(lambda: calculator.echo(content))
        lent = lent_bytes()
        for _ in range(10):
            assert calculator.echo(content) == content
        assert lent_bytes() <= lent + 3 * len(content)

    def test_idle_connections_keep_no_large_answers(
        self, endpoint: str, make_communicator: Callable[..., Communicator]
    ) -> None:
        together = threading.Barrier(4)

        class Echo(CalculatorI):
            ice_concurrent = True

            def echo(self, data: bytes, current: Current) -> bytes:
                together.wait(EVENT_LIMIT)
                return data

        pair = limited_pair(endpoint, make_communicator, Limits(memory=17 * MEGABYTE))
        servant = ImageI()
        pair.adapter.add(Echo(), "Calculator")
        pair.adapter.add(servant, "Camera")
        network = Network(pair.server)
        images: list[ImageData] = []
        with camera(pair.client).getImageData.subscribe(lambda sample: images.append(sample.value)):
            network.wait_until_unused(servant)
            calculator = CalculatorPrx.checkedCast(pair.client.stringToProxy("Calculator"))
            with ThreadPoolExecutor(4) as threads:
                content = bytes(4 * MEGABYTE)
                assert set(threads.map(calculator.echo, [content] * 4)) == {content}
            large = image(1, bytes(2 * MEGABYTE))

            def arrives() -> bool:
                servant.getImageDataPublisher.publish(large)
                return bool(images)

            until(arrives)
            assert not network.is_used

    def test_answers_that_nobody_waits_for_are_given_back(self, pair: Pair) -> None:
        class Late(ImageI):
            ice_concurrent = True

            def getImageData(self, format: str, current: Current) -> ImageData:
                assert leave.acquire(timeout=EVENT_LIMIT)
                return image(1, bytes(4 * MEGABYTE))

        leave = threading.Semaphore(0)
        pair.adapter.add(Late(), "Camera")
        proxy = camera(pair.client)
        impatient = proxy.ice_invocationTimeout(100)
        leave.release(100)
        wait_for_memory(lambda: proxy.getImageData("GRAY8"))
        while leave.acquire(blocking=False):
            pass
        with ThreadPoolExecutor(4) as threads:
            for _ in range(4):
                calls = [threads.submit(impatient.getImageData, "GRAY8") for _ in range(4)]
                for call in calls:
                    with pytest.raises(TimeoutException):
                        call.result(CALL_LIMIT)
                leave.release(2 * len(calls))
                for _ in range(4):
                    assert proxy.getImageData("GRAY8") == image(1, bytes(4 * MEGABYTE))
                while leave.acquire(blocking=False):
                    pass
        assert 0 < lent_bytes() < 9 * 4 * MEGABYTE  # of 32 answers, eight at most are under way at once

    def test_it_is_used_again_when_its_reader_was_killed(
        self,
        endpoint: str,
        make_communicator: Callable[..., Communicator],
    ) -> None:
        server = make_communicator(listen=[endpoint], limits=Limits(last_reads=0.0))
        servant = serve(server, ImageI(), "Camera")
        lent = []
        for _ in range(repeated(2, soak=5)):
            with ComponentProcess(module("tests.support.bulk_client", endpoint, "0")) as client:
                client.wait_for("^ready")
                pixels = bytes(4 * MEGABYTE)
                before = 0

                def is_full(pixels: bytes = pixels) -> bool:
                    nonlocal before
                    servant.getImageDataPublisher.publish(image(1, pixels))
                    before, grown = lent_bytes(), lent_bytes() > before
                    return not grown and before > 4 * len(pixels)

                until(is_full)
                client.process.kill()
            until(lambda: not servant.getImageDataPublisher.listening)
            lent.append(lent_bytes())
        assert lent[-1] == lent[0]  # which is what one reader holds

    def test_it_is_given_back_when_the_client_was_killed_during_the_call(
        self, endpoint: str, make_communicator: Callable[..., Communicator]
    ) -> None:
        server = make_communicator(listen=[endpoint])
        adapter = server.createObjectAdapter("Test")
        adapter.activate()
        entered, leave = threading.Semaphore(0), threading.Semaphore(0)
        answered = threading.Semaphore(0)

        class Slow(ImageI):
            def getImageData(self, format: str, current: Current) -> ImageData:
                entered.release()
                assert leave.acquire(timeout=START_LIMIT)
                answered.release()
                return image(1, bytes(4 * MEGABYTE))

        adapter.add(Slow(), "Camera")
        lost = threading.Semaphore(0)
        server.onClientLost(lambda _: lost.release())
        for _ in range(repeated(2, soak=5)):
            with ComponentProcess([sys.executable, "-c", CALLER, endpoint]) as client:
                assert entered.acquire(timeout=START_LIMIT)
                client.process.kill()
            assert lost.acquire(timeout=START_LIMIT)
            leave.release()
            assert answered.acquire(timeout=EVENT_LIMIT)
        leave.release(2)
        last = make_communicator(connect=[endpoint])
        assert camera(last).getImageData("GRAY8") == image(1, bytes(4 * MEGABYTE))
        assert lent_bytes() <= 2 * 4 * MEGABYTE

    def test_killed_servers_leave_nothing_in_their_clients(
        self, endpoint: str, make_communicator: Callable[..., Communicator]
    ) -> None:
        client = make_communicator(connect=[endpoint])
        proxy = CalculatorPrx.uncheckedCast(client.stringToProxy("Calculator"))
        others = shared_maps()
        files = 0
        for _ in range(repeated(2, soak=5)):
            with ComponentProcess(module("tests.support.calculator_server", "--listen", endpoint)) as server:
                server.wait_for("^ready")
                until(lambda: bool(client.identities()))
                until(lambda: proxy.echo(PIXELS) == PIXELS and shared_maps() == others + 1)
                server.process.kill()
            until(lambda: not client.identities())
            until(lambda: shared_maps() == others)  # without another image
            files = files or open_files()
            until(lambda most=files: open_files() <= most)  # type: ignore[misc]

    def test_destroy_lets_go_of_it(
        self, endpoint: str, make_communicator: Callable[..., Communicator]
    ) -> None:
        before = shared_maps(), open_memory_files()
        server, client = make_communicator(listen=[endpoint]), make_communicator(connect=[endpoint])
        servant = serve(server, ImageI(), "Camera")
        proxy = camera(client)
        wait_for_memory(lambda: proxy.getImageData("GRAY8"))
        proxy.getImageData.latest()
        until(lambda: servant.getImageDataPublisher.listening)
        servant.getImageDataPublisher.publish(image())
        server.destroy()
        client.destroy()
        until(lambda: (shared_maps(), open_memory_files()) == before)

    def test_collocated_call_needs_none(self, pair: Pair, servant: ImageI) -> None:
        before = lent_bytes()
        assert camera(pair.server).getImageData("GRAY8") == image()
        assert lent_bytes() == before


CALLER = """
import sys
from tests.support.image_servant import camera
from zenoh_ice import initialize
with initialize(clock="wall", connect=[sys.argv[1]]) as client:
    camera(client).getImageData("GRAY8")
"""


@pytest.mark.parametrize("without", ["client", "servant", "another machine"])
def test_without_local_sockets_answers_are_the_same(
    without: str,
    endpoint: str,
    make_communicator: Callable[..., Communicator],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    before = shared_maps(), lent_bytes()
    server = make_communicator(listen=[endpoint], local_sockets=without != "servant")
    serve(server, ImageI(), "Camera")
    maps = shared_maps(), lent_bytes()
    if without == "another machine":
        monkeypatch.setattr(routes, "local_space", lambda: "0123456789abcdef")
    proxy = camera(make_communicator(connect=[endpoint], local_sockets=without != "client"))
    assert [proxy.getImageData("GRAY8") for _ in range(3)] == [image()] * 3
    assert (shared_maps(), lent_bytes()) == maps
    assert without != "servant" or maps == before


NO_MEMORY = {"memfd_create": (errno.ENOSYS, 5 * MEGABYTE), "posix_fallocate": (errno.ENOSPC, len(PIXELS))}
"""What a machine refuses that has none, or whose memory is full; with the error, and the size of an answer then."""


@pytest.mark.parametrize("missing", NO_MEMORY)
def test_answers_go_through_the_socket_while_there_is_no_memory(
    missing: str,
    endpoint: str,
    make_communicator: Callable[..., Communicator],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    reason, size = NO_MEMORY[missing]

    def refuse(*_: object) -> int:
        raise OSError(reason, os.strerror(reason))

    before, content = lent_bytes(), bytes(size)
    monkeypatch.setattr(os, missing, refuse)
    server = make_communicator(listen=[endpoint])
    serve(server, CalculatorI(), "Calculator")
    proxy = CalculatorPrx.checkedCast(make_communicator(connect=[endpoint]).stringToProxy("Calculator"))
    for _ in range(5):
        assert proxy.echo(content) == content
    calls = [proxy.echo.begin(content) for _ in range(5)]
    assert all(call.result(CALL_LIMIT) == content for call in calls)
    assert lent_bytes() == before


@pytest.fixture(scope="module")
def distant_calculator() -> Iterator[str]:
    """The endpoint of a server in another process: in one, each argument and result would take memory twice."""
    endpoint = free_endpoint()
    with ComponentProcess(module("tests.support.calculator_server", "--listen", endpoint)) as server:
        server.wait_for("^ready")
        yield endpoint


@pytest.mark.parametrize("waits", [True, False], ids=["call", "begin"])
@pytest.mark.parametrize("size", cases([LARGEST_BULK - 100], [8 * MEGABYTE]))
def test_the_largest_arguments_and_results_arrive(
    size: int, waits: bool, distant_calculator: str, make_communicator: Callable[..., Communicator]
) -> None:
    client = make_communicator(connect=[distant_calculator])
    calculator = CalculatorPrx.checkedCast(client.stringToProxy("Calculator"))
    wait_for_memory(lambda: calculator.echo(PIXELS))
    content = os.urandom(size)
    for _ in range(repeated(1, soak=5)):
        answer = calculator.echo(content) if waits else calculator.echo.begin(content).result(CALL_LIMIT)
        assert answer == content


def test_what_is_too_large_is_refused_and_the_next_call_works(pair: Pair) -> None:
    class Generous(CalculatorI):
        def echo(self, data: bytes, current: Current) -> bytes:
            return data + bytes(LARGEST_BULK) if data == b"more" else data

    pair.adapter.add(Generous(), "Calculator")
    calculator = CalculatorPrx.checkedCast(pair.client.stringToProxy("Calculator"))
    wait_for_memory(lambda: calculator.echo(PIXELS))
    for argument in (bytes(LARGEST_BULK), b"more"):
        with pytest.raises(MarshalException, match=r"at most 335\d{5}"):
            calculator.echo(argument)
        with pytest.raises(MarshalException, match=r"at most 335\d{5}"):
            calculator.echo.begin(argument).result(CALL_LIMIT)
        assert calculator.echo(PIXELS) == PIXELS


def test_many_images_may_be_in_flight(calculator: CalculatorPrx) -> None:
    wait_for_memory(lambda: calculator.echo(PIXELS))
    contents = [bytes([number]) * MEGABYTE for number in range(16)]
    for _ in range(3):
        calls = [calculator.echo.begin(content) for content in contents]
        assert [call.result(CALL_LIMIT) for call in calls] == contents


def test_answers_of_a_server_that_ends_then_are_received(
    pair: Pair, servant: ImageI, monkeypatch: pytest.MonkeyPatch
) -> None:
    read, reading, gone = ArenaView.read, Semaphore(0), threading.Event()

    def read_late(view: ArenaView, extent: Extent, limit: int, what: str) -> list[bytes]:
        reading.release()
        assert gone.wait(EVENT_LIMIT)  # until the link to the server is lost
        return read(view, extent, limit, what)

    proxy = camera(pair.client)
    wait_for_memory(lambda: proxy.getImageData("GRAY8"))
    monkeypatch.setattr(ArenaView, "read", read_late)
    with ThreadPoolExecutor(4) as threads:
        answers = [threads.submit(proxy.getImageData, "GRAY8") for _ in range(4)]
        for _ in answers:
            assert reading.acquire(timeout=EVENT_LIMIT)
        pair.server.destroy()
        gone.set()
        assert all(answer.result(CALL_LIMIT) == image() for answer in answers)
