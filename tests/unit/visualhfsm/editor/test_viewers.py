"""What viewers may ask for: a request that is not named here is refused, as a new one is."""

from __future__ import annotations

import pytest

from visualhfsm._editor import protocol as p
from visualhfsm._editor.handlers import HANDLERS
from visualhfsm._editor.viewers import Viewers

READING = {
    p.Follow, p.Body, p.Unfollow, p.ExplainMoment, p.Facts, p.Hello, p.Imported, p.Moment, p.OutputShown, p.Picture, p.Search, p.Series,
}  # fmt: skip


@pytest.mark.parametrize("kind", sorted(HANDLERS, key=str))
def test_only_requests_that_read_are_allowed_and_the_stop(kind: type[p.Request]) -> None:
    assert HANDLERS[kind].for_viewers == (kind in READING or kind is p.EmergencyStop)


def test_an_address_is_the_same_until_it_is_withdrawn() -> None:
    viewers = Viewers(1)
    assert not viewers.is_shared
    first = viewers.share()
    assert viewers.share() == first
    cookie = viewers.redeem(first)
    assert cookie
    assert viewers.accepts_cookie(f"a=b; {viewers.cookie_name}={cookie}")
    viewers.withdraw()
    assert viewers.redeem(first) is None
    assert not viewers.accepts_cookie(f"{viewers.cookie_name}={cookie}")
    assert viewers.share() != first


def test_nothing_is_accepted_before_an_address_is_shared() -> None:
    viewers = Viewers(1)
    assert viewers.redeem("") is None
    assert not viewers.accepts_cookie(f"{viewers.cookie_name}=")
