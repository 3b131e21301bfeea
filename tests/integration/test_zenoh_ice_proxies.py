"""Proxies between two sessions over loopback: texts, contexts, facets, oneway calls, batches, replicas."""

from __future__ import annotations

import itertools
import threading
from collections.abc import Callable

import pytest
import zenoh

from tests.conftest import Pair
from tests.support.calculator import CalculatorPrx, DivisionByZero
from tests.support.calculator_servant import CalculatorI
from tests.support.limits import LIMIT
from tests.support.notebook import Notebook, NotebookPrx
from tests.support.waiting import until
from zenoh_ice import (
    AccessDeniedException,
    BusyException,
    Communicator,
    CommunicatorDestroyedException,
    ConfigurationException,
    ConnectionLostException,
    Current,
    FacetNotExistException,
    Identity,
    MarshalException,
    ObjectNotExistException,
    ObjectPrx,
    TimeoutException,
    TwowayOnlyException,
)
from zenoh_ice.identity import Target
from zenoh_ice.network.servant_tokens import servant_token
from zenoh_ice.serving.incoming import Incoming


@pytest.fixture
def notebook(pair: Pair) -> Notebook:
    servant = Notebook()
    pair.adapter.add(servant, "desk/Notebook")
    return servant


@pytest.fixture(params=["remote", "collocated"])
def proxy(request: pytest.FixtureRequest, pair: Pair, notebook: Notebook) -> NotebookPrx:
    communicator = pair.client if request.param == "remote" else pair.server
    return NotebookPrx.checkedCast(communicator.stringToProxy("desk/Notebook"))


@pytest.fixture
def remote(pair: Pair, notebook: Notebook) -> NotebookPrx:
    return NotebookPrx.checkedCast(pair.client.stringToProxy("desk/Notebook"))


def remove(pair: Pair) -> None:
    """Withdraw the notebook, and wait until the client has heard of it."""
    pair.adapter.remove("desk/Notebook")
    notebook = Target("nao", "desk/Notebook")
    assert pair.client.presence.wait_until_gone(notebook, LIMIT, pair.server.client_id)


class TestTexts:
    @pytest.mark.parametrize(
        "text",
        [
            "Head",
            "soccer/Ball",
            "Head -f debug",
            "soccer/Ball -f debug -o",
            "Head -O",
            "soccer/Ball -f debug -o@other",
        ],
    )
    def test_proxy_comes_back_from_its_text(self, pair: Pair, text: str) -> None:
        proxy = pair.client.stringToProxy(text)
        assert pair.client.proxyToString(proxy) == text
        assert pair.client.stringToProxy(proxy.ice_toWire()).ice_toString() == text

    def test_twoway_is_the_default(self, pair: Pair) -> None:
        proxy = pair.client.stringToProxy("Head -t")
        assert proxy.ice_isTwoway()
        assert proxy.ice_toString() == "Head"

    def test_endpoints_are_refused_with_a_hint(self, pair: Pair) -> None:
        with pytest.raises(ConfigurationException, match="endpoints are settings, such as --connect"):
            pair.client.stringToProxy("Head:default -p 9999")

    def test_identity_has_a_category(self, pair: Pair) -> None:
        identity = pair.client.stringToIdentity("soccer/Ball")
        assert (identity.category, identity.name) == ("soccer", "Ball")
        assert pair.client.identityToString(identity) == "soccer/Ball"

    def test_identity_and_facet_of_a_proxy_can_be_changed(self, pair: Pair) -> None:
        proxy = pair.client.stringToProxy("soccer/Ball -o@other").ice_facet("debug")
        assert proxy.ice_toWire() == "soccer/Ball -f debug -o@other"
        other = proxy.ice_identity(Identity("Goal", "soccer"))
        assert other.ice_toWire() == "soccer/Goal -o@other"
        with pytest.raises(ConfigurationException):
            proxy.ice_facet("no facet")

    def test_proxies_are_equal_when_they_call_alike(self, pair: Pair) -> None:
        proxy = pair.client.stringToProxy("Head")
        assert proxy == pair.client.stringToProxy("Head@nao")
        assert len({proxy, pair.client.stringToProxy("Head")}) == 1
        others = [
            proxy.ice_oneway(),
            proxy.ice_facet("debug"),
            proxy.ice_context({"who": "me"}),
            proxy.ice_invocationTimeout(100),
            proxy.ice_replicas("spread"),
        ]
        assert proxy not in others
        assert proxy.ice_oneway().ice_twoway() == proxy

    def test_proxy_of_another_kind_keeps_how_it_calls(self, pair: Pair) -> None:
        proxy = pair.client.stringToProxy("Head").ice_invocationTimeout(250).ice_context({"who": "me"})
        cast = NotebookPrx.uncheckedCast(proxy.ice_replicas("first"), "debug")
        assert cast.ice_getInvocationTimeout() == 250
        assert cast.ice_getContext() == {"who": "me"}
        assert cast.ice_getReplicas() == "first"
        assert cast.ice_getFacet() == "debug"


