"""Communicators, and parts of them, with other limits than usual."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

import pytest

from tests.support.suite import Pair
from zenoh_ice import Communicator
from zenoh_ice.threads.limits import Limits

__all__ = ["HASTY", "limited", "limited_pair"]

HASTY: Final = Limits(token_delay=0.05, longest_grace=0.0)
"""Limits of who does not wait for servants that are not there."""


def limited(**limits: Any) -> pytest.MarkDecorator:
    """Run a test with other limits of what its fixtures make of their fixture `limits`."""
    return pytest.mark.parametrize("limits", [Limits(**limits)], ids=[pytest.HIDDEN_PARAM])


def limited_pair(endpoint: str, make_communicator: Callable[..., Communicator], limits: Limits) -> Pair:
    """Return a server that listens and a client connected to it, as the fixture `pair`, with other limits."""
    server = make_communicator(listen=[endpoint], limits=limits)
    client = make_communicator(connect=[endpoint], limits=limits)
    adapter = server.createObjectAdapter("Test")
    adapter.activate()
    return Pair(endpoint, server, client, adapter)
