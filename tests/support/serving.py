"""Serve a servant with an adapter of its own."""

from __future__ import annotations

from typing import TypeVar

from zenoh_ice import Communicator, Object

__all__ = ["serve"]

S = TypeVar("S", bound=Object)


def serve(communicator: Communicator, servant: S, identity: str) -> S:
    """Serve a servant from now on, and return it."""
    adapter = communicator.createObjectAdapter("Test")
    adapter.add(servant, identity)
    adapter.activate()
    return servant
