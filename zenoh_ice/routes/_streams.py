"""The ends of streams of large values: through channels on one machine, and over the network."""

from __future__ import annotations

import math
import threading
import time
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from typing import Any, Final

from zenoh_ice.carriers._local.channels import RETRY_PAUSE, LentSample, NotSent, SampleChannel
from zenoh_ice.carriers._local.listeners import Listeners, most_unread
from zenoh_ice.carriers.zenoh._network import Network
from zenoh_ice.carriers.zenoh._streams import NetworkOutlet, Sample, ThreadInlet, opened
from zenoh_ice.data.codec import Pieces
from zenoh_ice.data.exceptions import ConnectionLostException
from zenoh_ice.data.interface import Operation
from zenoh_ice.data.keys import Target
from zenoh_ice.routes._calls import Route
from zenoh_ice.transport import Arrived, Registration


class BulkOutlet:
    """The publishing end of a stream of large values."""

    def __init__(self, network: NetworkOutlet, listeners: Listeners, unpublish: Callable[[], object]) -> None:
        self._network: Final = network
        self._listeners: Final = listeners
        self._unpublish: Final = unpublish

    @property
    def listening(self) -> bool:
        return bool(self._listeners) or self._network.listening

    def put(self, payload: bytes | Pieces, attachment: bytes) -> None:
        if self._listeners:
            self._listeners.put(payload, attachment)
        if self._network.listening:
            self._network.put(payload, attachment)

    def close(self) -> None:
        self._network.close()
        self._unpublish()


class BulkInlet(ThreadInlet):
    """The listening end of a stream of large values.

    It listens through a channel to the servant's only server if that is near and publishes the stream there,
    and otherwise over Zenoh. While it changes from one to the other it listens on both, and the reader
    of the samples drops the second of two. After a vain attempt to have a channel, what comes over Zenoh has
    it try again, some seconds later: the server may have been slow, or short of memory.
    """

    def __init__(
        self,
        network: Network,
        route: Route,
        target: Target,
        operation: Operation[..., Any],
        queue: int,
    ) -> None:
        super().__init__(target.key(operation.name), operation.result.size_limit)
        self.poll = self._poll
        self._network: Final = network
        self._target: Final = target.prefix
        self._operation: Final = operation.name
        self._route: Final = route
        self._queue: Final = queue
        self._samples: Final[deque[Sample | LentSample]] = deque()
        self._arrived: Final = threading.Condition(threading.Lock())
        self._choosing: Final = threading.Lock()
        self._subscription: Registration | None = None
        self._channel: SampleChannel | None = None
        self._again_at = math.inf  # when a sample over Zenoh has it try for a channel
        self._route.changed.add(self._choose_later)
        try:
            self._choose()
        except BaseException:
            self.close()
            raise

    def confirm(self, channel: SampleChannel) -> None:
        self._network.pool.submit(lambda: self._settle(channel))

    def open(self, sample: Sample | LentSample) -> Arrived:
        if isinstance(sample, LentSample):
            return sample.read(self._limit, self._what)
        return opened(sample, self._limit, self._what)

    def keep(self, sample: Sample | LentSample) -> None:
        dropped = None
        if isinstance(sample, LentSample) and self._queue > most_unread(sample.size):
            try:  # its memory is not for so many
                sample.read(self._limit, self._what)
            except ConnectionLostException:
                return
        with self._arrived:
            if self._closed.is_set():
                dropped = sample
            else:
                if len(self._samples) >= self._queue:
                    dropped = self._samples.popleft()
                self._samples.append(sample)
                self._arrived.notify()
        if dropped is not None:
            self._discard(dropped)

    def _poll(self) -> Sample | LentSample | None:
        with self._arrived:
            return self._samples.popleft() if self._samples else None

    def _receive(self) -> Sample | LentSample | None:
        with self._arrived:
            self._arrived.wait_for(lambda: self._samples or self._closed.is_set())
            return self._samples.popleft() if self._samples else None

    def _discard(self, sample: Sample | LentSample) -> None:
        if isinstance(sample, LentSample):
            sample.give_back()

    def _stop(self) -> None:
        self._route.changed.discard(self._choose_later)
        with self._choosing:
            if self._channel is not None:
                self._leave(self._channel)
                self._channel = None
            self._leave_network()
        with self._arrived:
            self._samples.clear()
            self._arrived.notify_all()

    def _choose_later(self) -> None:
        self._network.pool.submit(self._choose)

    def _choose(self) -> None:
        with self._choosing:
            self._enter()

    def _enter(self) -> None:
        """Listen where the samples are."""
        if self._closed.is_set():
            return
        before, self._channel = self._channel, None
        channels = self._route.channels
        if channels is not None:
            with suppress(NotSent):
                self._channel = channels.follow(self._target, self._operation, self)
        if self._channel is None:
            self._enter_network()
        if before is not None:
            self._leave(before)

    def _settle(self, channel: SampleChannel) -> None:
        with self._choosing:
            if self._closed.is_set() or self._channel is not channel:
                return
            if not channel.ended:
                self._leave_network()
            elif channel.has_samples:  # its server may still be there
                self._enter()
            else:
                self._channel = None
                self._enter_network()

    def _enter_network(self) -> None:
        self._again_at = time.monotonic() + RETRY_PAUSE
        if self._subscription is None:
            self._subscription = self._network.subscribe(self._what, self._keep_far)

    def _keep_far(self, sample: Sample) -> None:
        """Take a sample that came over Zenoh."""
        self.keep(sample)
        is_vain = self._channel is None and self._route.channels is not None
        if is_vain and time.monotonic() >= self._again_at:
            self._again_at = math.inf
            self._choose_later()

    def _leave_network(self) -> None:
        if self._subscription is not None:
            self._subscription.close()
            self._subscription = None

    def _leave(self, channel: SampleChannel) -> None:
        """End a channel, and drop what is unread of it: its memory is written again soon."""
        channel.shut()
        with self._arrived:
            lost = [sample for sample in self._samples if isinstance(sample, LentSample) and sample.is_lost]
            for sample in lost:
                self._samples.remove(sample)
        for sample in lost:
            sample.give_back()
