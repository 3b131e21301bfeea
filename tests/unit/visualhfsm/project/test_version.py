"""Titles of documents without a file."""

from __future__ import annotations

from codegen.hfsm.code.names import component_name
from visualhfsm.project._version import free_title, stem


def test_a_title_is_the_name_of_the_file() -> None:
    assert [stem("a/ball.scxml"), stem(""), stem("x" * 200)] == ["ball", "component", "x" * 100]


def test_no_two_titles_have_the_same_component() -> None:
    assert free_title("My ball", set()) == "My ball"
    assert free_title("My ball", {"My_ball"}) == "My ball 2"
    assert free_title("My ball", {"My_ball", "My_ball_2"}) == "My ball 3"
    long = "ball" * 40
    assert free_title(long, {component_name(long)}) == "ballballballballba 2"
