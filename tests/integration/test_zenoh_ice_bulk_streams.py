"""Streams of images: between processes of one machine through memory that the sender lends."""

from __future__ import annotations

import errno
import os
import signal
import sys
import threading
import time
from collections.abc import Callable
from functools import partial
from itertools import cycle
from typing import Any

import pytest

from interfaces.jderobot import ImageData, ImageProviderPrx
from tests.support.carriers import cut_local_connections, local_connections
from tests.support.image_servant import ImageI, Network, camera, image
from tests.support.limited import limited_pair
from tests.support.limits import EVENT_LIMIT, RUN_LIMIT, START_LIMIT
from tests.support.memory_files import lent_bytes, shared_maps
from tests.support.processes import ComponentProcess, module
from tests.support.serving import serve
from tests.support.soak import cases, repeated
from tests.support.stranger import session_of
from tests.support.suite import Pair
from tests.support.waiting import until
from zenoh_ice import Communicator, Sample
from zenoh_ice.carriers._local.memory import ArenaView, Extent
from zenoh_ice.carriers._local.server import local_space
from zenoh_ice.data.keys import Target, servant_token
from zenoh_ice.routes import _calls as routes
from zenoh_ice.threads.limits import Limits

MEGABYTE = 1 << 20

pytestmark = pytest.mark.skipif(not local_space(), reason="no memory is shared here")


@pytest.fixture
def servant(pair: Pair) -> ImageI:
    servant = ImageI()
    pair.adapter.add(servant, "Camera")
    return servant


@pytest.fixture
def network(pair: Pair, servant: ImageI) -> Network:
    return Network(pair.server)


class Images:
    """The numbers of the images that a subscription got, which fails for one that is not whole."""

    def __init__(self) -> None:
        self.numbers: list[int] = []
        self.torn: list[int] = []
        self.lost = 0

    def take(self, sample: Sample[ImageData]) -> None:
        number = sample.value.timeStamp.seconds
        if sample.value != image(number):
            self.torn.append(number)
        self.lost += sample.lost
        self.numbers.append(number)

    def has(self, number: int) -> bool:
        """Return whether an image has come, or a later one."""
        return bool(self.numbers) and self.numbers[-1] >= number

    def check(self) -> None:
        """Fail if an image was torn, or came twice or in another order."""
        assert self.torn == []
        assert self.numbers == sorted(set(self.numbers))


class Numbers:
    """The images that are published: their numbers go up."""

    def __init__(self, servant: ImageI) -> None:
        self.last = 0
        self._servant = servant

    def publish(self) -> int:
        self.last += 1
        self._servant.getImageDataPublisher.publish(image(self.last))
        return self.last

    def publish_until(self, condition: Callable[[], object], limit: float = EVENT_LIMIT) -> None:
        """Publish more and more images until a condition holds."""

        def holds() -> bool:
            self.publish()
            return bool(condition())

        until(holds, limit)


class TestWays:
    def test_samples_travel_through_lent_memory(self, pair: Pair, servant: ImageI, network: Network) -> None:
        images, numbers = Images(), Numbers(servant)
        with camera(pair.client).getImageData.subscribe(images.take, queue=8):
            network.wait_until_unused(servant)
            for _ in range(100):
                number = numbers.publish()
                until(partial(images.has, number))
            assert lent_bytes() > 0
            assert not network.is_used
        images.check()
        assert images.lost == 0

    @pytest.mark.parametrize("far", ["no local sockets", "another machine"])
    def test_others_get_them_over_the_network_beside(  # noqa: PLR0917
        self,
        far: str,
        pair: Pair,
        servant: ImageI,
        network: Network,
        make_communicator: Callable[..., Communicator],
        monkeypatch: pytest.MonkeyPatch,
    ) -> None:
        near_images, far_images, numbers = Images(), Images(), Numbers(servant)
        with camera(pair.client).getImageData.subscribe(near_images.take, queue=8):
            network.wait_until_unused(servant)
            with monkeypatch.context() as patch:
                patch.setattr(routes, "local_space", lambda: "0123456789abcdef")
                client = make_communicator(connect=[pair.endpoint], local_sockets=far == "another machine")
            with camera(client).getImageData.subscribe(far_images.take, queue=8):
                numbers.publish_until(lambda: far_images.numbers)
                assert network.is_used
                for _ in range(20):
                    number = numbers.publish()
                    until(partial(near_images.has, number))
                    numbers.publish_until(partial(far_images.has, number))  # a busy network drops some
            network.wait_until_unused(servant)
        near_images.check()
        far_images.check()

    def test_a_client_of_another_realm_is_served_through_the_door(
        self,
        pair: Pair,
        servant: ImageI,
        network: Network,
        make_communicator: Callable[..., Communicator],
    ) -> None:
        stranger = make_communicator(realm="other", connect=[pair.endpoint])
        images, numbers = Images(), Numbers(servant)
        proxy = ImageProviderPrx.checkedCast(stranger.stringToProxy("Camera@nao"))
        with proxy.getImageData.subscribe(images.take):
            network.wait_until_unused(servant)
            numbers.publish_until(lambda: images.numbers)
        images.check()

    @pytest.mark.parametrize("missing", ["memfd_create", "posix_fallocate"])
    def test_without_memory_they_come_over_the_network(
        self,
        missing: str,
        endpoint: str,
        make_communicator: Callable[..., Communicator],
        monkeypatch: pytest.MonkeyPatch,
    ) -> None:
        def refuse(*_: object) -> int:
            raise OSError(errno.ENOSPC, "no room")

        before = lent_bytes()
        monkeypatch.setattr(os, missing, refuse)
        server, client = make_communicator(listen=[endpoint]), make_communicator(connect=[endpoint])
        servant = serve(server, ImageI(), "Camera")
        images, numbers = Images(), Numbers(servant)
        with camera(client).getImageData.subscribe(images.take):
            numbers.publish_until(lambda: images.numbers)
        images.check()
        assert lent_bytes() == before

    def test_listening_follows_the_readers(self, pair: Pair, servant: ImageI, network: Network) -> None:
        publisher, proxy = servant.getImageDataPublisher, camera(pair.client)
        assert not publisher.listening
        for _ in range(3):
            first = proxy.getImageData.subscribe(lambda _: None)
            with proxy.getImageData.subscribe(lambda _: None):
                network.wait_until_unused(servant)
                first.close()
            until(lambda: not publisher.listening)
        proxy.getImageData.latest()
        network.wait_until_unused(servant)
        pair.client.destroy()
        until(lambda: not publisher.listening)


