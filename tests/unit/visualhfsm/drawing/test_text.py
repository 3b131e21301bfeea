"""Texts of pictures: their widths, names in circles, and times."""

from __future__ import annotations

import pytest

from visualhfsm._drawing.text import fit_circle, shortened, spoken_time, width


def test_widths_grow_with_the_size_and_count_every_character() -> None:
    assert width("", 12) == 0
    assert width("mm", 20) == 2 * width("m", 20) == 4 * width("m", 10)
    assert width("áñ", 12) == width("an", 12) == width("a\u0301n\u0303", 12)  # accents take no room
    assert width("\u8db3\u7403", 12) == 24
    assert width("\n\U0010ffff", 12) > 0
    assert width("Ελλάδα Москва", 12) < 12 * 12
    assert width("a\N{NO-BREAK SPACE}b", 12) == width("a b", 12)
    assert width("a\N{ZERO WIDTH JOINER}b", 12) == width("ab", 12)


def test_long_texts_are_shortened_at_their_end() -> None:
    assert shortened("short", 12, 150) == "short"
    cut = shortened("self.clock.now() - seen_at > patience", 12, 150)
    assert cut.endswith("…")
    assert width(cut, 12) <= 150 < width(cut[:-1] + "iii…", 12)
    assert shortened("a b c", 12, width("a …", 12)) == "a…"
    assert shortened("anything", 12, 1) == "…"


@pytest.mark.parametrize(
    ("name", "lines"),
    [
        ("walk", ("walk",)),
        ("  walk \n", ("walk",)),
        ("followBall", ("followBall",)),
        ("followTheRedBall", ("followThe", "RedBall")),
        ("go to the wall", ("go to the", "wall")),
        ("look_for_landmarks", ("look_for_", "landmarks")),
        (
            "\u8bc6\u522b\u7ea2\u8272\u7684\u7403\u5e76\u9760\u8fd1\u5b83",
            ("\u8bc6\u522b\u7ea2\u8272\u7684", "\u7403\u5e76\u9760\u8fd1\u5b83"),
        ),
        ("", ()),
        (" ", ()),
    ],
)
def test_names_are_broken_where_words_end(name: str, lines: tuple[str, ...]) -> None:
    assert fit_circle(name).lines == lines


def test_a_name_that_does_not_fit_is_smaller_and_shortened() -> None:
    assert fit_circle("walk").size > fit_circle("approach the ball slowly").size
    fitted = fit_circle("w" * 40 + " and some more words that nobody can read")
    assert len(fitted.lines) == 3
    assert fitted.lines[0].startswith("www")
    assert fitted.lines[0].endswith("…")
    assert fitted.lines[2].endswith("…")


@pytest.mark.parametrize(
    ("written", "spoken"),
    [
        ("500", "500 ms"),
        ("1000", "1 s"),
        (" 1500\n", "1.5 s"),
        ("12345", "12.345 s"),
        ("1234.5", "1234.5 ms"),
        ("60000", "1 min"),
        ("90000", "90 s"),
        ("0.1", "0.1 ms"),
        ("soon", "soon"),
        ("nan", "nan"),
        ("1e999", "1e999"),
        ("", ""),
    ],
)
def test_times_are_written_as_people_say_them(written: str, spoken: str) -> None:
    assert spoken_time(written) == spoken
