"""The Nao, with and without joints in its hands."""

from __future__ import annotations

from typing import Final

from naoserver.bodies import find_body

H25: Final = find_body("H25")
H21: Final = find_body("H21")
"""The H25 with hands that do not move and feel nothing."""
