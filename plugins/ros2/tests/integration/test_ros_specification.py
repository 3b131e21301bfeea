"""What a node puts on the wire is what the specification's examples have (ros2/rmw_zenoh, docs/design.md)."""

from __future__ import annotations

import queue
import struct
import time
from collections.abc import Callable, Iterator
from typing import Any

import pytest
import xxhash
import zenoh

from tests.support.limits import CALL_LIMIT, EVENT_LIMIT
from tests.support.processes import free_endpoint
from tests.support.waiting import until
from zenoh_ice import Settings
from zenoh_ice.carriers.zenoh.session import close_session, open_session
from zenoh_ros2 import LATCHED, SENSOR_DATA, CallError, Node, QoS

STRING = (
    "std_msgs::msg::dds_::String_/RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"
)
TEXT, ADD_TYPE = "std_msgs/msg/String", "example_interfaces/srv/AddTwoInts"
ADD = "example_interfaces::srv::dds_::AddTwoInts_/RIHS01_e118de6bf5eeb66a2491b5bda11202e7b68f198d6f67922cf30364858239c81a"


class Spy:
    """A session of Zenoh that reads all."""

    def __init__(self, session: zenoh.Session) -> None:
        self.session = session
        self.samples: queue.Queue[zenoh.Sample] = queue.Queue()

    def tokens(self, domain: int) -> set[str]:
        """Return the tokens of a domain."""
        replies = self.session.liveliness().get(f"@ros2_lv/{domain}/**", timeout=CALL_LIMIT)
        return {str(reply.ok.key_expr) for reply in replies if reply.ok is not None}

    def token(self, domain: int, kind: str, last: str) -> str:
        """Wait for the token of a kind that ends so; return it."""
        found: list[str] = []

        def there() -> bool:
            found[:] = [each for each in self.tokens(domain) if f"/{kind}/" in each and each.endswith(last)]
            return bool(found)

        until(there)
        return found[0]


@pytest.fixture
def spy() -> Iterator[tuple[Spy, Settings]]:
    endpoint = free_endpoint()
    session = open_session(Settings(mode="peer", listen=(endpoint,), connect=()))
    spy = Spy(session)
    subscriber = session.declare_subscriber("**", spy.samples.put)
    try:
        yield spy, Settings(connect=(endpoint,))
    finally:
        subscriber.undeclare()
        close_session(session)


Watched = tuple[Spy, Settings]


def example(text: str, token: str) -> str:
    """Return an example with the ids of session, node and endpoint that a token has."""
    given, parts = text.split("/"), token.split("/")
    return "/".join([*given[:2], *parts[2:5], *given[5:]])


def test_the_token_of_a_node(spy: Watched) -> None:
    watched, settings = spy
    with Node("listener", domain=2, settings=settings) as node:
        token = watched.token(2, "NN", "listener")
        assert token == example("@ros2_lv/2/aac3178e146ba6f1fc6e6a4085e77f21/0/0/NN/%/%/listener", token)
        assert token.split("/")[2] == str(node.session.zid())
        assert token.split("/")[3] == token.split("/")[4]


def add(request: Any) -> dict[str, int]:
    return {"sum": request.a + request.b}


@pytest.mark.parametrize(
    ("make", "kind", "text"),
    [
        (lambda node: node.create_subscription(TEXT, "/n", None, QoS()), "MS", f"%n/{STRING}/::,10:,:,:,,"),
        (lambda node: node.create_subscription(TEXT, "/n", None, LATCHED), "MS", f"%n/{STRING}/:1:,1:,:,:,,"),
        (
            lambda node: node.create_subscription(TEXT, "/n", None, SENSOR_DATA),
            "MS",
            f"%n/{STRING}/2::,5:,:,:,,",
        ),
        (
            lambda node: node.create_publisher(TEXT, "n", QoS(depth=7)),
            "MP",
            f"%robot1%arm%n/{STRING}/::,7:,:,:,,",
        ),
        (lambda node: node.create_service(ADD_TYPE, "/n", add), "SS", f"%n/{ADD}/::,10:,:,:,,"),
        (lambda node: node.create_client(ADD_TYPE, "/n"), "SC", f"%n/{ADD}/::,10:,:,:,,"),
    ],
    ids=["subscription", "latched one", "one of a sensor", "publisher", "service", "client"],
)
def test_the_token_of_an_end(spy: Watched, make: Callable[[Node], object], kind: str, text: str) -> None:
    watched, settings = spy
    with Node("talker", namespace="/robot1/arm", domain=2, settings=settings) as node:
        made = make(node)
        token = watched.token(2, kind, text)
        written = f"@ros2_lv/2/8b20917502ee955ac4476e0266340d5c/0/10/{kind}/%/%robot1%arm/talker/{text}"
        assert token == example(written, token)
        del made


