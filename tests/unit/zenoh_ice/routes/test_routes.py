"""Which route leads to a target: through the channels to its only server if that is near, or over the network."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from zenoh_ice.carriers._local.channels import Channels
from zenoh_ice.carriers._local.server import local_space
from zenoh_ice.data.keys import FORMAT, Target, servant_token
from zenoh_ice.routes._calls import Route, Routes
from zenoh_ice.transport import Registration

HEAD = Target("nao", "Head")
ADDRESS = "0123456789abcdef.1.3"
NEAR = Channels(ADDRESS, "abc")


def token(server: str, address: str = ADDRESS, type_id: str = "::nao::PoseHead") -> str:
    return servant_token(HEAD, type_id, "c0ffee", server, 1.0, address=address)


@pytest.fixture
def route() -> Route:
    return Route(lambda server, address: NEAR if (server, address) == ("abc", ADDRESS) else None)


@pytest.mark.parametrize(
    ("tokens", "channels"),
    [
        ([token("abc")], NEAR),
        ([token("abc"), token("abc", type_id="::Ice::Object")], NEAR),
        ([token("abc", "")], None),
        ([token("def")], None),
        ([token("abc"), token("def")], None),
        ([token("abc").removesuffix(str(FORMAT)) + str(FORMAT + 1)], None),
        (["@servant/nao/Head/other"], None),
        ([], None),
    ],
)
def test_the_tokens_of_a_target_say_where_it_is(
    route: Route, tokens: list[str], channels: Channels | None
) -> None:
    for key in tokens:
        route.on_token(key, True)
    assert route.channels is channels


def test_its_users_learn_when_it_leads_elsewhere(route: Route) -> None:
    changes: list[Channels | None] = []
    route.changed.add(lambda: changes.append(route.channels))
    route.on_token(token("abc"), True)
    route.on_token(token("def"), True)
    route.on_token(token("def"), False)
    route.on_token(token("abc"), True)  # again
    route.on_token(token("abc"), False)
    assert changes == [NEAR, None, NEAR, None]


def test_one_that_is_not_told_how_to_find_channels_stays_with_the_network() -> None:
    route = Route()
    route.on_token(token("abc"), True)
    assert route.channels is None


class Watches:
    """What is watched, and who is told of it."""

    def __init__(self) -> None:
        self.open: dict[str, Callable[[str, bool], object]] = {}

    def __call__(self, pattern: str, changed: Callable[[str, bool], object]) -> Registration:
        self.open[pattern] = changed
        return Registration(lambda: self.open.pop(pattern))


def test_those_that_nobody_uses_any_more_are_watched_no_more() -> None:
    watches = Watches()
    routes = Routes(watches)
    kept = routes.route(HEAD)
    for number in range(100):
        routes.route(Target("nao", f"Hfsm.run{number}"))
    assert len(watches.open) == 2  # that of the last one ends with the next
    assert routes.route(HEAD) is kept


def test_one_that_is_used_learns_of_its_servers() -> None:
    watches = Watches()
    route = Routes(watches).route(HEAD)
    changes: list[Channels | None] = []
    route.changed.add(lambda: changes.append(route.channels))
    (note,) = watches.open.values()
    address = f"{local_space()}.1.3"
    note(token("abc", address), True)
    note(token("abc", address), False)
    assert [each is not None for each in changes] == [True, False]
