"""Proxies between two sessions over loopback: texts, oneway calls, and calls that get no answer."""

from __future__ import annotations

import pytest

from tests.conftest import Pair
from tests.support.limits import CALL_LIMIT, EVENT_LIMIT, FOREVER
from tests.support.notebook import Notebook, NotebookPrx
from tests.support.stranger import session_of
from zenoh_ice import (
    AccessDeniedException,
    CommunicatorDestroyedException,
    ConfigurationException,
    ConnectionLostException,
    MarshalException,
    ObjectNotExistException,
    TwowayOnlyException,
)
from zenoh_ice._presence import servant_token
from zenoh_ice._zenoh.transport import ZenohTransport
from zenoh_ice.transport import Served, Target


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
        [
            "Head",
            "Head -o",
            "Left.Arm_1-b@other",
            "Head -o@other",
        ],
    )
    def test_proxy_comes_back_from_its_text(self, pair: Pair, text: str) -> None:
        proxy = pair.client.stringToProxy(text)
        assert proxy.ice_toString() == text
        assert pair.client.stringToProxy(proxy.ice_toWire()).ice_toString() == text

    def test_twoway_is_the_default(self, pair: Pair) -> None:
        proxy = pair.client.stringToProxy("Head -t")

        assert proxy.ice_toString() == "Head"

    def test_endpoints_are_refused_with_a_hint(self, pair: Pair) -> None:
        with pytest.raises(ConfigurationException, match="endpoints are settings, such as --connect"):
            pair.client.stringToProxy("Head:default -p 9999")

    def test_proxies_are_equal_when_they_call_alike(self, pair: Pair) -> None:
        proxy = pair.client.stringToProxy("Head")
        assert proxy == pair.client.stringToProxy("Head@nao")
        assert len({proxy, pair.client.stringToProxy("Head")}) == 1
        others = [
            pair.client.stringToProxy("Head@other"),
            pair.client.stringToProxy("Neck"),
            proxy.ice_oneway(),
            proxy.ice_invocationTimeout(100),
            pair.server.stringToProxy("Head"),
        ]
        assert proxy not in others
        assert proxy.ice_oneway().ice_twoway() == proxy

    def test_proxy_of_another_kind_keeps_how_it_calls(self, pair: Pair) -> None:
        proxy = pair.client.stringToProxy("Head@other").ice_invocationTimeout(250).ice_oneway()
        cast = NotebookPrx.uncheckedCast(proxy)
        assert cast.ice_getInvocationTimeout() == 250
        assert cast.ice_toString() == "Head -o@other"


class TestOneway:
    def test_oneway_calls_arrive_in_their_order(self, proxy: NotebookPrx, notebook: Notebook) -> None:
        oneway = proxy.ice_oneway()
        for number in range(50):
            oneway.note(str(number))
        assert notebook.wait_for(50) == [str(number) for number in range(50)]

    def test_oneway_calls_in_a_hurry_arrive_in_their_order(
        self, remote: NotebookPrx, notebook: Notebook
    ) -> None:
        oneway = remote.ice_oneway().ice_invocationTimeout(500)
        for number in range(50):
            oneway.note(str(number))
        assert notebook.wait_for(50) == [str(number) for number in range(50)]

    def test_future_of_a_oneway_call_ends_when_it_is_executed_or_refused(
        self, proxy: NotebookPrx, notebook: Notebook
    ) -> None:
        future = proxy.ice_oneway().note.begin("sent")
        assert future.result(CALL_LIMIT) is None
        assert notebook.wait_for(1) == ["sent"]

    def test_what_has_an_answer_cannot_be_called_oneway(self, proxy: NotebookPrx) -> None:
        with pytest.raises(TwowayOnlyException, match=r"Notebook\.notes"):
            proxy.ice_oneway().notes()
        with pytest.raises(TwowayOnlyException):
            proxy.ice_oneway().ice_ids()

    def test_ping_may_be_oneway(self, proxy: NotebookPrx) -> None:
        proxy.ice_oneway().ice_ping()

    def test_oneway_call_of_nobody_is_reported(self, pair: Pair, remote: NotebookPrx) -> None:
        oneway = remote.ice_oneway()
        oneway.note("sent")
        remove(pair)
        with pytest.raises(ObjectNotExistException):
            oneway.note("lost")
        with pytest.raises(ObjectNotExistException):
            remote.ice_oneway().note.begin("lost").result(EVENT_LIMIT)

    def test_wrong_argument_is_reported(self, remote: NotebookPrx) -> None:
        with pytest.raises(MarshalException):
            remote.ice_oneway().note(object())  # type: ignore[arg-type]


class TestUnansweredCalls:
    """The exception that a caller gets if a servant is present but does not answer."""

    def test_call_that_nobody_takes_is_denied(self, pair: Pair, monkeypatch: pytest.MonkeyPatch) -> None:
        """Access control drops calls silently; here the servant that is present accepts none."""
        monkeypatch.setattr(pair.server.transport, "serve", lambda *_: Served(lambda: None))
        pair.adapter.add(Notebook(), "Guarded")
        proxy = NotebookPrx.checkedCast(pair.client.stringToProxy("Guarded"))
        with pytest.raises(AccessDeniedException, match=r"Guarded\.about"):
            proxy.about()

    def test_call_that_nobody_explains_may_have_been_executed(self, pair: Pair) -> None:
        """The servant is only known by its token: it is unknown whether the call reached it."""
        key = servant_token(
            Target("nao", "Mute"), "::test::Notebook", "c0ffee0000000005", pair.server.client_id, 1.0
        )
        with session_of(pair.server).liveliness().declare_token(key):
            proxy = NotebookPrx.checkedCast(pair.client.stringToProxy("Mute"))
            with pytest.raises(ConnectionLostException, match=r"Mute\.about got no answer"):
                proxy.about()

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
    assert isinstance(transport, ZenohTransport)
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
