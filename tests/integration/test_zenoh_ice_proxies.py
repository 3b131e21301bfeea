"""Proxies between two sessions over loopback: texts, and calls that get no answer."""

from __future__ import annotations

import msgspec
import pytest

from tests.support.carriers import over_one
from tests.support.limits import EVENT_LIMIT, FOREVER
from tests.support.notebook import Notebook, NotebookPrx
from tests.support.stranger import session_of
from tests.support.suite import Pair
from zenoh_ice import (
    AccessDeniedException,
    CommunicatorDestroyedException,
    ConfigurationException,
    ConnectionLostException,
    InterfaceMismatchException,
    ObjectNotExistException,
)
from zenoh_ice.data.keys import Target, servant_token
from zenoh_ice.data.status import own_version
from zenoh_ice.routes._transport import RoutedTransport
from zenoh_ice.transport import Registration

OLD_STATUS = msgspec.msgpack.encode({"version": "0.2.0", "shared_memory": True})


@pytest.fixture
def notebook(pair: Pair) -> Notebook:
    servant = Notebook()
    pair.adapter.add(servant, "Notebook")
    return servant


@pytest.fixture(params=["remote", "collocated"])
def proxy(request: pytest.FixtureRequest, pair: Pair, notebook: Notebook) -> NotebookPrx:
    communicator = pair.client if request.param == "remote" else pair.server
    return NotebookPrx.checkedCast(communicator.stringToProxy("Notebook"))


@pytest.fixture
def remote(pair: Pair, notebook: Notebook) -> NotebookPrx:
    return NotebookPrx.checkedCast(pair.client.stringToProxy("Notebook"))


def remove(pair: Pair) -> None:
    """Withdraw the notebook, and wait until the client has heard of it."""
    pair.adapter.removeAll(["Notebook"])
    notebook = Target("nao", "Notebook")
    assert pair.client.presence.wait_until_gone(notebook, EVENT_LIMIT, pair.server.client_id)


class TestTexts:
    @pytest.mark.parametrize(
        "text",
        ["Head", "Left.Arm_1-b@other"],
    )
    def test_proxy_comes_back_from_its_text(self, pair: Pair, text: str) -> None:
        proxy = pair.client.stringToProxy(text)
        assert proxy.ice_toString() == text
        assert pair.client.stringToProxy(proxy.ice_toWire()).ice_toString() == text

    def test_endpoints_are_refused_with_a_hint(self, pair: Pair) -> None:
        with pytest.raises(ConfigurationException, match="endpoints are settings, such as --connect"):
            pair.client.stringToProxy("Head:default -p 9999")

    def test_texts_of_nobody_are_refused(self, pair: Pair) -> None:
        impossible = [
            "",
            "a/b",
            "/a",
            "a/",
            "a -f x",
            "a -x b",
            "a -o",
            "*",
            "a@",
            "@nao",
            "a b",
            "a@b@c",
            "x" * 200,
        ]
        for text in impossible:
            with pytest.raises(ConfigurationException):
                pair.client.stringToProxy(text)

    def test_proxies_are_equal_when_they_call_alike(self, pair: Pair) -> None:
        proxy = pair.client.stringToProxy("Head")
        assert proxy == pair.client.stringToProxy("Head@nao")
        assert len({proxy, pair.client.stringToProxy("Head")}) == 1
        others = [
            pair.client.stringToProxy("Head@other"),
            pair.client.stringToProxy("Neck"),
            proxy.ice_invocationTimeout(100),
            pair.server.stringToProxy("Head"),
        ]
        assert proxy not in others

    def test_proxy_of_another_kind_keeps_how_it_calls(self, pair: Pair) -> None:
        proxy = pair.client.stringToProxy("Head@other").ice_invocationTimeout(250)
        cast = NotebookPrx.uncheckedCast(proxy)
        assert cast.ice_getInvocationTimeout() == 250
        assert cast.ice_toString() == "Head@other"


class TestUnansweredCalls:
    """The exception that a caller gets if a servant is present but does not answer."""

    def test_call_that_nobody_takes_is_denied(self, pair: Pair, monkeypatch: pytest.MonkeyPatch) -> None:
        """Access control drops calls silently; here the servant that is present accepts none."""
        monkeypatch.setattr(pair.server.transport, "serve", lambda *_: Registration(lambda: None))
        pair.adapter.add(Notebook(), "Guarded")
        proxy = NotebookPrx.checkedCast(pair.client.stringToProxy("Guarded"))
        with pytest.raises(AccessDeniedException, match=r"Guarded\.about"):
            proxy.about()

    @over_one
    def test_call_that_nobody_explains_may_have_been_executed(self, pair: Pair) -> None:
        """The servant is only known by its token: it is unknown whether the call reached it."""
        key = servant_token(
            Target("nao", "Mute"), "::test::Notebook", "c0ffee0000000005", pair.server.client_id, 1.0
        )
        with session_of(pair.server).liveliness().declare_token(key):
            proxy = NotebookPrx.checkedCast(pair.client.stringToProxy("Mute"))
            with pytest.raises(ConnectionLostException, match=r"Mute\.about got no answer"):
                proxy.about()

    @pytest.mark.parametrize(
        ("form", "reason"),
        [
            ("", "no servant 'Old' in realm 'nao'; the realm has servants of VisualHFSM in another version"),
            ("/{id}/1", "cast of Old@nao: its server has VisualHFSM 0.2.0"),
        ],
        ids=["0.1.0", "0.2.0"],
    )
    def test_servant_of_an_older_version_is_called_so(
        self, pair: Pair, monkeypatch: pytest.MonkeyPatch, form: str, reason: str
    ) -> None:
        key = "@servant/nao/Old/::test::Notebook/c0ffee0000000005" + form.format(id=pair.server.client_id)
        own = own_version()
        with session_of(pair.server).liveliness().declare_token(key), monkeypatch.context() as patch:
            patch.setattr("zenoh_ice.objects._communicator.encode_status", lambda *_, **__: OLD_STATUS)
            with pytest.raises((ObjectNotExistException, InterfaceMismatchException)) as caught:
                NotebookPrx.checkedCast(pair.client.stringToProxy("Old"))
        assert str(caught.value) == f"{reason}, this is {own}: install the same version on both sides"

    @over_one
    def test_call_whose_link_is_cut_is_lost(self, pair: Pair, remote: NotebookPrx) -> None:
        pair.server.destroy()
        with pytest.raises(ConnectionLostException):
            remote.about()


def test_calls_with_many_limits_leave_few_queriers(pair: Pair, notebook: Notebook) -> None:
    """Each limit has a querier as long as there is a proxy with it."""
    proxy = NotebookPrx.checkedCast(pair.client.stringToProxy("Notebook"))
    for number in range(400):
        proxy.ice_invocationTimeout(FOREVER * 1000 + number).about()
    transport = pair.client.transport
    assert isinstance(transport, RoutedTransport)
    assert transport.caller.cache_info().currsize <= 256


def test_names_that_are_none_are_refused(pair: Pair) -> None:
    for ask in (pair.client.identities, pair.client.servants):
        with pytest.raises(ConfigurationException, match=r"'nao/\*\*' is not a valid realm"):
            ask("nao/**")
    with pytest.raises(ConfigurationException, match=r"'\*' is not a valid id of a session"):
        pair.client.processStatus("*")


def test_who_is_there_is_not_reported_after_the_end(pair: Pair) -> None:
    pair.client.destroy()
    with pytest.raises(CommunicatorDestroyedException):
        pair.client.servants()
