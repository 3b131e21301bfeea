"""Searches of graphs."""

from codegen.graphs import reached

GRAPH = {"a": "bc", "b": "d", "c": "ad", "d": "e", "e": "b"}


def test_what_is_reached_is_found_once_and_the_nearest_first():
    assert [*reached(["a"], GRAPH.__getitem__)] == ["a", "b", "c", "d", "e"]
    assert [*reached("dd", GRAPH.__getitem__)] == ["d", "e", "b"]


def test_nothing_is_reached_from_nowhere():
    assert not reached([], GRAPH.__getitem__)
