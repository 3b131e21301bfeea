"""What commands say where libqi is missing."""

from __future__ import annotations

import sys

import pytest

from visualhfsm_naoqi import lacking


@pytest.mark.parametrize(
    ("version", "words"), [((3, 12, 9), "qi is not installed"), ((3, 13, 0), "3.11 or 3.12")]
)
def test_qi_is_not_offered_where_it_is_not_built(
    version: tuple[int, int, int], words: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "version_info", version)
    assert words in lacking(ModuleNotFoundError(name="qi"))
