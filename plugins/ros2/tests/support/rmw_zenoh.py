"""Sessions with the settings of genuine nodes of rmw_zenoh, and what such a node announces and publishes.

The settings are those of rmw_zenoh_cpp's DEFAULT_RMW_ZENOH_SESSION_CONFIG.json5 (ros2/rmw_zenoh, 2025) where they
differ from Zenoh's. Two of them decide who meets whom: a node says only to routers where it listens, and it connects
only to peers whose id is smaller than its own.
"""

from __future__ import annotations

import itertools
import json
from collections.abc import Callable
from types import TracebackType
from typing import Any, Final, Self

import zenoh
import zenoh.ext

from zenoh_ros2._wire import Attachment, Entity, EntityKind, QoS, gid_of, key

SMALLEST: Final = "1"
"""The id of a session that connects to no peer: Zenoh compares ids as bytes, the lowest first."""
GREATEST: Final = "f" * 32
"""The id of one that connects to every peer that it hears of."""

_MINUTE: Final = 60_000  # ms
_PRIORITIES: Final = (
    *("control", "real_time", "interactive_high", "interactive_low"),
    *("data_high", "data", "data_low", "background"),
)


def session_config(endpoint: str, session_id: str = "", mode: str = "peer") -> dict[str, Any]:
    """Return the configuration of a genuine node that looks for its router at an endpoint."""
    autoconnect = {"router": [], "peer": ["router", "peer"]}
    strategy = {"peer": {"to_router": "always", "to_peer": "greater-zid"}}
    config: dict[str, Any] = {
        "mode": mode,
        "connect": {
            "endpoints": [endpoint],
            "timeout_ms": {"router": -1, "peer": -1, "client": 0},
            "exit_on_failure": {"router": False, "peer": False, "client": True},
            "retry": {"period_init_ms": 1000, "period_max_ms": 4000, "period_increase_factor": 2},
        },
        "listen": {"endpoints": ["tcp/localhost:0"], "timeout_ms": 0, "exit_on_failure": True},
        "open": {"return_conditions": {"connect_scouted": True, "declares": True}},
        "scouting": {
            "timeout": 3000,
            "delay": 500,
            "multicast": {"enabled": False},
            "gossip": {
                "enabled": True,
                "multihop": False,
                "target": {"router": ["router", "peer"], "peer": ["router"]},
                "autoconnect": autoconnect,
                "autoconnect_strategy": strategy,
            },
        },
        "timestamping": {"enabled": {"router": True, "peer": True, "client": True}},
        "queries_default_timeout": _MINUTE,
        "routing": {
            "router": {"peers_failover_brokering": True},
            "peer": {"mode": "peer_to_peer"},
            "interests": {"timeout": 10_000},
        },
        "transport": {
            "unicast": {
                "open_timeout": _MINUTE,
                "accept_timeout": _MINUTE,
                "accept_pending": 10_000,
                "max_sessions": 10_000,
            },
            "link": {
                "tx": {
                    "lease": _MINUTE,
                    "keep_alive": 2,
                    "queue": {
                        "size": dict.fromkeys(_PRIORITIES, 2),
                        "congestion_control": {"block": {"wait_before_close": 1000 * _MINUTE}},
                    },
                }
            },
            "shared_memory": {"enabled": False},
        },
    }
    return config | ({"id": session_id} if session_id else {})


