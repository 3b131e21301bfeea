"""Errors of carrying a ball along waypoints."""

from __future__ import annotations

from zenoh_ice.data.exceptions import ZenohIceError


class BallMoverException(ZenohIceError):
    """The root of the errors of ballmover."""


class WaypointException(BallMoverException):
    """A file of waypoints cannot be read; the message starts with file and line."""


class NotArrivedException(BallMoverException):
    """The ball did not come near enough to a waypoint in time."""