class TestReaders:
    def test_a_slow_one_gets_the_newest_and_delays_no_other(
        self, pair: Pair, servant: ImageI, network: Network
    ) -> None:
        slow, quick, numbers = Images(), Images(), Numbers(servant)
        entered, leave = threading.Event(), threading.Event()

        def take_slowly(sample: Sample[ImageData]) -> None:
            slow.take(sample)
            entered.set()
            assert leave.wait(EVENT_LIMIT)

        with (
            camera(pair.client).getImageData.subscribe(take_slowly),
            camera(pair.client).getImageData.subscribe(quick.take, queue=8),
        ):
            network.wait_until_unused(servant)
            numbers.publish_until(lambda: entered.is_set() and quick.numbers)
            until(lambda: quick.has(numbers.last))
            lost = quick.lost
            for _ in range(50):
                number = numbers.publish()
                until(partial(quick.has, number))
            assert quick.lost == lost
            leave.set()
            until(lambda: slow.has(numbers.last))
        assert len(slow.numbers) <= 3
        slow.check()
        quick.check()

    @pytest.mark.parametrize("queue", cases([1, 9], [8, 40]))
    def test_as_many_wait_as_there_is_room_for(
        self, queue: int, pair: Pair, servant: ImageI, network: Network
    ) -> None:
        images, numbers = Images(), Numbers(servant)
        entered, leave = threading.Event(), threading.Event()

        def take(sample: Sample[ImageData]) -> None:
            images.take(sample)
            entered.set()
            assert leave.wait(EVENT_LIMIT)

        witness = Images()
        arena: Any = pair.server.transport._local_server.arena  # type: ignore[attr-defined]
        with (
            camera(pair.client).getImageData.subscribe(take, queue=queue) as slow,
            camera(pair.client).getImageData.subscribe(witness.take),
        ):
            network.wait_until_unused(servant)
            numbers.publish_until(lambda: entered.is_set() and witness.numbers)
            waiting: Any = slow.inlet._samples  # type: ignore[union-attr]
            for _ in range(60):
                before = list(waiting)[-1:]
                until(partial(witness.has, numbers.publish()))
                until(lambda: list(waiting)[-1:] != before)  # noqa: B023 - it has arrived there, too
                until(lambda: len(arena._loans) <= queue)  # the others were given back
            leave.set()
            until(lambda: images.has(numbers.last))
        assert images.numbers[1:] == [numbers.last - at for at in reversed(range(queue))]
        images.check()

    def test_a_slow_one_of_large_images_leaves_memory_for_others(
        self, endpoint: str, make_communicator: Callable[..., Communicator]
    ) -> None:
        size = len(image(1).pixelData)
        limits = Limits(memory=8 * size, unread_bytes=size, last_reads=0.0)  # for what begins to listen again
        pair = limited_pair(endpoint, make_communicator, limits)
        servant = ImageI()
        pair.adapter.add(servant, "Camera")
        network, quick, numbers = Network(pair.server), Images(), Numbers(servant)
        leave = threading.Event()

        def hold(_: object) -> None:
            assert leave.wait(EVENT_LIMIT)

        arena: Any = pair.server.transport._local_server.arena  # type: ignore[attr-defined]
        get = camera(pair.client).getImageData
        with get.subscribe(hold), get.subscribe(hold, queue=8), get.subscribe(quick.take):
            network.wait_until_unused(servant)
            numbers.publish_until(lambda: quick.numbers)  # now all of them listen
            for _ in range(30):
                number = numbers.publish()
                until(partial(quick.has, number))
                until(lambda: len(arena._loans) <= 6)  # the others were given back
            assert not network.is_used
            leave.set()
        quick.check()

    def test_they_share_one_copy(self, pair: Pair, servant: ImageI, network: Network) -> None:
        proxy = camera(pair.client)
        leave, entered = threading.Event(), threading.Semaphore(0)

        def hold(_: object) -> None:
            entered.release()
            assert leave.wait(EVENT_LIMIT)

        subscriptions = [proxy.getImageData.subscribe(hold, queue=2) for _ in range(5)]
        network.wait_until_unused(servant)
        publisher, pixels = servant.getImageDataPublisher, bytes(4 * MEGABYTE)

        arena: Any = pair.server.transport._local_server.arena  # type: ignore[attr-defined]
        held: list[bool] = []

        def all_hold() -> bool:
            publisher.publish(image(1, b"small"))
            while entered.acquire(blocking=False):
                held.append(True)
            return len(held) == len(subscriptions)

        until(all_hold)
        for _ in range(6):
            publisher.publish(image(1, pixels))
            until(lambda: len(arena._loans) <= 2)  # those that wait: the others were given back
        assert 2 * len(pixels) <= lent_bytes() < 8 * len(pixels)
        leave.set()
        for each in subscriptions:
            each.close()

    def test_one_that_closes_itself_is_closed(self, pair: Pair, servant: ImageI, network: Network) -> None:
        closed = threading.Event()

        def close(_: object) -> None:
            subscription.close()
            closed.set()

        subscription = camera(pair.client).getImageData.subscribe(close, queue=3)
        numbers = Numbers(servant)
        network.wait_until_unused(servant)
        numbers.publish_until(closed.is_set)
        until(lambda: not servant.getImageDataPublisher.listening)

    def test_one_whose_communicator_is_destroyed_gets_no_more(
        self, pair: Pair, servant: ImageI, network: Network
    ) -> None:
        images, ended = Images(), threading.Event()
        proxy = camera(pair.client)
        proxy.getImageData.subscribe(images.take, queue=8)
        network.wait_until_unused(servant)
        numbers = Numbers(servant)

        def publish() -> None:
            while not ended.is_set():
                numbers.publish()

        thread = threading.Thread(target=publish)
        thread.start()
        until(lambda: len(images.numbers) > 20)
        pair.client.destroy()
        until(lambda: not servant.getImageDataPublisher.listening)
        ended.set()
        thread.join(EVENT_LIMIT)
        images.check()

    def test_a_sample_whose_server_ended_before_it_was_read_is_skipped(
        self, pair: Pair, servant: ImageI, network: Network
    ) -> None:
        others = shared_maps() - 1  # but for the server's
        proxy = camera(pair.client)
        assert proxy.getImageData.latest() is None
        network.wait_until_unused(servant)
        servant.getImageDataPublisher.publish(image())
        pair.server.destroy()
        until(lambda: not pair.client.identities())
        until(lambda: shared_maps() == others)  # without being read
        assert proxy.getImageData.latest() is None

    def test_a_sample_whose_server_ended_long_before_it_was_read_is_skipped_too(
        self, pair: Pair, servant: ImageI, network: Network
    ) -> None:
        stream = camera(pair.client).getImageData
        assert stream.latest() is None
        network.wait_until_unused(servant)
        servant.getImageDataPublisher.publish(image(1))
        first = stream.wait()  # from now on a thread keeps the newest for its next reader
        servant.getImageDataPublisher.publish(image(2))
        pair.server.destroy()
        until(lambda: not local_connections())
        assert stream.latest() is first

    def test_one_that_is_stopped_delays_nobody_and_continues(
        self, pair: Pair, servant: ImageI, network: Network
    ) -> None:
        images, numbers = Images(), Numbers(servant)
        with (
            ComponentProcess(module("tests.support.bulk_client", pair.endpoint, "1000000")) as client,
            camera(pair.client).getImageData.subscribe(images.take, queue=8),
        ):
            client.wait_for("^ready")
            network.wait_until_unused(servant)
            numbers.publish_until(lambda: "image" in client.output and images.numbers)
            client.freeze()
            until(lambda: images.has(numbers.last))
            lost = images.lost
            for _ in range(50):
                number = numbers.publish()
                until(partial(images.has, number))
            assert images.lost == lost
            client.process.send_signal(signal.SIGCONT)
            number = numbers.publish()
            numbers.publish_until(lambda: newest(client) >= number)
            assert "torn" not in client.output
        images.check()


