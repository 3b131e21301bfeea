"""Which way calls go."""

from __future__ import annotations

import gc
import math
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from zenoh_ice._local.routes import Route


class Ending:
    """Garbage, at whose end a call ends, as when another thread runs meanwhile."""

    def __init__(self, route: Route) -> None:
        self.route = route
        self.cycle = self

    def __del__(self) -> None:
        self.route.over_network.popitem()
        if len(self.route.over_network) > 900:
            Ending(self.route)


@contextmanager
def collected_often() -> Iterator[None]:
    former = gc.get_threshold()
    gc.set_threshold(5, 1, 1)
    try:
        yield
    finally:
        gc.set_threshold(*former)


def test_a_call_may_end_while_those_over_the_network_are_looked_at() -> None:
    neighborhood: Any = None
    route = Route(neighborhood, lambda call: None)
    route.over_network.update(dict.fromkeys(range(1000), math.inf))
    gc.collect()
    Ending(route)
    with collected_often():
        assert route.way is None
    assert len(route.over_network) < 1000
