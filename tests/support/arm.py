"""An arm of the user's own on a table, and the TOML file beside its URDF."""

from __future__ import annotations

from typing import Final

from tests.support.models import FOLDER

__all__ = ["ARM", "ARM_TOML"]

ARM: Final = (FOLDER / "arm.urdf").read_text("utf-8")
"""A joint that turns without end, and an elbow."""
ARM_TOML: Final = (FOLDER / "arm.toml").read_text("utf-8")
