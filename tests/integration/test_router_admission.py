"""A router whose endpoint is held by connections that never finish their TLS handshake, or by too many links."""

from __future__ import annotations

import ssl
from collections.abc import Iterator
from contextlib import ExitStack, suppress
from functools import partial

import pytest

from nao_tools._deployment.admission import AdmissionLimits
from tests.support.handshakes import ended, holding
from tests.support.processes import ComponentProcess, free_endpoint, module
from tests.support.security import Keys, routing
from tests.support.waiting import links, until
from zenoh_ice import initialize

LINK_LIMIT = 10.0
"""A link is made within this many s, a third of what it takes behind handshakes that keep it out."""


def hello() -> bytes:
    """The first bytes of a TLS client."""
    sent = ssl.MemoryBIO()
    client = ssl.create_default_context().wrap_bio(ssl.MemoryBIO(), sent, server_hostname="localhost")
    with suppress(ssl.SSLWantReadError):
        client.do_handshake()
    return sent.read()


def connect(keys: Keys) -> None:
    """Make a link as a student, and end it."""
    with initialize(keys.settings("student", timeout=LINK_LIMIT)):
        pass


@pytest.fixture(scope="module")
def keys(tmp_path_factory: pytest.TempPathFactory) -> Keys:
    return Keys(tmp_path_factory.mktemp("keys"))


@pytest.fixture(scope="module")
def router(keys: Keys) -> Iterator[None]:
    with routing(keys.settings("router")):
        yield


@pytest.mark.usefixtures("router")
class TestUnfinishedHandshakes:
    @pytest.mark.parametrize(
        "first", [pytest.param(b"", id="silent"), pytest.param(hello(), id="a first message alone")]
    )
    def test_a_client_gets_in_beside_them_and_at_once_after_them(self, keys: Keys, first: bytes) -> None:
        # Each costs Zenoh 0.1 s when it ends: without the admission, the last link takes 30 s.
        with holding(keys.endpoint, 300, first):
            connect(keys)
        connect(keys)

    def test_what_is_not_tls_is_ended_at_once(self, keys: Keys) -> None:
        with holding(keys.endpoint, 1, b"GET / HTTP/1.1\r\n\r\n") as (connection,):
            assert ended(connection)


def test_the_log_names_the_address_of_a_client(keys: Keys, endpoint: str) -> None:
    options = ("--config", str(keys.folder / "router.toml"), "--listen", endpoint)
    with ComponentProcess(module("nao_tools", "router", *options)) as router:
        router.wait_for(f"the router listens on {endpoint}")
        with initialize(keys.settings("student", connect=[endpoint])):
            router.wait_for("'student' came, at 127.0.0.1, process")
        router.wait_for("'student' left, at 127.0.0.1, process")


@pytest.fixture
def endpoint() -> str:
    return free_endpoint().replace("tcp/", "tls/")


def test_a_student_with_many_leaves_room_for_others(keys: Keys, endpoint: str) -> None:
    limits = AdmissionLimits(links_of_certificate=3, report=0.1)
    with (
        routing(keys.settings("router", listen=[endpoint]), limits) as router,
        ExitStack() as opened,
    ):
        for _ in range(5):
            opened.enter_context(initialize(keys.settings("student", connect=[endpoint])))
        for name in ("operator", "robot"):
            with initialize(keys.settings(name, connect=[endpoint], timeout=LINK_LIMIT)) as other:
                until(partial(links, other))
        router.wait_for("links of 'student' were refused: there are as many as it may have")
