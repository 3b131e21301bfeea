"""Images between sessions: through shared memory if possible, otherwise over the network."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable
from itertools import cycle
from mmap import mmap
from typing import Any

import pytest
from zenoh.handlers import RingChannel

from interfaces.jderobot import ImageData, ImageProviderPrx
from tests.conftest import Pair
from tests.support.calculator import CalculatorPrx
from tests.support.image_servant import ImageI, image
from tests.support.limits import CALL_LIMIT, EVENT_LIMIT, RUN_LIMIT
from tests.support.memory_files import open_memory_files, shared_maps
from tests.support.processes import ComponentProcess, module
from tests.support.stranger import session_of
from tests.support.waiting import listened, until
from zenoh_ice import Communicator, ConnectionLostException, Current, Sample
from zenoh_ice._presence import client_token
from zenoh_ice._zenoh import shared_memory
from zenoh_ice._zenoh.shared_memory import MemoryReference, memory_space

PIXELS = bytes(range(256)) * 400
WIRE_KEY = "nao/Camera/getImageData"

pytestmark = pytest.mark.skipif(not memory_space(), reason="no memory is shared here")


@pytest.fixture
def servant(pair: Pair) -> ImageI:
    servant = ImageI()
    pair.adapter.add(servant, "Camera")
    return servant


def camera(client: Communicator) -> ImageProviderPrx:
    return ImageProviderPrx.checkedCast(client.stringToProxy("Camera"))


class Wire:
    """The encoded samples of a stream."""

    def __init__(self, client: Communicator, servant: ImageI) -> None:
        self._servant = servant
        self._subscriber: Any = session_of(client).declare_subscriber(WIRE_KEY, RingChannel(1))
        assert listened(servant.getImageDataPublisher, EVENT_LIMIT)

    def shares(self) -> bool:
        """Publish images until one arrives, and return whether it went through shared memory."""
        samples: list[Any] = []

        def published() -> bool:
            self._servant.getImageDataPublisher.publish(image())
            samples[:] = [self._subscriber.try_recv()]
            return samples[0] is not None

        until(published)
        return bool(samples[0].payload.to_bytes()[0] & 0xF0 == 0x90)  # a reference: every payload is a map


def test_answers_travel_through_shared_memory(pair: Pair, servant: ImageI) -> None:
    proxy = camera(pair.client)
    until(lambda: proxy.getImageData("GRAY8") == image() and open_memory_files())
    for _ in range(100):  # more than there is room for at once
        assert proxy.getImageData("GRAY8") == image()
    calls = [proxy.getImageData.begin("GRAY8") for _ in range(30)]
    assert all(call.result(CALL_LIMIT) == image() for call in calls)


def test_samples_travel_through_shared_memory(pair: Pair, servant: ImageI) -> None:
    wire = Wire(pair.client, servant)
    until(wire.shares)
    proxy = camera(pair.client)
    proxy.getImageData.latest()
    images: list[ImageData] = []
    with proxy.getImageData.subscribe(lambda sample: images.append(sample.value), queue=8):
        for number in range(200):
            servant.getImageDataPublisher.publish(image(number))
            assert wire.shares()
        until(lambda: image() == proxy.getImageData.wait(None, EVENT_LIMIT).value)
        until(lambda: len(images) >= 8)
    assert all(each == image(each.timeStamp.seconds) for each in images)  # none torn


def test_a_client_without_shared_memory_sends_all_over_the_network(
    pair: Pair, servant: ImageI, make_communicator: Callable[..., Communicator]
) -> None:
    wire = Wire(pair.client, servant)
    until(wire.shares)
    client = make_communicator(connect=[pair.endpoint], shared_memory=False)
    assert camera(client).getImageData("GRAY8") == image()
    until(lambda: not wire.shares())
    camera(client).getImageData.latest()
    servant.getImageDataPublisher.publish(image(7))
    until(lambda: publish_and_read(servant, client) == image(7))
    client.destroy()
    until(wire.shares)


def publish_and_read(servant: ImageI, client: Communicator) -> ImageData | None:
    servant.getImageDataPublisher.publish(image(7))
    sample = camera(client).getImageData.latest()
    return None if sample is None else sample.value


def test_a_client_on_another_machine_sends_all_over_the_network(pair: Pair, servant: ImageI) -> None:
    wire = Wire(pair.client, servant)
    until(wire.shares)
    with session_of(pair.client).liveliness().declare_token(client_token("nao", "fa", "0123456789abcdef")):
        until(lambda: not wire.shares())
    until(wire.shares)


def test_a_client_of_another_realm_is_seen_by_the_servants_that_it_reads(
    pair: Pair, servant: ImageI, make_communicator: Callable[..., Communicator]
) -> None:
    wire = Wire(pair.client, servant)
    until(wire.shares)
    stranger = make_communicator(realm="other", connect=[pair.endpoint], shared_memory=False)
    ImageProviderPrx.checkedCast(stranger.stringToProxy("Camera@nao")).getImageData.latest()
    until(lambda: not wire.shares())


def test_a_servant_without_shared_memory_sends_over_the_network(
    endpoint: str, make_communicator: Callable[..., Communicator]
) -> None:
    server = make_communicator(listen=[endpoint], shared_memory=False)
    adapter = server.createObjectAdapter("Test")
    adapter.activate()
    adapter.add(ImageI(), "Camera")
    proxy = camera(make_communicator(connect=[endpoint]))
    assert [proxy.getImageData("GRAY8") for _ in range(3)] == [image()] * 3
    assert not open_memory_files()


def test_sample_whose_server_ended_before_it_was_read_is_skipped(pair: Pair, servant: ImageI) -> None:
    proxy = camera(pair.client)
    wire = Wire(pair.client, servant)
    assert proxy.getImageData.latest() is None
    until(wire.shares)
    pair.server.destroy()
    until(lambda: not pair.client.identities())
    assert proxy.getImageData.latest() is None


def test_collocated_call_gets_the_same(pair: Pair, servant: ImageI) -> None:
    assert camera(pair.server).getImageData("GRAY8") == image()
    assert not open_memory_files()


def test_a_servant_that_is_withdrawn_lets_go_of_its_streams_memory(pair: Pair, servant: ImageI) -> None:
    wire = Wire(pair.client, servant)
    until(wire.shares)
    assert open_memory_files() > 0
    pair.adapter.removeAll(["Camera"])
    assert open_memory_files() == 0


def test_destroy_lets_go_of_all_memory(pair: Pair, servant: ImageI) -> None:
    proxy = camera(pair.client)
    until(lambda: proxy.getImageData("GRAY8") == image() and open_memory_files())
    assert open_memory_files() > 0
    pair.client.destroy()
    pair.server.destroy()
    assert open_memory_files() == 0


def test_answer_of_a_server_that_ends_then_is_received(pair: Pair) -> None:
    begun = threading.Semaphore(0)

    class Noticed(ImageI):
        def getImageData(self, format: str, current: Current) -> ImageData:
            begun.release()
            return super().getImageData(format, current)

    pair.adapter.add(Noticed(), "Camera")
    proxy = camera(pair.client)
    until(lambda: proxy.getImageData("GRAY8") == image() and open_memory_files())
    while begun.acquire(blocking=False):
        pass
    answer = proxy.getImageData.begin("GRAY8")
    assert begun.acquire(timeout=EVENT_LIMIT)
    pair.adapter.removeAll(["Camera"])  # waits for the calls that run
    pair.server.destroy()
    assert answer.result(CALL_LIMIT) == image()


def test_a_client_that_may_not_read_memory_after_all_gets_the_next_over_the_network(
    pair: Pair, servant: ImageI, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(_: object) -> object:
        raise PermissionError("not you")

    monkeypatch.setattr(shared_memory, "_map", refuse)
    lost: list[str] = []
    pair.server.onClientLost(lost.append)
    wire = Wire(pair.client, servant)
    until(wire.shares)
    proxy = camera(pair.client)
    with pytest.raises(ConnectionLostException, match="the next comes over the network"):
        proxy.getImageData("GRAY8")
    until(lambda: not wire.shares())
    for _ in range(20):
        assert proxy.getImageData("GRAY8") == image()
    assert lost == []


PUBLISHER = """
import sys, time
from tests.support.image_servant import ImageI, image
from zenoh_ice import initialize
with initialize(listen=[sys.argv[1]], connect=[], clock="wall") as communicator:
    servant = ImageI()
    adapter = communicator.createObjectAdapter("Test")
    adapter.add(servant, "Camera")
    adapter.activate()
    print("ready", flush=True)
    number = 0
    while True:
        number += 1
        if number % 20 == 0:
            time.sleep(0.1)  # in which the reader comes to the end of what is there, on a busy machine too
        while not servant.getImageDataPublisher.listening:
            time.sleep(0.001)
        servant.getImageDataPublisher.publish(image(number, bytes([number % 256]) * (1 << 20)))
