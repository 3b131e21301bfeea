"""The ends of topics: publishers and subscriptions."""

from __future__ import annotations

import math
import threading
from collections.abc import Collection
from typing import Any, Final

import zenoh
import zenoh.ext
from zenoh.handlers import Callback

from zenoh_ice import Sample

from ._endpoint import Endpoint, Handler, Owner, attachment_of, bytes_of
from ._graph import Sender
from ._messages import LARGEST_MESSAGE
from ._refusals import Refusals
from ._wire import Attachment, Entity
from ._workers import Line
from .exceptions import CallTimeoutError, MessageError, RosError


class Publisher(Endpoint):
    """Publishes the messages of a topic."""

    def __init__(self, node: Owner, entity: Entity) -> None:
        super().__init__(node, entity)
        congestion = zenoh.CongestionControl
        waits = entity.qos.reliability == "reliable" and entity.qos.keep_all  # as in rmw_zenoh
        control = congestion.BLOCK if waits else congestion.DROP
        if entity.qos.durability == "transient_local":
            self._publisher: Any = zenoh.ext.declare_advanced_publisher(
                node.session,
                self._key,
                cache=zenoh.ext.CacheConfig(entity.qos.queue),
                sample_miss_detection=zenoh.ext.MissDetectionConfig(heartbeat=None, sporadic_heartbeat=None),
                publisher_detection=True,
                congestion_control=control,
            )
        else:
            self._publisher = node.session.declare_publisher(self._key, congestion_control=control)
        self._announce(self._publisher)
        self._turn: Final = threading.Lock()
        self._buffer: Final = bytearray()
        self._latched: Final = entity.qos.durability == "transient_local"

    @property
    def heard(self) -> bool:
        """Return whether messages reach a subscription, announced or not; of a latched topic, announced."""
        if self._latched:  # Zenoh does not report it
            return len(self.others("MS")) > 0
        self._check_open()
        return bool(self._publisher.matching_status.matching)

    @property
    def subscribers(self) -> int:
        """Return the number of subscriptions of the topic, which are counted from the first use on."""
        return len(self.others("MS")) or int(self.heard)

    def publish(self, message: object = None, /, **fields: object) -> None:
        """Publish a message, or one with some fields; raises MessageError for a wrong value."""
        self._check_open()
        types = self.node.types
        made = types.coerce(self.type_name, message, **fields)
        with self._turn:  # they are sent in the order of their numbers
            types.encode_into(self._buffer, made)
            _, attachment = self._attachment()
            try:
                self._publisher.put(self._buffer, attachment=attachment)  # which copies it
            except zenoh.ZError as error:
                self._check_open()  # it was closed meanwhile
                raise RosError(f"{self.name}: {error}") from error


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
        super().__init__(node, entity)
        self.lost = 0
        """Number of messages dropped because a callback was too slow, or lost on the way."""
        self._callback: Final = callback
        self._with_sender: Final = with_sender
        self._largest: Final = min(largest, node.types.largest(entity.type_name))
        self._refusals: Final = Refusals(self.name, "a malformed message is dropped")
        self._besides: Final = frozenset(besides)
        self._unheard: Final = Refusals(self.name, "a publisher is not heard")
        self._received_line: Final = Line(node.receiving, entity.qos.queue)
        self._line: Final = Line(node.workers, entity.qos.queue)
        self._changed: Final = threading.Condition()
        self._newest: Sample[Any] | None = None
        self._received = 0
        self._last: dict[bytes, int] = {}  # number of the newest message of each publisher
        if entity.qos.durability == "transient_local":
            subscriber: Any = zenoh.ext.declare_advanced_subscriber(
                node.session,
                self._key,
                Callback(self._receive, indirect=False),
                history=zenoh.ext.HistoryConfig(detect_late_publishers=True, max_samples=entity.qos.queue),
            )
        else:
            subscriber = node.session.declare_subscriber(self._key, Callback(self._receive, indirect=False))
        self.others("MP")  # they are known when the first message arrives
        self._announce(subscriber)

    @property
    def malformed(self) -> int:
        """Return the number of messages dropped because they did not follow their type."""
        return self._refusals.count

    @property
    def publishers(self) -> int:
        """Return the number of publishers of the topic, according to the graph."""
        return len(self.others("MP"))

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

    def _meet(self, other: Entity) -> None:
        """Warn of a publisher whose messages never arrive: in their key is their type, and its hash."""
        if other.kind != "MP" or other.type_name in self._besides:
            return
        if other.type_name != self.type_name:
            self._unheard.add(f"{other.node_name} publishes {other.type_name}, {self.type_name} is expected")
        elif other.type_hash != self.entity.type_hash:
            version = f"{other.node_name} publishes {self.type_name} with the hash {other.type_hash}"
            self._unheard.add(f"{version}, of another definition or distribution (ROS_DISTRO)")

    def _receive(self, received: zenoh.Sample) -> None:
        """Take a message from Zenoh's thread, to be decoded on another."""
        try:
            data = bytes_of(received.payload, self._largest, self.type_name)
        except MessageError as error:
            self._refusals.add(error)
            return
        attachment = attachment_of(received.attachment)
        self._received_line.put(lambda: self._decode(data, attachment))

    def _decode(self, data: bytes, attachment: Attachment | None) -> None:
        """Decode a message, one after the other: newer ones must not overtake it."""
        try:
            if attachment is None:
                raise MessageError("its attachment is none of rmw_zenoh")
            message = self.node.types.decode(data, self.type_name)
        except RosError as error:
            self._refusals.add(error)
            return
        with self._changed:
            number, last = attachment.sequence, self._last.get(attachment.gid)
            lost = max(0, number - last - 1) if last is not None else 0
            if len(self._last) > 1024:  # publishers come and go
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
            given = (message, Sender(self.others("MP"), attachment.gid))
        if self._callback is not None and self._line.put(lambda: self._deliver(given)) is not None:
            self.lost += 1

    def _deliver(self, given: tuple[object, ...]) -> None:
        if self._callback is not None and not self._closed:
            self._callback(*given)
