"""What names of classes are in messages."""

from __future__ import annotations

__all__ = ["tag"]


def tag(class_name: str) -> str:
    """Return the tag of a message in JSON: the name of its class with a small first letter."""
    return class_name[0].lower() + class_name[1:]
