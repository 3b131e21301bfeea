"""Tokens that end while somebody begins to watch them, or with a router: none counts any more."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from functools import partial

import pytest

from tests.support.limits import EVENT_LIMIT, START_LIMIT
from tests.support.security import routing
from tests.support.soak import repeated
from tests.support.suite import Pair
from tests.support.waiting import until
from zenoh_ice import Communicator, Settings

TOKENS = 200
ROUNDS = repeated(3, soak=30)
"""It takes the moment: without care, one round of three fails. Each order has a test in unit/zenoh_ice/test_tokens.py."""


class Watch:
    """The tokens of a pattern that exist, as a communicator learns of them."""

    def __init__(self, communicator: Communicator, pattern: str) -> None:
        self.present: set[str] = set()
        communicator.transport.watch(pattern, self._note)

    def shows(self, count: int) -> bool:
        """Return whether so many tokens exist."""
        return len(self.present) == count

    def _note(self, token: str, came: bool) -> None:
        (self.present.add if came else self.present.discard)(token)


def announce(server: Communicator, realm: str) -> ExitStack:
    """Announce many tokens, which end when the result is closed."""
    announced = ExitStack()
    for number in range(TOKENS):
        announced.callback(server.transport.announce(f"@servant/{realm}/S{number}/x").close)
    return announced


def test_tokens_that_end_while_a_second_pattern_is_watched_count_no_more(pair: Pair) -> None:
    for number in range(ROUNDS):
        announced = announce(pair.server, f"r{number}")
        first = Watch(pair.client, f"@servant/r{number}/**")
        until(partial(first.shows, TOKENS))
        all_end_while_watched(announced, pair.server, pair.client, f"r{number}")
        assert first.present == set()


def test_tokens_that_end_while_a_new_session_watches_them_count_no_more(
    pair: Pair, make_communicator: Callable[..., Communicator]
) -> None:
    for number in range(ROUNDS):
        announced = announce(pair.server, f"r{number}")
        late = make_communicator(connect=[pair.endpoint])
        until(late.presence.linked)
        all_end_while_watched(announced, pair.server, late, f"r{number}")
        late.destroy()


def all_end_while_watched(
    announced: ExitStack, server: Communicator, client: Communicator, realm: str
) -> None:
    """End tokens while a client begins to watch them; assert that none counts, for later patterns too."""
    with ThreadPoolExecutor(1) as background:
        ends = background.submit(announced.close)
        watch = Watch(client, f"@servant/{realm}/*/**")
        ends.result(EVENT_LIMIT)
    last = f"@servant/{realm}/last/x"
    shown = server.transport.announce(last)
    until(lambda: watch.present == {last})
    later = Watch(client, f"@servant/{realm}/*/x")
    until(lambda: later.present == {last})
    shown.close()
    until(lambda: not watch.present and not later.present)


@pytest.mark.parametrize("mode", ["client", "peer"])
def test_tokens_known_by_a_router_end_with_it_and_come_back_with_it(
    endpoint: str, make_communicator: Callable[..., Communicator], mode: str
) -> None:
    routed = Settings(mode="router", connect=(), listen=(endpoint,))
    with routing(routed) as router, ExitStack() as steps:
        server = make_communicator(connect=[endpoint], mode="client")
        steps.enter_context(announce(server, "r"))
        client = make_communicator(connect=[endpoint], mode=mode)
        watches = [Watch(client, f"@servant/r/{pattern}") for pattern in ("**", "*/**")]
        until(lambda: all(watch.shows(TOKENS) for watch in watches))
        router.process.kill()
        until(lambda: all(watch.shows(0) for watch in watches))
        with routing(routed):
            until(lambda: all(watch.shows(TOKENS) for watch in watches), START_LIMIT)
