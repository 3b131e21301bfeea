"""The output of `nao` for people: compact JSON, figures, images."""

from __future__ import annotations

import io
import json
import time
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from nao_tools._images import png
from nao_tools._output import count_text, duration_text, pretty, span_text
from nao_tools._watch import StreamStatistics
from tests.support.any_text import any_text
from tests.support.examples import examples
from zenoh_ice import Sample

VALUES: st.SearchStrategy[Any] = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | any_text(),
    lambda inner: st.lists(inner, max_size=30) | st.dictionaries(any_text(), inner, max_size=5),
    max_leaves=40,
)


@settings(max_examples=examples(30))
@given(VALUES, st.integers(20, 120))
def test_the_whole_of_a_value_is_json_again(value: Any, columns: int) -> None:
    assert json.loads(pretty(value, columns, whole=True)) == value


@settings(max_examples=examples(30))
@given(
    st.recursive(
        st.integers(-9, 9), lambda inner: st.lists(inner) | st.dictionaries(st.sampled_from("abc"), inner)
    )
)
def test_short_things_stay_within_the_columns(value: Any) -> None:
    depth = json.dumps(value).count("[") + json.dumps(value).count("{")
    assert all(len(line) <= 24 + 2 * depth for line in pretty(value, 24, whole=True).splitlines())


def test_what_fits_stands_on_one_line_and_the_rest_is_filled() -> None:
    value: Any = {"name": "Head", "positions": list(range(20))}
    assert pretty(value, 200) == json.dumps(value)
    assert pretty(value, 40) == (
        '{\n  "name": "Head",\n  "positions": [\n    0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10,\n'
        "    11, 12, 13, 14, 15, 16, 17, 18, 19\n  ]\n}"
    )


def test_people_see_the_beginning_of_long_lists_and_rounded_numbers() -> None:
    assert pretty(list(range(100)), 1000).endswith('30, 31, "... 68 more"]')
    assert pretty([0.1 + 0.2, 1234567.0], 80) == "[0.3, 1234570.0]"
    assert pretty([0.1 + 0.2], 80, whole=True) == "[0.30000000000000004]"


def test_a_text_from_elsewhere_does_not_steer_the_terminal() -> None:
    shown = pretty({"\x1b[2J": "\x9b31m \u202e"}, 80)
    assert shown.isprintable()
    assert json.loads(shown) == {"\x1b[2J": "\x9b31m \u202e"}


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (duration_text(85e-6), "85.0 us"),
        (duration_text(0.00123), "1.23 ms"),
        (duration_text(4.5), "4.50 s"),
        (duration_text(-0.02), "-20.0 ms"),
        (span_text(119), "119 s"),
        (span_text(3600), "60 min"),
        (span_text(50 * 3600), "2 days"),
        (count_text(1, "process", "processes"), "1 process"),
        (count_text(2, "process", "processes"), "2 processes"),
    ],
)
def test_quantities_have_their_unit(text: str, expected: str) -> None:
    assert text == expected


def samples(statistics: StreamStatistics, *sequences: int, period: float = 0.1) -> None:
    start = time.monotonic()
    for index, sequence in enumerate(sequences):
        before = sequences[index - 1] if index else sequence - 1
        lost = max(0, sequence - before - 1)
        statistics.add(Sample(None, sequence, 0.0, 0.0, lost), start + index * period, 0.002 * (index + 1))


def test_a_gap_in_the_numbers_is_a_loss_and_a_lower_number_a_restart() -> None:
    statistics = StreamStatistics()
    samples(statistics, 7, 8, 11, 1, 2)
    assert (statistics.received, statistics.lost, statistics.restarts) == (5, 2, 1)


def test_rate_interval_and_age_are_those_of_what_came() -> None:
    statistics = StreamStatistics()
    assert (statistics.rate(), statistics.ages()) == (None, [])
    samples(statistics, 1, 2, 3, 4, 5)
    assert statistics.rate() == pytest.approx(10.0)
    assert statistics.intervals() == pytest.approx([0.1, 0.1, 0.1, 0.1])
    assert statistics.ages() == pytest.approx([0.002, 0.004, 0.006, 0.008, 0.010])


def test_what_is_written_as_png_is_the_image() -> None:
    pixels = bytes(range(256))[: 3 * 7 * 5]
    with Image.open(io.BytesIO(png(7, 5, pixels))) as image:
        assert (image.size, image.mode, image.tobytes()) == ((7, 5), "RGB", pixels)
