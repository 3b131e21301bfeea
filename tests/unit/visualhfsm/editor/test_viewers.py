"""What viewers may ask for: a request that is not named here is refused, as a new one is."""

from __future__ import annotations

from typing import Any

import msgspec
import pytest

from visualhfsm._editor import protocol as p
from visualhfsm._editor.handlers import HANDLERS
from visualhfsm._editor.viewers import Viewers, may_view

READING = {p.Attach, p.Detach, p.Hello, p.Imported, p.OutputShown, p.Search}


def made(kind: type[Any]) -> p.Request:
    """A request of a kind, with anything in its fields: only the kind decides."""
    request: p.Request = kind(**dict.fromkeys(kind.__struct_fields__, 1))
    return request


@pytest.mark.parametrize("kind", sorted(HANDLERS, key=str))
def test_only_requests_that_read_are_allowed(kind: type[p.Request]) -> None:
    if kind is not p.Control:
        assert may_view(made(kind)) == (kind in READING)


@pytest.mark.parametrize(
    ("action", "allowed"),
    [
        ("emergencyStop", True),
        ("at", True),
        ("body", True),
        ("resetEmergencyStop", False),
        ("standRobot", False),
        ("placeObject", False),
        ("pushRobot", False),
        ("sayToRobot", False),
        ("pause", False),
        ("force", False),
        ("ros", False),
        ("", False),
    ],
)
def test_of_what_steers_only_the_stop_is_allowed(action: str, *, allowed: bool) -> None:
    request = msgspec.convert({"id": 1, "op": "control", "component": "", "action": action}, p.Request)
    assert may_view(request) == allowed


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
