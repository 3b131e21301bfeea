"""Values of parameters and inputs, as they stand in a document."""

from __future__ import annotations

import contextlib

from hypothesis import given
from hypothesis import strategies as st

from codegen.hfsm.code._values import INPUT_TYPES, PARAMETER_TYPES, ValueTextError, parse_value
from codegen.hfsm.code.names import literal
from codegen.hfsm.document import Text
from tests.support.any_text import any_text

values = {
    "int": st.integers(),
    "float": st.floats(allow_nan=False, allow_infinity=False),
    "bool": st.booleans(),
    "str": any_text(),
}


@given(st.sampled_from(PARAMETER_TYPES).flatmap(lambda name: st.tuples(st.just(name), values[name])))
def test_values_survive_being_written_down_and_read(item: tuple[str, object]) -> None:
    name, written = item
    assert parse_value(name, Text(literal(written))) == written


@given(st.sampled_from(INPUT_TYPES), any_text(max_size=20))
def test_any_text_is_a_value_or_a_fault(name: str, text: str) -> None:
    with contextlib.suppress(ValueTextError):
        parse_value(name, Text(text))
