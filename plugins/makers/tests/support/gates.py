"""See who asks the gate of a robot in a test."""

from __future__ import annotations

import pytest

from naoserver.safety._gate import Gate

__all__ = ["clients_that_ask"]


def clients_that_ask(gate: Gate, monkeypatch: pytest.MonkeyPatch) -> set[str]:
    """Return the clients that ask from now on whether they may command; the gate answers as ever."""
    clients: set[str] = set()
    require = gate.require

    def asked(client: str, *, begun: bool = False) -> None:
        clients.add(client)
        require(client, begun=begun)

    monkeypatch.setattr(gate, "require", asked)
    return clients
