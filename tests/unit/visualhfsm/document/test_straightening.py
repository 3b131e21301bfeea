"""Code from a word processor or a PDF is straightened, and what strings and comments say is not."""

from __future__ import annotations

import pytest

from visualhfsm._document.straightening import straightened


@pytest.mark.parametrize(
    ("pasted", "expected"),
    [
        ("self.log(\u00a0“Hola”)", 'self.log( "Hola")'),
        ("if\u00a0near:\n\u00a0\u00a0\u202fx = ‘a’", "if near:\n   x = 'a'"),
        ("a – b − c ‐ d — e", "a - b - c - d - e"),
        ("so\u00adnar = 1\u200b\ufeff", "sonar = 1"),
        ("x = {“a”: ‘b’, “c”: […]}", 'x = {"a": \'b\', "c": [...]}'),
        ("«Hola», „Hallo“, ‹a›, `b´", "\"Hola\", \"Hallo\", 'a', 'b'"),
        ("“””a “b”\n– c”””", '"""a “b”\n– c"""'),
        # One quote of a pair is straight.
        ('log("Hola”)', 'log("Hola")'),
        ('log(“Hola")', 'log("Hola")'),
        ('log("Hola”, "x")', 'log("Hola", "x")'),
        ("x = “unfinished – ", 'x = "unfinished - '),
        # Contents stay.
        ("log('It’s – ok')  # “c” – d", "log('It’s – ok')  # “c” – d"),
        ("x = ‘don’t’", "x = 'don’t'"),
        ("log(“the robots’ arms”)", 'log("the robots’ arms")'),
        ('log(“a\u00a0– b",\u00a0c)', 'log("a\u00a0– b", c)'),
        ('log(“say "hi"”)', 'log("say \\"hi\\"")'),
        ("log(“say \"hi\" 'x'”)", 'log("say \\"hi\\" \'x\'")'),
        ('log("a\\"b”)', 'log("a\\"b")'),
        ("x = '''a ’ b'''", "x = '''a ’ b'''"),
        # The expressions in an f-string are code.
        ("f“{d[‘a’]} – {a – b:–>4} {{–}}”", "f\"{d['a']} – {a - b:–>4} {{–}}\""),
        ("f“{d[“a”]}”", "f\"{d['a']}\""),
    ],
)
def test_code_is_straightened_outside_of_what_it_says(pasted: str, expected: str) -> None:
    assert straightened(pasted) == expected
    assert straightened(expected) == expected