class GenuineNode:
    """A node in a session with the settings of rmw_zenoh, which knows messages as bytes alone.

    A node of Humble has `HASHLESS` for the hash of each type.
    """

    def __init__(
        self, name: str, endpoint: str, *, domain: int = 0, session_id: str = "", mode: str = "peer"
    ) -> None:
        config = zenoh.Config.from_json5(json.dumps(session_config(endpoint, session_id, mode)))
        self.session: Final = zenoh.open(config)
        self._domain: Final = domain
        self._name: Final = name
        self._held: Final[list[Any]] = [self._announce(Entity("NN", *self._place(0)))]

    def hear(self, type_name: str, type_hash: str, topic: str) -> set[bytes]:
        """Subscribe to a topic; the set gets the payloads that come."""
        heard: set[bytes] = set()
        self._held.append(
            self.session.declare_subscriber(
                key(self._domain, topic, type_name, type_hash),
                lambda sample: heard.add(sample.payload.to_bytes()),
            )
        )
        self._held.append(
            self._announce(Entity("MS", *self._place(len(self._held)), topic, type_name, type_hash))
        )
        return heard

    def publish(self, type_name: str, type_hash: str, topic: str, data: bytes) -> None:
        """Publish a message."""
        attachment = Attachment(1, 0, bytes(16)).encode()
        self.session.put(key(self._domain, topic, type_name, type_hash), data, attachment=attachment)

    def listen(self, type_name: str, type_hash: str, topic: str, qos: QoS = QoS()) -> list[bytes]:  # noqa: B008
        """Subscribe to a topic; the list gets the payloads that come, of a latched one also earlier ones."""
        heard: list[bytes] = []
        of_topic = key(self._domain, topic, type_name, type_hash)

        def receive(sample: zenoh.Sample) -> None:
            heard.append(sample.payload.to_bytes())

        if qos.durability == "volatile":
            self._held.append(self.session.declare_subscriber(of_topic, receive))
        else:
            history = zenoh.ext.HistoryConfig(detect_late_publishers=True, max_samples=qos.depth)
            self._held.append(
                zenoh.ext.declare_advanced_subscriber(self.session, of_topic, receive, history=history)
            )
        self._end("MS", type_name, type_hash, topic, qos)
        return heard

    def publisher(self, type_name: str, type_hash: str, topic: str) -> Callable[[bytes], None]:
        """Announce a publisher; return what publishes a message."""
        publisher = self.session.declare_publisher(key(self._domain, topic, type_name, type_hash))
        self._held.append(publisher)
        attachments = self._end("MP", type_name, type_hash, topic)
        return lambda data: publisher.put(data, attachment=attachments())

    def is_heard(self) -> bool:
        """Return whether somebody hears each of its publishers."""
        publishers = [each for each in self._held if isinstance(each, zenoh.Publisher)]
        return all(each.matching_status.matching for each in publishers)  # type: ignore[attr-defined]

    def client(self, type_name: str, type_hash: str, service: str) -> Callable[[bytes, float], bytes]:
        """Announce a client; return what calls the service within some seconds."""
        of_service = key(self._domain, service, type_name, type_hash)
        attachments = self._end("SC", type_name, type_hash, service)

        def call(request: bytes, limit: float) -> bytes:
            attachment = attachments()
            replies = self.session.get(
                of_service,
                target=zenoh.QueryTarget.ALL_COMPLETE,
                consolidation=zenoh.ConsolidationMode.NONE,
                payload=request,
                attachment=attachment,
                timeout=limit,
            )
            (reply,) = [each.ok for each in replies]
            assert reply is not None
            assert reply.attachment is not None
            asked, answered = (Attachment.decode(bytes(each)) for each in (attachment, reply.attachment))
            assert asked is not None
            assert answered is not None
            assert (answered.sequence, answered.gid) == (asked.sequence, asked.gid)
            return reply.payload.to_bytes()

        return call

    def serve(self, type_name: str, type_hash: str, service: str, answer: Callable[[bytes], bytes]) -> None:
        """Serve a service."""
        of_service = key(self._domain, service, type_name, type_hash)

        def reply(query: zenoh.Query) -> None:
            assert query.payload is not None
            query.reply(of_service, answer(query.payload.to_bytes()), attachment=query.attachment)
            query.drop()

        self._held.append(self.session.declare_queryable(of_service, reply, complete=True))
        self._end("SS", type_name, type_hash, service)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for each in reversed(self._held):
            each.undeclare()
        self.session.close()

    def _place(self, number: int) -> tuple[int, str, int, int, str, str]:
        return self._domain, str(self.session.zid()), 0, number, "/", self._name

    def _end(
        self,
        kind: EntityKind,
        type_name: str,
        type_hash: str,
        name: str,
        qos: QoS = QoS(),  # noqa: B008
    ) -> Callable[[], bytes]:
        """Announce an end; return what makes the attachment of its next message."""
        entity = Entity(kind, *self._place(len(self._held)), name, type_name, type_hash, qos)
        self._held.append(self._announce(entity))
        numbers, gid = itertools.count(1), gid_of(entity.token())
        return lambda: Attachment(next(numbers), 0, gid).encode()

    def _announce(self, entity: Entity) -> Any:
        return self.session.liveliness().declare_token(entity.token())
