from __future__ import annotations

import re

import pytest

from codegen._idl.conditions import ConditionError, evaluate


@pytest.mark.parametrize(
    ("condition", "holds"),
    [
        ("1", True),
        ("0x10 == 020 && 16u == 16L", True),
        ("unknown", False),
        ("2 + 3 * 4 == 14 && ( 2 + 3 ) * 4 == 20", True),
        ("- 7 / 2 == - 3 && - 7 % 2 == - 1", True),
        ("! 0 && ~ 0 == - 1 && - - 1 == + 1", True),
        ("1 << 3 == 8 && 8 >> 3 == 1 && 1 << 65 == 2", True),
        ("0x7fffffffffffffff + 1 < 0", True),
        ("( 5 & 4 ) == 4 && ( 5 | 2 ) == 7 && ( 5 ^ 1 ) == 4", True),
        ("1 < 2 && 2 <= 2 && 3 > 2 && 2 >= 2 && 1 != 2", True),
        ("0 ? 1 : 1 ? 0 : 1", False),
        ("1 || 1 / 0", True),
        ("0 && 1 % 0", False),
        ("1 ? 1 : 1 / 0", True),
    ],
)
def test_conditions_have_the_values_of_c(condition: str, *, holds: bool) -> None:
    assert evaluate(condition.split()) == holds


@pytest.mark.parametrize(
    ("condition", "message"),
    [
        ("", "it ends too early"),
        ("1 +", "it ends too early"),
        ("1 1", "unexpected `1`"),
        ("( 1", "`)` is missing"),
        ("1 ? 2", "`:` is missing"),
        ("08", "`08` is not an integer"),
        ("1.5", "`1.5` is not an integer"),
        ("18446744073709551616", "`18446744073709551616` has more than 64 bits"),
        ("9" * 5000, "is not an integer"),
        ("1 / 0", "it divides by 0"),
        ("0 || 1 % 0", "it divides by 0"),
        ("( " * 100_000, "it is nested too deeply"),
    ],
    ids=lambda text: text[:20],
)
def test_what_is_no_condition_is_refused_with_a_reason(condition: str, message: str) -> None:
    with pytest.raises(ConditionError, match=re.escape(message)):
        evaluate(condition.split())


@pytest.mark.slow
def test_long_conditions_are_evaluated() -> None:
    assert evaluate([*(["-"] * 100_000), "1"])
    assert evaluate([*(["1", "+"] * 100_000), "1"])