"""


def test_images_that_come_faster_than_they_are_read_are_not_torn(
    endpoint: str, make_communicator: Callable[..., Communicator], monkeypatch: pytest.MonkeyPatch
) -> None:
    copy, delays = shared_memory._copy, cycle((*[0.0] * 9, 0.01))
    others = shared_maps()  # of communicators that several tests share

    def copy_late(memory: mmap, reference: MemoryReference, what: str) -> list[bytes]:
        time.sleep(next(delays))  # by itself the reader may be the faster one for long
        return copy(memory, reference, what)

    monkeypatch.setattr(shared_memory, "_copy", copy_late)
    with ComponentProcess([sys.executable, "-c", PUBLISHER, endpoint]) as publisher:
        publisher.wait_for("^ready")
        client = make_communicator(connect=[endpoint])
        until(lambda: bool(client.identities()))
        whole: list[bool] = []

        def look(sample: Sample[ImageData]) -> None:
            image = sample.value
            whole.append(image.pixelData.count(image.timeStamp.seconds % 256) == len(image.pixelData))

        with camera(client).getImageData.subscribe(look, queue=30) as reader:
            until(lambda: shared_maps() == others + 1, RUN_LIMIT)
            until(lambda: reader.lost > 0, RUN_LIMIT)
            until(lambda: len(whole) >= 300, RUN_LIMIT)
        assert all(whole)
        publisher.process.kill()


def test_killed_servers_leave_nothing_in_their_clients(
    endpoint: str, make_communicator: Callable[..., Communicator]
) -> None:
    client = make_communicator(connect=[endpoint])
    proxy = CalculatorPrx.uncheckedCast(client.stringToProxy("Calculator"))
    others = shared_maps()  # of communicators that several tests share
    for _ in range(3):
        with ComponentProcess(module("tests.support.calculator_server", "--listen", endpoint)) as server:
            server.wait_for("^ready")
            until(lambda: bool(client.identities()))
            until(lambda: proxy.echo(PIXELS) == PIXELS and shared_maps() == others + 1)
            server.process.kill()
        until(lambda: not client.identities())
        until(lambda: shared_maps() == others)  # without another image
