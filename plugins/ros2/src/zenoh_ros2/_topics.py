"""The ends of topics: publishers and subscriptions."""

from __future__ import annotations

import math
import threading
from collections.abc import Collection
from functools import partial
from typing import Any, Final

import zenoh
import zenoh.ext
from zenoh.handlers import Callback

from zenoh_ice import Sample

from ._codec import LARGEST_MESSAGE
from ._endpoint import Endpoint, Handler, Owner, attachment_of, bytes_of
from ._graph import Sender
from ._refusals import Refusals
from ._wire import HASHLESS, Attachment, Entity
from ._workers import Line
from .exceptions import CallTimeoutError, MessageError, RosError

_MOST_PUBLISHERS: Final = 1024
"""Maximum publishers of a topic whose numbers are kept."""


class Publisher(Endpoint):
    """Publishes the messages of a topic."""

    def __init__(self, node: Owner, entity: Entity) -> None:
        super().__init__(node, entity)
        self._latched: Final = entity.qos.durability == "transient_local"
        self._publishers: Final[dict[bool, Any]] = {
            humble: self._declare(key) for humble, key in self._keys.items()
        }
        self._announce(*self._publishers.values())
        self._buffer: Final = bytearray()

    def _declare(self, key: str) -> Any:  # noqa: ANN401
        qos = self.entity.qos
        waits = qos.reliability == "reliable" and qos.keep_all  # as in rmw_zenoh
        control = zenoh.CongestionControl.BLOCK if waits else zenoh.CongestionControl.DROP
        if not self._latched:
            return self.node.session.declare_publisher(key, congestion_control=control)
        return zenoh.ext.declare_advanced_publisher(
            self.node.session,
            key,
            cache=zenoh.ext.CacheConfig(qos.queue),
            sample_miss_detection=zenoh.ext.MissDetectionConfig(heartbeat=None, sporadic_heartbeat=None),
            publisher_detection=True,
            congestion_control=control,
        )

    @property
    def heard(self) -> bool:
        """Return whether messages reach a subscription, announced or not; of a latched topic, announced."""
        if self._latched:  # Zenoh does not report it
            return bool(self.others.fitting())
        self._check_open()
        return bool(self._publishers[False].matching_status.matching) or self._heard_in_humble()

    def _heard_in_humble(self) -> bool:
        return any(each.type_hash == HASHLESS for each in self.others.fitting())

    @property
    def subscribers(self) -> int:
        """Return the number of subscriptions that hear it."""
        return len(self.others.fitting()) or int(self.heard)

    def publish(self, message: object = None, /, **fields: object) -> None:
        """Publish a message, or one with some fields; raises MessageError for a wrong value."""
        types = self.node.types
        made = types.coerce(self.type_name, message, **fields)
        with self._turn:  # they are sent in the order of their numbers
            self._check_open()
            types.encode_into(self._buffer, made)
            _, attachment = self._attachment()
            try:
                self._publishers[False].put(self._buffer, attachment=attachment)  # which copies it
                if self._latched or self._heard_in_humble():
                    if types.differs(self.type_name):
                        types.encode_into(self._buffer, made, humble=True)
                    self._publishers[True].put(self._buffer, attachment=attachment)
            except zenoh.ZError as error:
                raise RosError(f"{self.name}: {error}") from error

    def close(self) -> None:
        """Withdraw it from the graph, with the messages that are kept for later subscriptions."""
        super().close()
        if self._latched:
            with self._turn:
                self._publishers.clear()