class TestContexts:
    def test_servant_is_told_the_context_of_a_proxy_and_of_a_call(self, proxy: NotebookPrx) -> None:
        patient = proxy.ice_context({"who": "me"})
        assert patient.about()["who"] == "me"
        assert patient.about({"who": "you"})["who"] == "you"
        assert patient.about()["who"] == "me"
        assert "who" not in proxy.about()
        assert proxy.aboutAsync({"who": "they"}).result(LIMIT)["who"] == "they"

    def test_every_call_tells_the_implicit_context(self, proxy: NotebookPrx) -> None:
        context = proxy.ice_getCommunicator().getImplicitContext()
        context.setContext({"who": "all", "why": "so"})
        assert context.put("where", "here") == ""
        assert context.remove("why") == "so"
        assert context.containsKey("who")
        assert context.get("why") == ""
        about = proxy.about({"who": "me"})
        assert (about["who"], about["where"]) == ("me", "here")
        assert "why" not in about
        context.setContext(None)
        assert "who" not in proxy.about()

    @pytest.mark.parametrize(
        "context",
        [
            {"who": "x" * 1025},
            {"x" * 129: ""},
            {str(number): "" for number in range(33)},
            {str(number): "x" * 1000 for number in range(5)},
            {"who": 1},
        ],
    )
    def test_context_that_cannot_travel_is_refused(self, proxy: NotebookPrx, context: dict[str, str]) -> None:
        with pytest.raises(MarshalException, match="context"):
            proxy.ice_context(context)

    def test_contexts_that_are_too_large_together_are_refused(self, proxy: NotebookPrx) -> None:
        implicit = proxy.ice_getCommunicator().getImplicitContext()
        implicit.setContext({str(number): "x" * 900 for number in range(3)})
        with pytest.raises(MarshalException, match="context"):
            proxy.about({"long": "x" * 1000, "longer": "x" * 1000})


class TestBuiltInOperations:
    def test_they_have_futures(self, proxy: NotebookPrx) -> None:
        assert proxy.ice_pingAsync().result(LIMIT) is None
        assert proxy.ice_isAAsync("::test::Notebook").result(LIMIT)
        assert proxy.ice_idAsync().result(LIMIT) == proxy.ice_id() == "::test::Notebook"
        assert proxy.ice_idsAsync().result(LIMIT) == proxy.ice_ids() == ["::Ice::Object", "::test::Notebook"]

    def test_servant_is_told_their_context(self, pair: Pair) -> None:
        told: list[str] = []

        class Told(Notebook):
            def ice_ping(self, current: Current) -> None:
                told.append(current.ctx["who"])

        pair.adapter.add(Told(), "Told")
        proxy = pair.client.stringToProxy("Told")
        proxy.ice_ping({"who": "me"})
        proxy.ice_pingAsync({"who": "you"}).result(LIMIT)
        assert told == ["me", "you"]


class TestFacets:
    def test_facet_is_another_servant(self, pair: Pair, proxy: NotebookPrx) -> None:
        pair.adapter.addFacet(Notebook("facet"), "desk/Notebook", "debug")
        facet = NotebookPrx.checkedCast(proxy, "debug")
        assert facet.about() == {"servant": "facet", "identity": "desk/Notebook", "facet": "debug"}
        assert proxy.about()["facet"] == ""

    def test_missing_facet_is_told_with_those_that_there_are(self, pair: Pair, proxy: NotebookPrx) -> None:
        pair.adapter.addFacet(Notebook("facet"), "desk/Notebook", "debug")
        with pytest.raises(FacetNotExistException, match=r"'trace'.*there is 'debug', the identity itself"):
            NotebookPrx.checkedCast(proxy, "trace")


