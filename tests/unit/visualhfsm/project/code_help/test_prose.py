"""Docstrings of all kinds as plain sentences."""

from __future__ import annotations

import pytest

from visualhfsm.project._code_help.prose import plain


@pytest.mark.parametrize(
    ("docstring", "sentences"),
    [
        ("", ""),
        ("Find a ball.", "Find a ball."),
        (
            "Walk to a place;\n    stop there.\n\n    It takes a while.",
            "Walk to a place; stop there.\nIt takes a while.",
        ),
        (
            "Say a text.\n\nArgs:\n    text: what to say\n\nRaises:\n    SayError: if it fails",
            "Say a text.",
        ),
        ("Turn.\n\n:param angle: in rad\n:returns: nothing", "Turn."),
        ("Turn.\n:param angle: in rad", "Turn."),
        (
            "array(object, dtype=None, *, copy=True)\n\nCreate an array.\n\nParameters\n----------\nobject : array_like",
            "Create an array.",
        ),
        ("mean(a,\n     axis=None)\n\nReturn the mean.", "Return the mean."),
        ("dict() -> new empty dictionary\ndict(mapping) -> another\n    one", "new empty dictionary"),
        (
            "range(stop) -> range object\nrange(start, stop[, step]) -> range object\n\nReturn numbers.",
            "Return numbers.",
        ),
        (
            "Return ``True`` if :class:`~a.Ball` is *seen*, as in `the guide <b>`_.",
            "Return True if a.Ball is seen, as in the guide.",
        ),
        ("Print *args and **options, 2 * 3 * 4.", "Print *args and **options, 2 * 3 * 4."),
        ("Count.\n\n>>> count()\n3", "Count."),
        ("Options:\n- one\n- two", "Options:\n- one\n- two"),
        ("It is one of these, or none:\n- one\n- two", "It is one of these, or none:"),
        ("Print it.\n\n  end\n    what follows", "Print it."),
        (
            "zip(*all, strict=False) --> Yield tuples until an input ends.",
            "Yield tuples until an input ends.",
        ),
        ("D.items() -> a view on the items", "a view on the items"),
        ("Do it.\n\n.. versionadded:: 3.2", "Do it."),
    ],
)
def test_a_docstring_is_shown_as_its_first_sentences(docstring: str, sentences: str) -> None:
    assert plain(docstring) == sentences
