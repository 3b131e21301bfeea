"""Text from other processes is fit to be shown, whatever they send."""

from __future__ import annotations

import pytest
from hypothesis import given

from tests.support.any_text import any_text
from zenoh_ice.data.text import LONGEST_TEXT, cut, encodable, few, printable, signal_name, without_source


def test_a_long_text_is_cut_and_says_so() -> None:
    assert cut("abcdef", 6) == "abcdef"
    assert cut("abcdefg", 6) == "abc..."
    assert len(cut("x" * 100_000)) == LONGEST_TEXT


@pytest.mark.parametrize("text", ["a\nb", "a\x1bb", "a\u202eb", "a\x00b", "a\ud800b"])
def test_what_forges_a_line_or_controls_a_terminal_is_blank(text: str) -> None:
    assert printable(text) == "a b"


@given(any_text())
def test_any_text_becomes_one_line_that_can_be_sent(text: str) -> None:
    shown = printable(text, 20)
    assert len(shown) <= 20
    assert shown.isprintable()
    assert shown.encode().decode() == shown
    encodable(text).encode()


def test_a_lone_surrogate_becomes_its_escape() -> None:
    assert encodable("a\udcff") == "a\\udcff"


def test_places_in_the_sources_of_zenoh_are_left_out() -> None:
    error = ValueError("unknown mode at /home/ci/zenoh/src/net/runtime.rs:120. is no mode")
    assert without_source(error) == "unknown mode is no mode"


def test_of_many_names_the_first_are_named() -> None:
    assert few(["a", "b", "c"]) == "a, b, c"
    assert few(["a", "b", "c", "d", "e"]) == "a, b, c and 2 more"


@pytest.mark.parametrize(("number", "name"), [(9, "SIGKILL"), (40, "signal 40"), (99, "signal 99")])
def test_a_signal_without_a_name_has_its_number(number: int, name: str) -> None:
    assert signal_name(number) == name