class TestDefaults:
    def test_default_servant_answers_for_its_category(self, pair: Pair) -> None:
        pair.adapter.addDefaultServant(Notebook("default"), "shelf")
        for communicator in (pair.client, pair.server):
            proxy = NotebookPrx.checkedCast(communicator.stringToProxy("shelf/Atlas"))
            assert proxy.about()["identity"] == "shelf/Atlas"
            proxy.ice_oneway().note("sent")

    def test_default_servant_of_another_interface_is_refused(self, pair: Pair) -> None:
        pair.adapter.addDefaultServant(CalculatorI(), "shelf")
        with pytest.raises(Exception, match="::test::Scientific, not a ::test::Notebook"):
            NotebookPrx.checkedCast(pair.client.stringToProxy("shelf/Atlas"))

    def test_other_categories_have_no_default(self, pair: Pair) -> None:
        pair.adapter.addDefaultServant(Notebook("default"), "shelf")
        with pytest.raises(ObjectNotExistException):
            NotebookPrx.checkedCast(pair.client.stringToProxy("box/Atlas"))


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

    def test_future_of_a_oneway_call_has_its_outcome_at_once(
        self, proxy: NotebookPrx, notebook: Notebook
    ) -> None:
        future = proxy.ice_oneway().noteAsync("sent")
        assert future.done()
        assert future.result() is None
        assert notebook.wait_for(1) == ["sent"]

    def test_what_has_an_answer_cannot_be_called_oneway(self, proxy: NotebookPrx) -> None:
        with pytest.raises(TwowayOnlyException, match=r"desk/Notebook\.notes"):
            proxy.ice_oneway().notes()
        with pytest.raises(TwowayOnlyException):
            proxy.ice_batchOneway().ice_ids()

    def test_ping_may_be_oneway(self, proxy: NotebookPrx) -> None:
        proxy.ice_oneway().ice_ping()

    def test_oneway_call_of_nobody_is_told(self, pair: Pair, remote: NotebookPrx) -> None:
        oneway = remote.ice_oneway()
        oneway.note("sent")
        remove(pair)
        with pytest.raises(ObjectNotExistException):
            oneway.note("lost")
        with pytest.raises(ObjectNotExistException):
            remote.ice_oneway().noteAsync("lost").result(LIMIT)

    def test_wrong_argument_is_told(self, remote: NotebookPrx) -> None:
        with pytest.raises(MarshalException):
            remote.ice_oneway().note(object())  # type: ignore[arg-type]


class TestBatches:
    def test_batch_is_sent_when_it_is_flushed(self, proxy: NotebookPrx, notebook: Notebook) -> None:
        batch = proxy.ice_batchOneway()
        batch.note("one")
        batch.ice_context({"who": "me"}).note("two")
        assert batch.ice_isBatchOneway()
        assert proxy.notes() == []
        batch.ice_flushBatchRequests()
        assert notebook.wait_for(2) == ["one", "two"]
        batch.ice_flushBatchRequests()
        assert proxy.notes() == ["one", "two"]

    def test_batch_of_a_batch_is_the_same(self, remote: NotebookPrx, notebook: Notebook) -> None:
        batch = remote.ice_batchOneway()
        batch.note("one")
        batch.ice_batchOneway().ice_flushBatchRequests()
        assert notebook.wait_for(1) == ["one"]

    def test_communicator_flushes_all_batches(self, proxy: NotebookPrx, notebook: Notebook) -> None:
        batches = [proxy.ice_batchOneway() for _ in range(2)]
        for batch in batches:
            batch.note("sent")
        proxy.ice_getCommunicator().flushBatchRequests()
        assert notebook.wait_for(2) == ["sent", "sent"]

    def test_large_batch_is_sent_by_itself(self, remote: NotebookPrx, notebook: Notebook) -> None:
        batch = remote.ice_batchOneway()
        for _ in range(3):
            batch.note("x" * 400_000)
        assert len(notebook.wait_for(3)) == 3

    def test_batch_for_nobody_is_told_when_it_is_flushed(self, pair: Pair, remote: NotebookPrx) -> None:
        batch = remote.ice_batchOneway()
        batch.note("lost")
        remove(pair)
        with pytest.raises(ObjectNotExistException):
            batch.ice_flushBatchRequests()
        batch.ice_flushBatchRequests()  # it was given up


