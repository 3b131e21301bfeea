"""A robot without physics, for tests and for trying out clients: `python -m naoserver.fake` serves it."""

from naoserver.fake.robot import FakeDevice, FakeRobot

__all__ = ["FakeDevice", "FakeRobot"]
