"""TOML files: values by their types, and errors with file, line, key, value and advice."""

from __future__ import annotations

from contextlib import suppress
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Literal

import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec import Meta, Struct

from zenoh_ice.data.toml_file import LARGEST_FILE, parse_toml, read_text


class Color(StrEnum):
    RED = "red"
    GREEN = "green"


class Ball(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    radius: Annotated[float, Meta(gt=0.0, description="write a radius in m")]
    mass: Annotated[float, Meta(ge=0.001)] | None = None
    color: Color = Color.RED
    place: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        if self.mass is not None and self.mass > self.radius:
            raise ValueError("too heavy")


class World(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    mode: Literal["fast", "slow"] = "fast"
    balls: list[Ball] = []
    names: dict[Annotated[str, Meta(max_length=3)], Ball] = {}
    texts: dict[str, str] = {}


def refusal(text: str) -> str:
    with pytest.raises(LookupError) as raised:
        parse_toml(text, World, "w.toml", LookupError)
    return str(raised.value)


def test_values_have_their_types(tmp_path: Path) -> None:
    file = tmp_path / "w.toml"
    file.write_bytes(b'\xef\xbb\xbfmode = "slow"\r\n[[balls]]\r\nradius = 1\r\ncolor = "green"\r\n')
    world = parse_toml(read_text(file, LookupError), World, "w.toml", LookupError)
    assert world == World(mode="slow", balls=[Ball(radius=1.0, color=Color.GREEN)])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("speed = 3", "w.toml:1: speed: there is no such key; there is mode, balls, names, texts"),
        ("'a - at `$.b`' = 1", "w.toml:1: a - at `$.b`: there is no such key; there is mode, balls, names, texts"),
        ("mode = 'quick'", "w.toml:1: mode = 'quick': write one of fast, slow"),
        ("# a\n[[balls]]\n# b\nradius = -1", "w.toml:4: balls[0].radius = -1: write a radius in m"),
        ("[[balls]]\nradius = nan", "w.toml:2: balls[0].radius = nan: write a radius in m"),
        (
            "[[balls]]\nradius = 1\n[[ balls ]]\n'radius' = true",
            "w.toml:4: balls[1].radius = true: write a radius in m",
        ),
        (
            "[[balls]]\nradius = 1\nmass = 0.0",
            "w.toml:3: balls[0].mass = 0.0: Expected `float` >= 0.001",
        ),
        ("[[balls]]\nradius = 1\nmass = 'a'", "w.toml:3: balls[0].mass = 'a': write a number"),
        ("[[balls]]\nradius = 1\nmass = 2", "w.toml:1: balls[0]: too heavy"),
        ("[[balls]]\nradius = 1\n[[balls]]\nmass = 2", "w.toml:3: balls[1]: radius is missing"),
        (
            "[[balls]]\nradius = 1\ncolor = 'blue'",
            "w.toml:3: balls[0].color = 'blue': write one of red, green",
        ),
        ("[[balls]]\nradius = 1\nplace = [1, 'a']", "w.toml:3: balls[0].place[1] = 'a': write a number"),
        ("balls = [{radius = 1}, {radius = 'a'}]", "w.toml:1: balls[1].radius = 'a': write a radius in m"),
        ("balls = 3", "w.toml:1: balls = 3: write a list"),
        ("[[names.one]]\nradius = 1", "w.toml:1: names.one = [{'radius': 1}]: write a table"),
        ("[names.one]\nradius = 1\n[names.two]\nradius = 0", "w.toml:4: names.two.radius = 0: write a radius in m"),
        ("[names.three]\nradius = 1", "w.toml:1: names.three = 'three': Expected `str` of length <= 3"),
        ("[texts]\na = 'b'\nc = 3", "w.toml:3: texts.c = 3: write text"),
        (f"mode = '{'x' * 500}'", f"w.toml:1: mode = '{'x' * 196}...: write one of fast, slow"),
        (f"mode = 0x{'f' * 5000}", "w.toml:1: mode = a number of thousands of digits: write one of fast, slow"),
        ("mode = ", "w.toml: not TOML: Invalid value (at end of document)"),
        (f"mode = {'[' * 5000}", "w.toml: not TOML: nested too deeply"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_reported_with_its_place(text: str, message: str) -> None:
    assert refusal(text) == message


def test_a_file_that_cannot_be_read_is_refused(tmp_path: Path) -> None:
    large, binary = tmp_path / "large.toml", tmp_path / "binary.toml"
    large.write_bytes(b"#" * (LARGEST_FILE + 1))
    binary.write_bytes(b"mode = 'slow'\n# \xff")
    for path, message in [
        (tmp_path / "none.toml", "none.toml: cannot be read: No such file"),
        (tmp_path, "cannot be read: Is a directory"),
        (tmp_path / "a\0b", "cannot be read: embedded null byte"),
        (large, "large.toml: larger than 1048576 bytes"),
        (binary, "binary.toml:2: not UTF-8 text"),
    ]:
        with pytest.raises(LookupError, match=message):
            read_text(path, LookupError)


@given(st.text(alphabet="[]{}=\"'.,abr1 \nmodesnatx#", max_size=60))
def test_any_text_is_read_or_refused_by_the_error_asked_for(text: str) -> None:
    with suppress(LookupError):
        parse_toml(text, World, "w.toml", LookupError)