def newest(client: ComponentProcess) -> int:
    """Return the number of the last image that a client has printed."""
    return max(int(line.split()[1]) for line in client.output.splitlines() if line.startswith("image "))


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
    read, delays = ArenaView.read, cycle((*[0.0] * 9, 0.01))

    def read_late(view: ArenaView, extent: Extent, limit: int, what: str) -> list[bytes]:
        time.sleep(next(delays))  # by itself the reader may be the faster one for long
        return read(view, extent, limit, what)

    monkeypatch.setattr(ArenaView, "read", read_late)
    others = shared_maps()  # of communicators that several tests share
    with ComponentProcess([sys.executable, "-c", PUBLISHER, endpoint]) as publisher:
        publisher.wait_for("^ready")
        client = make_communicator(connect=[endpoint])
        until(lambda: bool(client.identities()))
        whole: list[bool] = []

        def look(sample: Sample[ImageData]) -> None:
            pixels = sample.value.pixelData
            whole.append(pixels.count(sample.value.timeStamp.seconds % 256) == len(pixels))

        with camera(client).getImageData.subscribe(look, queue=8) as reader:
            until(lambda: shared_maps() == others + 1, RUN_LIMIT)
            until(lambda: reader.lost > 0, RUN_LIMIT)
            until(lambda: len(whole) >= repeated(60, soak=300), RUN_LIMIT)
        assert all(whole)
        publisher.process.kill()


