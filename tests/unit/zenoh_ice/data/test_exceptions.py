"""The texts of exceptions that interfaces declare."""

from __future__ import annotations

import pytest

from interfaces.jderobot import CommandRefusedException
from tests.support.calculator import DivisionByZero, OtherError
from zenoh_ice import UserException


@pytest.mark.parametrize(
    ("error", "text"),
    [
        (CommandRefusedException("it has a holder", "Ann"), "it has a holder (holder='Ann')"),
        (CommandRefusedException("it is stopped", ""), "it is stopped"),
        (CommandRefusedException("", "Ann"), "holder='Ann'"),
        (DivisionByZero("the divisor is 0", 0.0), "the divisor is 0 (dividend=0.0)"),
        (OtherError(), ""),
    ],
)
def test_the_text_is_what_went_wrong_and_the_members_that_say_more(error: UserException, text: str) -> None:
    assert str(error) == text
