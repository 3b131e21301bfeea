"""The door to the bodies of robots, for programs and for hardware of one's own."""

from naoserver.bodies.body import LARGEST_DESCRIPTION, Body, read_body, read_description, write_body

__all__ = ["LARGEST_DESCRIPTION", "Body", "read_body", "read_description", "write_body"]
