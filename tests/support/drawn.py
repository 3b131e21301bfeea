"""Robots as the page draws them."""

from __future__ import annotations

import json
from typing import Any

from naoserver.bodies.description import write_looks
from naoserver.body import Body, write_body
from visualhfsm._monitor.realm.description import describe

__all__ = ["drawn"]


def drawn(body: Body) -> dict[str, Any]:
    """Return a body with its looks as the page gets it."""
    found: dict[str, Any] = json.loads(describe(write_body(body), write_looks(body)).page)
    return found