def test_tokens_go_with_what_they_stand_for(spy: Watched) -> None:
    watched, settings = spy
    with Node("talker", domain=2, settings=settings) as node:
        publisher = node.create_publisher("std_msgs/msg/String", "/chatter")
        watched.token(2, "MP", ":,:,:,,")
        publisher.close()
        until(lambda: not any("/MP/" in each for each in watched.tokens(2)))
    until(lambda: not watched.tokens(2))


@pytest.mark.parametrize(
    ("domain", "namespace", "key"),
    [(0, "/", f"0/chatter/{STRING}"), (0, "/robot1", f"0/robot1/chatter/{STRING}")],
)
def test_messages_and_their_attachments(spy: Watched, domain: int, namespace: str, key: str) -> None:
    watched, settings = spy
    with Node("talker", namespace=namespace, domain=domain, settings=settings) as node:
        publisher = node.create_publisher("std_msgs/msg/String", "chatter")
        token = watched.token(domain, "MP", ":,:,:,,")
        began = time.time_ns()
        for text in ("eins", "zwei"):
            publisher.publish(data=text)
        for number, text in enumerate(("eins", "zwei"), 1):
            sample = watched.samples.get(timeout=EVENT_LIMIT)
            assert str(sample.key_expr) == key
            length = struct.pack("<I", len(text) + 1)
            assert sample.payload.to_bytes() == b"\0\1\0\0" + length + text.encode() + b"\0"
            assert sample.attachment is not None
            attachment = sample.attachment.to_bytes()
            sequence, stamp, size = struct.unpack_from("<qqB", attachment)
            assert (sequence, size, len(attachment)) == (number, 16, 33)
            assert began <= stamp <= time.time_ns()
            # Two halves of 64 bits, the low one first, each little endian.
            high, low = struct.unpack(">QQ", xxhash.xxh3_128_digest(token.encode()))
            assert attachment[17:] == struct.pack("<QQ", low, high)


def test_requests_and_replies_carry_the_same_number_and_gid(spy: Watched) -> None:
    watched, settings = spy
    asked: queue.Queue[tuple[bytes, bytes, bool]] = queue.Queue()

    def answer(query: zenoh.Query) -> None:
        assert query.attachment is not None
        assert query.payload is not None
        attachment, payload = query.attachment.to_bytes(), query.payload.to_bytes()
        asked.put((attachment, payload, str(query.key_expr) == f"2/add_two_ints/{ADD}"))
        reply = attachment[:8] + struct.pack("<q", time.time_ns()) + attachment[16:]
        query.reply(query.key_expr, b"\0\1\0\0" + struct.pack("<q", 42), attachment=reply)

    queryable = watched.session.declare_queryable(f"2/add_two_ints/{ADD}", answer, complete=True)
    with Node("caller", domain=2, settings=settings) as node:
        client = node.create_client("example_interfaces/srv/AddTwoInts", "/add_two_ints")
        token = watched.token(2, "SC", ":,:,:,,")
        for number in (1, 2):
            # Nobody announced the server: it has no token.
            until(lambda: succeeds(client, 40, 2))
            attachment, payload, right = asked.get(timeout=EVENT_LIMIT)
            assert right
            assert payload == b"\0\1\0\0" + struct.pack("<qq", 40, 2)
            assert (struct.unpack_from("<q", attachment)[0] >= number, attachment[16]) == (True, 16)
            assert attachment[17:] == xxhash.xxh3_128_intdigest(token.encode()).to_bytes(16, "little")
    queryable.undeclare()


def test_a_server_answers_with_the_number_and_gid_of_the_request(spy: Watched) -> None:
    watched, settings = spy
    with Node("adder", domain=2, settings=settings) as node:
        node.create_service(
            "example_interfaces/srv/AddTwoInts",
            "/add_two_ints",
            lambda request: {"sum": request.a - request.b},
        )
        watched.token(2, "SS", ":,:,:,,")
        gid = bytes(range(16))
        replies = watched.session.get(
            f"2/add_two_ints/{ADD}",
            target=zenoh.QueryTarget.ALL_COMPLETE,
            payload=b"\0\1\0\0" + struct.pack("<qq", 50, 8),
            attachment=struct.pack("<qqB", 77, 5, 16) + gid,
            timeout=CALL_LIMIT,
        )
        (reply,) = [each.ok for each in replies if each.ok is not None]
        assert reply.payload.to_bytes() == b"\0\1\0\0" + struct.pack("<q", 42)
        assert reply.attachment is not None
        attachment = reply.attachment.to_bytes()
        assert struct.unpack_from("<q", attachment)[0] == 77
        assert abs(struct.unpack_from("<q", attachment, 8)[0] - time.time_ns()) < 60e9
        assert attachment[16:] == b"\x10" + gid


def succeeds(client: Any, a: int, b: int) -> bool:
    try:
        return bool(client.call(a=a, b=b, timeout=1.0).sum == a + b)
    except CallError:
        return False