class Subscription(Endpoint):
    """Receives the messages of a topic: the newest, the next one, or each by a callback."""

    def __init__(
        self,
        node: Owner,
        entity: Entity,
        callback: Handler | None,
        largest: int = LARGEST_MESSAGE,
        *,
        with_sender: bool = False,
        besides: Collection[str] = (),
    ) -> None:
        super().__init__(node, entity, besides)
        self.lost = 0
        """Number of messages dropped because a callback was too slow, or lost on the way."""
        self._callback: Final = callback
        self._with_sender: Final = with_sender
        self._largest: Final = min(largest, node.types.largest(entity.type_name))
        self._refusals: Final = Refusals(self.name, "a malformed message is dropped")
        self._received_line: Final = Line(self.name, node.receiving, entity.qos.queue, self._decode)
        self._line: Final = Line(self.name, node.workers, entity.qos.queue, self._deliver)
        self._changed: Final = threading.Condition()
        self._newest: Sample[Any] | None = None
        self._received = 0
        self._last: dict[bytes, int] = {}  # number of the newest message of each publisher
        self._taking: Final = threading.Lock()
        self._taken: dict[bytes, tuple[int, bool]] = {}
        """The number of the last message that was taken from each publisher, and by which key it came."""
        self._announce(*[self._declare(humble, key) for humble, key in self._keys.items()])

    def _declare(self, humble: bool, key: str) -> Any:  # noqa: ANN401
        receive = Callback(partial(self._receive, humble), indirect=False)
        if self.entity.qos.durability == "volatile":
            return self.node.session.declare_subscriber(key, receive)
        history = zenoh.ext.HistoryConfig(detect_late_publishers=True, max_samples=self.entity.qos.queue)
        return zenoh.ext.declare_advanced_subscriber(self.node.session, key, receive, history=history)

    @property
    def malformed(self) -> int:
        """Return the number of messages dropped because they did not follow their type."""
        return self._refusals.count

    @property
    def publishers(self) -> int:
        """Return the number of publishers that it hears, according to the graph."""
        return len(self.others.fitting())

    def latest(self) -> Sample[Any] | None:
        """Return the newest message with its age, without waiting; None before the first."""
        return self._newest

    def next(self, timeout: float) -> Sample[Any]:
        """Wait for the next message that arrives from now on; raises CallTimeoutError."""
        with self._changed:
            seen = self._received
            if not self._changed.wait_for(lambda: self._received > seen or self._closed, timeout):
                raise CallTimeoutError(f"{self.name}: no message within {timeout:g} s")
            self._check_open()
            assert self._newest is not None
            return self._newest

    def close(self) -> None:
        """Stop receiving; wake threads that wait for a message."""
        super().close()
        with self._changed:
            self._changed.notify_all()

    def _receive(self, humble: bool, received: zenoh.Sample) -> None:
        """Take a message from Zenoh's thread, to be decoded on another."""
        try:
            data = bytes_of(received.payload, self._largest, self.type_name)
        except MessageError as error:
            self._refusals.add(error)
            return
        attachment = attachment_of(received.attachment)
        if attachment is not None and self._came_before(attachment, humble):
            return
        self._received_line.put((data, attachment, humble))

    def _came_before(self, attachment: Attachment, humble: bool) -> bool:
        """Return whether a message came by the other key, too: from a node of ours that Humble hears.

        By each key they come in their order.
        """
        gid, number = attachment.gid, attachment.sequence
        with self._taking:
            last, by_key = self._taken.get(gid, (0, humble))
            if humble is not by_key and number <= last:
                return True
            if len(self._taken) > _MOST_PUBLISHERS:  # which come and go
                self._taken.clear()
            self._taken[gid] = number, humble
            return False

    def _decode(self, received: tuple[bytes, Attachment | None, bool]) -> None:
        """Decode a message, one after the other: newer ones must not overtake it."""
        data, attachment, humble = received
        try:
            if attachment is None:
                raise MessageError("its attachment is none of rmw_zenoh")
            message = self.node.types.decode(data, self.type_name, humble=humble)
        except RosError as error:
            self._refusals.add(error)
            return
        with self._changed:
            number, last = attachment.sequence, self._last.get(attachment.gid)
            lost = max(0, number - last - 1) if last is not None else 0
            if len(self._last) > _MOST_PUBLISHERS:
                self._last.clear()
            self._last[attachment.gid] = number
            self.lost += lost
            self._newest = Sample(
                message, number, math.nan, attachment.stamp / 1e9, lost, attachment.gid.hex()
            )
            self._received += 1
            self._changed.notify_all()
        given: tuple[object, ...] = (message,)
        if self._with_sender:
            given = (message, Sender(self.others, attachment.gid))
        if self._callback is not None and self._line.put(given) is not None:
            self.lost += 1

    def _deliver(self, given: tuple[object, ...]) -> None:
        if self._callback is not None and not self._closed:
            self._callback(*given)
