"""A cart of the user's own, with a head on a mast, and the TOML file beside its MJCF."""

from __future__ import annotations

from typing import Final

from tests.support.models import FOLDER

__all__ = ["CART", "CART_TOML"]

CART: Final = (FOLDER / "cart.xml").read_text("utf-8")
CART_TOML: Final = (FOLDER / "cart.toml").read_text("utf-8")
