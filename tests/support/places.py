"""Paths of the repository."""

from __future__ import annotations

from pathlib import Path

__all__ = ["DATA", "ROOT"]

ROOT = Path(__file__).resolve().parents[2]
"""The root of the checkout."""

DATA = ROOT / "tests" / "data"
"""The data files of the tests."""
