"""A robot without physics, for tests and for trying out clients: `python -m naoserver.fake` serves it."""

from naoserver.fake.robot import Ball, FakeDevice, FakeRobot, view

__all__ = ["Ball", "FakeDevice", "FakeRobot", "view"]