class TestChanges:
    """A reader changes between the socket and the network: no image comes twice or in another order."""

    def test_its_socket_ends_while_its_server_lives(
        self, pair: Pair, servant: ImageI, network: Network
    ) -> None:
        images, numbers = Images(), Numbers(servant)
        with camera(pair.client).getImageData.subscribe(images.take, queue=8):
            network.wait_until_unused(servant)
            for _ in range(5):
                numbers.publish_until(partial(images.has, numbers.last + 1))
                cut_local_connections()
                numbers.publish_until(partial(images.has, numbers.last + 1))
            numbers.publish_until(lambda: not network.is_used)  # a vain attempt is repeated when samples come
            numbers.publish_until(partial(images.has, numbers.last + 1))
        images.check()

    def test_its_servant_is_withdrawn_and_added_again(
        self, pair: Pair, servant: ImageI, network: Network
    ) -> None:
        images, numbers = Images(), Numbers(servant)
        with camera(pair.client).getImageData.subscribe(images.take, queue=8):
            for _ in range(5):
                network.wait_until_unused(servant)
                numbers.publish_until(partial(images.has, numbers.last + 1))
                pair.adapter.removeAll(["Camera"])
                assert not servant.getImageDataPublisher.listening
                pair.adapter.add(servant, "Camera")
            network.wait_until_unused(servant)
            numbers.publish_until(partial(images.has, numbers.last + 1))
        images.check()

    def test_its_server_is_restarted(
        self, endpoint: str, make_communicator: Callable[..., Communicator]
    ) -> None:
        client = make_communicator(connect=[endpoint])
        runs: list[list[int]] = []
        streams: list[str] = []

        def take(sample: Sample[ImageData]) -> None:
            if sample.stream not in streams:
                streams.append(sample.stream)
                runs.append([])
            runs[-1].append(sample.value.timeStamp.seconds)

        proxy = client.stringToProxy("Camera")
        with ImageProviderPrx.uncheckedCast(proxy).getImageData.subscribe(take, queue=8):
            for run in range(1, 4):
                server = make_communicator(listen=[endpoint])
                servant = serve(server, ImageI(), "Camera")
                network, numbers = Network(server), Numbers(servant)
                numbers.publish_until(partial(lambda run: len(runs) == run, run), START_LIMIT)
                network.wait_until_unused(servant)
                numbers.publish_until(partial(lambda number: number in runs[-1], numbers.last + 1))
                server.destroy()
        assert [sorted(set(run)) for run in runs] == runs

    def test_a_second_server_comes_and_goes(self, pair: Pair, servant: ImageI, network: Network) -> None:
        images, numbers = Images(), Numbers(servant)
        target, interface = Target("nao", "Camera"), ImageProviderPrx.ice_interface
        token = servant_token(target, interface.type_id, interface.fingerprint, "fa", 1.0)
        with camera(pair.client).getImageData.subscribe(images.take, queue=8):
            for _ in range(3):
                network.wait_until_unused(servant)
                with session_of(pair.server).liveliness().declare_token(token):
                    until(lambda: network.is_used)
                    numbers.publish_until(partial(images.has, numbers.last + 1))
                network.wait_until_unused(servant)
                numbers.publish_until(partial(images.has, numbers.last + 1))
        images.check()