class TestReplicas:
    @pytest.fixture
    def replicas(self, pair: Pair, make_communicator: Callable[..., Communicator]) -> list[Notebook]:
        servants = [Notebook("first"), Notebook("second")]
        self.second_server = make_communicator(connect=[pair.endpoint])
        for servant, communicator in zip(servants, (pair.server, self.second_server), strict=True):
            adapter = communicator.createObjectAdapter("Replicas")
            adapter.add(servant, "Shared", replica=True)
            adapter.activate()
        return servants

    @pytest.fixture
    def shared(self, pair: Pair, replicas: list[Notebook]) -> NotebookPrx:
        proxy = NotebookPrx.checkedCast(pair.client.stringToProxy("Shared"))
        with pair.client.presence._changed:
            both = pair.client.presence._changed.wait_for(lambda: len(pair.client.servants()) == 2, LIMIT)
        assert both
        return proxy

    def test_spread_calls_take_turns(self, shared: NotebookPrx) -> None:
        spread = shared.ice_replicas("spread")
        names = [spread.about()["servant"] for _ in range(6)]
        assert sorted(names) == ["first"] * 3 + ["second"] * 3
        assert all(name != following for name, following in itertools.pairwise(names))

    def test_first_asks_all_what_is_idempotent(self, shared: NotebookPrx, replicas: list[Notebook]) -> None:
        assert shared.ice_replicas("first").who()["servant"] in {"first", "second"}
        for _ in range(5):
            shared.ice_replicas("first").about()
        assert sum(servant.called for servant in replicas) in {6, 7}  # who: by both, perhaps one is under way

    def test_first_error_is_told_when_no_other_answers(
        self, pair: Pair, make_communicator: Callable[..., Communicator]
    ) -> None:
        asked, leave = threading.Event(), threading.Event()

        class Slow(CalculatorI):
            def divide(self, a: float, b: float, current: Current) -> tuple[float, float]:
                asked.set()
                leave.wait(LIMIT)
                return super().divide(a, b, current)

        other = make_communicator(connect=[pair.endpoint]).createObjectAdapter("Slow")
        for adapter, servant in ((pair.adapter, CalculatorI()), (other, Slow())):
            adapter.add(servant, "Calculator", replica=True)
        other.activate()
        until(lambda: len(pair.client.servants()) == 2)
        proxy = CalculatorPrx.checkedCast(pair.client.stringToProxy("Calculator")).ice_replicas("first")
        with pytest.raises(DivisionByZero):
            proxy.ice_invocationTimeout(500).divide(1.0, 0.0)
        assert asked.wait(LIMIT)
        leave.set()

    def test_nearest_is_one_of_them(self, shared: NotebookPrx, replicas: list[Notebook]) -> None:
        for _ in range(5):
            shared.about()
        assert sum(servant.called for servant in replicas) == 5

    def test_calls_go_on_when_a_replica_is_gone(self, shared: NotebookPrx, replicas: list[Notebook]) -> None:
        spread = shared.ice_replicas("spread")
        assert {spread.who()["servant"] for _ in range(2)} == {"first", "second"}
        self.second_server.destroy()
        for way in (spread, shared, shared.ice_replicas("first")):
            assert [way.who()["servant"] for _ in range(3)] == ["first"] * 3

    def test_oneway_calls_are_executed_once(self, shared: NotebookPrx, replicas: list[Notebook]) -> None:
        shared.ice_oneway().note("sent")
        spread = shared.ice_oneway().ice_replicas("spread")
        for _ in range(2):
            spread.note("spread")
        until(lambda: sum(len(servant.notes_so_far) for servant in replicas) >= 3)
        for _ in replicas:  # what was sent before these has arrived, twice or not
            spread.note("last")
        until(lambda: all("last" in servant.notes_so_far for servant in replicas))
        assert sum(len(servant.notes_so_far) for servant in replicas) == 5

    def test_unknown_choice_is_refused(self, pair: Pair) -> None:
        with pytest.raises(ConfigurationException, match="nearest, first, spread"):
            pair.client.stringToProxy("Shared").ice_replicas("fastest")  # type: ignore[arg-type]


