"""Interpolation between key frames."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from naoserver.moves.motion_file import Interpolation


@given(st.floats(0.0, 1.0))
def test_the_smooth_way_is_as_long_before_its_middle_as_after(part):
    ease = Interpolation.SMOOTH.ease
    assert ease(part) == pytest.approx(1.0 - ease(1.0 - part), abs=1e-9)