class TestUnansweredCalls:
    """What a caller is told when a servant that is there does not answer."""

    def test_call_that_fell_out_of_the_queue_was_not_executed(self, pair: Pair) -> None:
        servant = CalculatorI()
        pair.adapter.add(servant, "Busy")
        proxy = CalculatorPrx.checkedCast(pair.client.stringToProxy("Busy"))
        busy = proxy.sleepAsync(LIMIT)
        assert servant.entered.wait(LIMIT)
        calls = [proxy.countAsync() for _ in range(80)]
        errors = [call.exception(LIMIT) for call in calls[:16]]
        assert {type(error) for error in errors} == {BusyException}
        servant.leave.set()
        assert busy.result(LIMIT) is None
        assert [call.result(LIMIT) for call in calls[16:]] == list(range(1, 65))

    def test_call_that_nobody_takes_is_denied(self, pair: Pair) -> None:
        """Access control drops calls without a word; here the servant that is there takes none."""
        pair.adapter.add(Notebook(), "Guarded")
        incoming = pair.server.local_servants.get(Target("nao", "Guarded"))
        assert isinstance(incoming, Incoming)
        incoming._inboxes[0].close()
        proxy = NotebookPrx.checkedCast(pair.client.stringToProxy("Guarded"))
        with pytest.raises(AccessDeniedException, match=r"Guarded\.about"):
            proxy.about()

    def test_call_that_nobody_explains_may_have_been_executed(self, pair: Pair) -> None:
        """The servant is there by its token alone: whether the call reached it nobody knows."""
        key = servant_token(
            Target("nao", "Mute"), "::test::Notebook", "c0ffee0000000005", pair.server.client_id, 1.0
        )
        with pair.server.session.liveliness().declare_token(key):
            proxy = NotebookPrx.checkedCast(pair.client.stringToProxy("Mute"))
            with pytest.raises(TimeoutException, match=r"Mute\.about got no answer"):
                proxy.about()

    def test_call_whose_link_is_cut_is_lost(self, pair: Pair, remote: NotebookPrx) -> None:
        pair.server.destroy()
        with pytest.raises(ConnectionLostException):
            remote.about()


def test_calls_of_many_servants_leave_nothing_declared(pair: Pair) -> None:
    """Each of them has a querier while somebody has its proxy, and not for ever."""
    pair.adapter.addDefaultServant(Notebook(), "shelf")
    for number in range(400):
        NotebookPrx.uncheckedCast(pair.client.stringToProxy(f"shelf/Book{number}")).about()
    assert len(pair.client._calls._calls) <= 260


def test_first_answer_of_errors_alone_is_an_error(pair: Pair) -> None:
    pair.adapter.add(CalculatorI(), "Calculator", replica=True)
    proxy = CalculatorPrx.checkedCast(pair.client.stringToProxy("Calculator")).ice_replicas("first")
    with pytest.raises(Exception, match="divisor is 0"):
        proxy.divide(1.0, 0.0)
    assert proxy.divide(7.0, 2.0) == (3.0, 1.0)


def test_names_that_are_none_are_refused(pair: Pair) -> None:
    for ask in (pair.client.identities, pair.client.servants):
        with pytest.raises(ConfigurationException, match=r"'nao/\*\*' is no realm"):
            ask("nao/**")
    with pytest.raises(ConfigurationException, match=r"'\*' is no id of a session"):
        pair.client.processStatus("*")


def test_who_is_there_is_not_told_after_the_end(pair: Pair) -> None:
    pair.client.destroy()
    with pytest.raises(CommunicatorDestroyedException):
        pair.client.servants()


def test_untyped_proxy_reaches_a_facet(pair: Pair) -> None:
    pair.adapter.addFacet(Notebook(), "Lamp", "debug")
    ObjectPrx.checkedCast(pair.client.stringToProxy("Lamp -f debug")).ice_ping()
    with pytest.raises(FacetNotExistException, match="'debug'"):
        ObjectPrx.checkedCast(pair.client.stringToProxy("Lamp"))


def test_call_key_is_what_access_control_grants(pair: Pair, notebook: Notebook) -> None:
    """Twoway and oneway alike: rules of access control are made of these keys."""
    sent: list[str] = []
    with pair.client.session.declare_subscriber("nao/**", lambda sample: sent.append(str(sample.key_expr))):
        proxy = NotebookPrx.checkedCast(pair.client.stringToProxy("desk/Notebook"))
        proxy.ice_oneway().note("sent")
        notebook.wait_for(1)
        list(pair.client.session.get("@none/**", timeout=0.1, consolidation=zenoh.ConsolidationMode.NONE))
    assert sent == ["nao/desk/Notebook/note"]
